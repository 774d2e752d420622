// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/sweep.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/baseline_contestant.h>
#include <palpate/engine/study/internal/interleaved.h>
#include <palpate/engine/study/internal/study_columns.h>
#include <palpate/engine/study/internal/sweep_points.h>
#include <palpate/engine/text/internal/csv_cell.h>

namespace palpate {
namespace {

// Of method paper: more than the paper's 46 sub-steps here, and less than the period at each rate.
constexpr double kMostBudget_us = 50.0;

/// The scene's own methods; paper with a budget that is the same at all rates.
std::vector<LoopDescription> methods_of(const LoopDescription& own, double rate_hz) {
    std::vector<LoopDescription> methods;
    for (const SteppingMethod method : {SteppingMethod::single, SteppingMethod::fixed,
                                        SteppingMethod::paper, SteppingMethod::adaptive}) {
        methods.push_back(own);
        methods.back().method = method;
        methods.back().rate_hz = rate_hz;
        methods.back().budget_us.reset(); // longer than the period at some rates, and of paper only
        if (method == SteppingMethod::paper)
            methods.back().budget_us = std::min(budget_of(own), kMostBudget_us);
    }
    return methods;
}

/// All that runs at one value.
std::vector<internal::StudyEntry> entries_of(const internal::SweepPoint& point,
                                             const LoopDescription& own) {
    std::vector<internal::StudyEntry> entries;
    internal::StudyEntry entry{point.scene, own, {}, point.inputs, point.truth.get()};
    entry.converged = &point.converged;
    for (const LoopDescription& loop : methods_of(own, point.rate_hz)) {
        entry.loop = loop;
        entries.push_back(entry);
    }
    if (point.has_baselines)
        internal::add_baselines(entry, point.mesh, entries);
    else if (point.mesh)
        internal::add_finger_proxy(entry, point.mesh, entries);
    return entries;
}

std::vector<PowerFit> fits_of(const Sweep& sweep) {
    using Pairs = std::vector<std::array<double, 2>>;
    std::map<std::string, Pairs> errors, times;
    const bool against_level = sweep.kind == SweepKind::voxels || sweep.kind == SweepKind::facets;
    for (const SweepRow& row : sweep.rows) {
        if (!row.why_not.empty() || row.run.frames_in_contact == 0) continue;
        const std::string method{method_of(row.run)};
        const StudyRun::Error& error = against_level ? row.run.level : row.run.converged;
        if (against_level || error.rms_um > row.known_to_um)
            errors[method].push_back({row.value, error.rms_um});
        const bool chooses_time = !row.run.baseline && row.run.loop.method == SteppingMethod::paper;
        if (row.size > 0.0 && !chooses_time)
            times[method].push_back({row.size, row.run.spent_p50_us});
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
        if (share > 0.0 && inputs[after].trial == state.trial)
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
    std::deque<internal::SweepPoint> points =
        internal::sweep_points(kind, scene, inputs, resources, progress);
    std::vector<internal::StudyEntry> entries;
    std::vector<const internal::SweepPoint*> point_of; // of each entry
    for (internal::SweepPoint& point : points) {
        if (!point.scene) continue;
        point.converged = converged_proxies(point.truth, point.inputs, progress, point.rate_hz);
        for (internal::StudyEntry& entry : entries_of(point, scene->description().loop)) {
            entries.push_back(std::move(entry));
            point_of.push_back(&point);
        }
    }
    std::vector<StudyRun> runs = internal::run_interleaved(
        entries, repetitions, clock, fmt::format("sweeping {}", name(kind)), progress);
    Sweep sweep{kind, {}, {}};
    std::size_t next = 0;
    for (const internal::SweepPoint& point : points) {
        if (!point.scene) sweep.rows.push_back(point.row);
        for (; next < runs.size() && point_of[next] == &point; ++next) {
            SweepRow row = point.row;
            if (row.contact.empty() && !point.scene->surfaces().empty())
                row.contact = name(point.scene->surfaces().front().contact);
            row.run = std::move(runs[next]);
            row.known_to_um = point.converged.reference.own_error.rms_um;
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
        const double position_um = row.run.converged.rms_um;
        const std::string position = position_um < row.known_to_um
                                         ? "< " + internal::readable(row.known_to_um)
                                         : internal::readable(position_um);
        text +=
            fmt::format(fmt::runtime(kRow), value, row.contact, number(row.size > 0.0, row.size),
                        title(row.run), number(felt, row.run.spent_p50_us),
                        number(felt, row.run.spent_p50_range_us.p10_us),
                        number(felt, row.run.spent_p50_range_us.p90_us),
                        number(row.run.level.frames > 0, row.run.level.rms_um),
                        row.run.converged.frames > 0 ? position : internal::readable({}));
    }
    for (const PowerFit& fit : sweep.fits)
        text += fmt::format("{}: to the power of {:.2f} +- {:.2f} ({} points)\n", fit.of,
                            fit.exponent, fit.standard_error, fit.points);
    return text;
}

std::string sweep_csv(std::span<const Sweep> sweeps) {
    std::string text = "sweep,value,unit,contact,size,method,setting,spent_p50_us,spent_p50_p10_us,"
                       "spent_p50_p90_us,spent_p99_us,evaluations_mean,level_rms_um,level_max_um,"
                       "converged_rms_um,converged_max_um,why_not,known_to_um\n";
    const auto cell = [](bool known, double value) {
        return known && std::isfinite(value) ? fmt::format(",{:.17g}", value) : std::string(",");
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
                    internal::csv_cell(row.why_not) +
                    cell(ran && run.converged.frames > 0, row.known_to_um) + "\n";
        }
    return text;
}

} // namespace palpate
