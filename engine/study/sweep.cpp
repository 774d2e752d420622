// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/sweep.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/spread.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/interleaved.h>
#include <palpate/engine/study/internal/scene_variants.h>
#include <palpate/engine/study/internal/study_columns.h>

namespace palpate {
namespace {

constexpr std::array kSpeeds_m_per_s{0.05, 0.1, 0.2, 0.5, 1.0, 2.0};
constexpr std::array kVoxels_mm{4.0, 2.0, 1.0, 0.5};
constexpr std::array kFacets_mm{8.0, 4.0, 2.0, 1.0};
constexpr double kFacetDistance = 0.1; // of the facet's size: as 0.2 mm is of 2 mm
constexpr std::array kStiffness_n_per_m{100.0, 200.0, 500.0, 1000.0, 2000.0};
constexpr std::array kRates_hz{500.0, 1000.0, 2000.0, 5000.0, 10000.0};
constexpr std::array kContacts{ContactKind::volume, ContactKind::direct, ContactKind::guarded,
                               ContactKind::mesh};

/// One value of a sweep, with all that its rows refer to.
struct Point {
    SweepRow row;
    std::shared_ptr<const Scene> scene; // null: it cannot be built
    std::shared_ptr<const Scene> truth;
    std::vector<DeviceState> inputs;
    double rate_hz = 0.0;
    ConvergedProxies converged;
};

/// Median speed of the probe where it moves, m/s.
double speed_of(std::span<const DeviceState> inputs, double rate_hz) {
    std::vector<double> speeds;
    for (std::size_t i = 1; i < inputs.size(); ++i) {
        const double way_m = glm::length(inputs[i].position - inputs[i - 1].position);
        if (inputs[i].trial == inputs[i - 1].trial && way_m > 0.0)
            speeds.push_back(way_m * rate_hz);
    }
    return internal::spread_of(std::move(speeds)).p50;
}

class Sweeping {
public:
    Sweeping(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
             const SceneResources& resources, const Progress& progress)
        : scene_(std::move(scene)), inputs_(inputs), variants_(*scene_, resources),
          progress_(progress), rate_hz_(scene_->description().loop.rate_hz) {
        truth_ = variants_.why_not().empty() ? variants_.by_volume() : scene_;
    }

    /// The values of a sweep, each built or with the reason why it is not.
    std::deque<Point>& points(SweepKind kind) {
        switch (kind) {
        case SweepKind::speed:
            return speeds();
        case SweepKind::voxels:
            return voxels();
        case SweepKind::facets:
            return facets();
        case SweepKind::stiffness:
            return stiffness();
        case SweepKind::rate:
            return rates();
        case SweepKind::contact:
            break;
        }
        return contacts();
    }

private:
    Point& add(double value) {
        points_.emplace_back();
        Point& point = points_.back();
        point.row.value = value;
        point.scene = scene_;
        point.truth = truth_;
        point.inputs.assign(inputs_.begin(), inputs_.end());
        point.rate_hz = rate_hz_;
        return point;
    }
    template <class Build>
    void add_built(double value, const Build& build) {
        Point& point = add(value);
        try {
            if (!variants_.why_not().empty()) throw std::runtime_error(variants_.why_not());
            point.scene = build(point);
        } catch (const std::exception& error) {
            point.scene = nullptr;
            point.row.why_not = error.what();
            if (point.row.why_not == "cancelled") throw;
            std::replace(point.row.why_not.begin(), point.row.why_not.end(), ',', ';');
        }
    }
    void require_formula() const {
        if (variants_.why_not().empty() && !variants_.is_formula())
            throw std::runtime_error("the volume is no formula");
    }
    const ConvergedProxies& touched() {
        if (touched_.proxies.empty()) touched_ = converged_proxies(truth_, inputs_, progress_);
        return touched_;
    }

    std::deque<Point>& speeds() {
        const double own = speed_of(inputs_, rate_hz_);
        for (const double speed : kSpeeds_m_per_s) {
            Point& point = add(speed);
            if (own > 0.0) {
                point.inputs = resampled(inputs_, rate_hz_, speed / own, rate_hz_);
                continue;
            }
            point.scene = nullptr;
            point.row.why_not = "the probe does not move";
        }
        return points_;
    }
    std::deque<Point>& rates() {
        for (const double rate_hz : kRates_hz) {
            Point& point = add(rate_hz);
            point.inputs = resampled(inputs_, rate_hz_, 1.0, rate_hz);
            point.rate_hz = rate_hz;
        }
        return points_;
    }
    std::deque<Point>& voxels() {
        for (const double size_mm : kVoxels_mm)
            add_built(size_mm, [&](Point& point) {
                require_formula();
                Box box;
                for (const DeviceState& input : inputs_)
                    if (is_finite(input.position)) box.add(input.position);
                for (const Vec3& proxy : touched().proxies)
                    box.add(proxy);
                const auto made = variants_.voxels_of(*truth_, box, 1e-3 * size_mm);
                if (!made) throw std::runtime_error("the path's box has too many of these voxels");
                point.row.size = static_cast<double>(made->voxels());
                return variants_.over(made, 0.0);
            });
        return points_;
    }
    std::deque<Point>& facets() {
        for (const double size_mm : kFacets_mm)
            add_built(size_mm, [&](Point& point) {
                require_formula();
                IsosurfaceSettings facets;
                facets.facet_size_m = 1e-3 * size_mm;
                facets.facet_distance_m = kFacetDistance * facets.facet_size_m;
                const auto mesh = variants_.mesh_of(*truth_, touched(), facets);
                point.row.size = static_cast<double>(mesh->triangles.size());
                return variants_.with_contact(ContactKind::mesh, mesh);
            });
        return points_;
    }
    std::deque<Point>& stiffness() {
        for (const double n_per_m : kStiffness_n_per_m)
            add_built(n_per_m, [&](Point& point) {
                const auto stiff = [&](const Scene& as) {
                    SceneDescription description = as.description();
                    description.coupling.stiffness_n_per_m = n_per_m;
                    return variants_.built(std::move(description));
                };
                point.truth = stiff(*truth_);
                return stiff(*scene_);
            });
        return points_;
    }
    std::deque<Point>& contacts() {
        std::shared_ptr<const TriangleMesh> mesh;
        for (const ContactKind contact : kContacts) {
            add_built(0.0, [&](Point&) {
                if (variants_.is_formula() && contact != ContactKind::volume && !mesh)
                    mesh = variants_.mesh_of(*truth_, touched(), variants_.facets());
                return variants_.with_contact(contact, mesh);
            });
            points_.back().row.contact = name(contact);
        }
        return points_;
    }

    std::shared_ptr<const Scene> scene_;
    std::span<const DeviceState> inputs_;
    internal::SceneVariants variants_;
    const Progress& progress_;
    double rate_hz_;
    std::shared_ptr<const Scene> truth_; // the one surface by its volume, or the scene
    ConvergedProxies touched_;
    std::deque<Point> points_;
};

/// The scene's own methods; paper, whose clock makes each run another, is left to the main table.
std::vector<LoopDescription> methods_of(const LoopDescription& own, double rate_hz) {
    std::vector<LoopDescription> methods;
    for (const SteppingMethod method :
         {SteppingMethod::single, SteppingMethod::fixed, SteppingMethod::adaptive}) {
        methods.push_back(own);
        methods.back().method = method;
        methods.back().rate_hz = rate_hz;
        methods.back().budget_us.reset(); // longer than the period at some rates, and of paper only
    }
    return methods;
}

std::vector<PowerFit> fits_of(const Sweep& sweep) {
    using Pairs = std::vector<std::array<double, 2>>;
    std::map<std::string, Pairs> errors, times;
    const bool against_level = sweep.kind == SweepKind::voxels || sweep.kind == SweepKind::facets;
    for (const SweepRow& row : sweep.rows) {
        if (!row.why_not.empty() || row.run.frames_in_contact == 0) continue;
        const std::string method{method_of(row.run)};
        const StudyRun::Error& error = against_level ? row.run.level : row.run.converged;
        errors[method].push_back({row.value, error.rms_um});
        if (row.size > 0.0) times[method].push_back({row.size, row.run.spent_p50_us});
    }
    std::vector<PowerFit> fits;
    const auto add = [&](const std::map<std::string, Pairs>& all, const std::string& what) {
        for (const auto& [method, pairs] : all)
            if (auto fit = fit_power(fmt::format("{}: {}", method, what), pairs))
                fits.push_back(std::move(*fit));
    };
    if (sweep.kind == SweepKind::contact) return fits;
    add(errors,
        fmt::format("{} um rms over {}", against_level ? "level" : "position", name(sweep.kind)));
    add(times, fmt::format("us p50 over the number of {}", name(sweep.kind)));
    return fits;
}

} // namespace

std::string_view name(SweepKind kind) noexcept {
    switch (kind) {
    case SweepKind::speed:
        return "speed";
    case SweepKind::voxels:
        return "voxels";
    case SweepKind::facets:
        return "facets";
    case SweepKind::stiffness:
        return "stiffness";
    case SweepKind::rate:
        return "rate";
    case SweepKind::contact:
        break;
    }
    return "contact";
}

std::string_view unit(SweepKind kind) noexcept {
    switch (kind) {
    case SweepKind::speed:
        return "m/s";
    case SweepKind::voxels:
    case SweepKind::facets:
        return "mm";
    case SweepKind::stiffness:
        return "N/m";
    case SweepKind::rate:
        return "Hz";
    case SweepKind::contact:
        break;
    }
    return "";
}

std::vector<DeviceState> resampled(std::span<const DeviceState> inputs, double rate_hz,
                                   double faster, double new_rate_hz) {
    std::vector<DeviceState> path;
    if (inputs.empty()) return path;
    const double rows_per_frame = faster * rate_hz / new_rate_hz;
    const double last = static_cast<double>(inputs.size() - 1);
    for (std::size_t i = 0; static_cast<double>(i) * rows_per_frame <= last * (1.0 + 1e-12); ++i) {
        const double row = std::min(static_cast<double>(i) * rows_per_frame, last);
        const auto before = static_cast<std::size_t>(row);
        const std::size_t after = std::min(before + 1, inputs.size() - 1);
        const double share = row - static_cast<double>(before);
        DeviceState state = inputs[before];
        state.time_s = static_cast<double>(i) / new_rate_hz;
        if (inputs[after].trial == state.trial)
            state.position += share * (inputs[after].position - state.position);
        path.push_back(state);
    }
    return path;
}

std::optional<PowerFit> fit_power(std::string of, std::span<const std::array<double, 2>> pairs) {
    std::vector<std::array<double, 2>> logs;
    for (const auto& [x, y] : pairs)
        if (std::isfinite(x) && std::isfinite(y) && x > 0.0 && y > 0.0)
            logs.push_back({std::log(x), std::log(y)});
    if (logs.size() < 3) return {};
    const double count = static_cast<double>(logs.size());
    double mean_x = 0.0, mean_y = 0.0;
    for (const auto& [x, y] : logs) {
        mean_x += x / count;
        mean_y += y / count;
    }
    double xx = 0.0, xy = 0.0;
    for (const auto& [x, y] : logs) {
        xx += (x - mean_x) * (x - mean_x);
        xy += (x - mean_x) * (y - mean_y);
    }
    if (!(xx > 0.0)) return {};
    const double exponent = xy / xx;
    double left = 0.0;
    for (const auto& [x, y] : logs) {
        const double off = y - mean_y - exponent * (x - mean_x);
        left += off * off;
    }
    return PowerFit{std::move(of), logs.size(), exponent, std::sqrt(left / (count - 2.0) / xx)};
}

Sweep run_sweep(SweepKind kind, std::shared_ptr<const Scene> scene,
                std::span<const DeviceState> inputs, const SceneResources& resources,
                int repetitions, Clock& clock, const Progress& progress) {
    Sweeping sweeping(scene, inputs, resources, progress);
    std::deque<Point>& points = sweeping.points(kind);
    std::vector<internal::StudyEntry> entries;
    for (Point& point : points) {
        if (!point.scene) continue;
        point.converged = converged_proxies(point.truth, point.inputs, progress, point.rate_hz);
        for (const LoopDescription& loop : methods_of(scene->description().loop, point.rate_hz))
            entries.push_back(
                {point.scene, loop, {}, point.inputs, point.truth.get(), {}, &point.converged});
    }
    std::vector<StudyRun> runs = internal::run_interleaved(
        entries, repetitions, clock, fmt::format("sweeping {}", name(kind)), progress);
    Sweep sweep{kind, {}, {}};
    std::size_t next = 0;
    for (const Point& point : points) {
        if (!point.scene) sweep.rows.push_back(point.row);
        const std::size_t methods =
            point.scene ? methods_of(scene->description().loop, point.rate_hz).size() : 0;
        for (std::size_t i = 0; i < methods; ++i) {
            SweepRow row = point.row;
            if (row.contact.empty() && !point.scene->surfaces().empty())
                row.contact = name(point.scene->surfaces().front().contact);
            row.run = std::move(runs[next++]);
            sweep.rows.push_back(std::move(row));
        }
    }
    sweep.fits = fits_of(sweep);
    return sweep;
}

std::string sweep_table(const Sweep& sweep) {
    constexpr const char* kRow = "{:>10} {:<8} {:>9} {:<18} {:>8} {:>8} {:>8} {:>12} {:>12}\n";
    std::string text = fmt::format(
        fmt::runtime(kRow), fmt::format("{} {}", name(sweep.kind), unit(sweep.kind)), "contact",
        "size", "method", "us p50", "p10", "p90", "level um rms", "position rms");
    for (const SweepRow& row : sweep.rows) {
        const std::string value =
            sweep.kind == SweepKind::contact ? "" : fmt::format("{:g}", row.value);
        if (!row.why_not.empty()) {
            text += fmt::format("{:>10} {:<8} not known: {}\n", value, row.contact, row.why_not);
            continue;
        }
        const auto number = [](bool known, double of) {
            return internal::readable(known ? std::optional(of) : std::nullopt);
        };
        const bool felt = row.run.frames_in_contact > 0;
        text +=
            fmt::format(fmt::runtime(kRow), value, row.contact, number(row.size > 0.0, row.size),
                        title(row.run), number(felt, row.run.spent_p50_us),
                        number(felt, row.run.spent_p50_range_us.p10_us),
                        number(felt, row.run.spent_p50_range_us.p90_us),
                        number(row.run.level.frames > 0, row.run.level.rms_um),
                        number(row.run.converged.frames > 0, row.run.converged.rms_um));
    }
    for (const PowerFit& fit : sweep.fits)
        text += fmt::format("{}: to the power of {:.2f} +- {:.2f} ({} points)\n", fit.of,
                            fit.exponent, fit.standard_error, fit.points);
    return text;
}

std::string sweep_csv(std::span<const Sweep> sweeps) {
    std::string text = "sweep,value,unit,contact,size,method,setting,spent_p50_us,spent_p50_p10_us,"
                       "spent_p50_p90_us,spent_p99_us,evaluations_mean,level_rms_um,level_max_um,"
                       "converged_rms_um,converged_max_um,why_not\n";
    const auto cell = [](bool known, double value) {
        return known ? fmt::format(",{:.17g}", value) : std::string(",");
    };
    for (const Sweep& sweep : sweeps)
        for (const SweepRow& row : sweep.rows) {
            const StudyRun& run = row.run;
            const bool ran = row.why_not.empty();
            const bool felt = ran && run.frames_in_contact > 0;
            const std::optional<double> setting =
                ran ? internal::setting_of(run) : std::optional<double>();
            text += fmt::format("{}", name(sweep.kind)) +
                    cell(sweep.kind != SweepKind::contact, row.value) +
                    fmt::format(",{},{}", unit(sweep.kind), row.contact) +
                    cell(row.size > 0.0, row.size) + fmt::format(",{}", ran ? method_of(run) : "") +
                    cell(setting.has_value(), setting.value_or(0.0)) +
                    cell(felt, run.spent_p50_us) + cell(felt, run.spent_p50_range_us.p10_us) +
                    cell(felt, run.spent_p50_range_us.p90_us) + cell(felt, run.spent_p99_us) +
                    cell(felt, run.evaluations_mean) +
                    cell(ran && run.level.frames > 0, run.level.rms_um) +
                    cell(ran && run.level.frames > 0, run.level.max_um) +
                    cell(ran && run.converged.frames > 0, run.converged.rms_um) +
                    cell(ran && run.converged.frames > 0, run.converged.max_um) + "," +
                    row.why_not + "\n";
        }
    return text;
}

} // namespace palpate
