// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/error_budget.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/converged_proxy.h>
#include <palpate/engine/study/internal/scene_variants.h>
#include <palpate/engine/study/internal/study_tally.h>
#include <palpate/engine/text/internal/csv_cell.h>
#include <palpate/engine/truth/surface_audit.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate {
namespace {

constexpr double kMicrometres = 1e6; // um per m
constexpr int kFewBits = 16; // of a mantissa: its error is 256 times that of a float, and measured

/// What all parts of one budget have in common.
class Budget {
public:
    Budget(const Scene& scene, std::span<const DeviceState> inputs, const SceneResources& resources,
           const BudgetSettings& settings, const Progress& progress)
        : variants_(scene, resources), inputs_(inputs), settings_(settings), progress_(progress) {}

    std::vector<ErrorPart> parts(std::shared_ptr<const Scene> scene) {
        own_loop_ = scene->description().loop;
        truth_scene_ = variants_.why_not().empty() ? variants_.by_volume() : scene;
        truth_ = converged(truth_scene_);
        voxelisation();
        extraction(*scene);
        add("stepping", "the scene's method against converged stepping",
            proxies_with(truth_scene_, inputs_, own_loop_, told()), truth_);
        solver();
        together();
        return std::move(parts_);
    }

private:
    using Proxies = ConvergedProxies;

    Progress told() const {
        return [this](double, std::string_view) {
            return !progress_ || progress_(done_, "error budget");
        };
    }
    Proxies converged(std::shared_ptr<const Scene> scene) {
        done_ = std::min(0.95, done_ + 0.1);
        return converged_proxies(std::move(scene), inputs_, told());
    }

    ErrorPart& missing(std::string source, std::string how, std::string why) {
        parts_.push_back({std::move(source), std::move(how), {}, {}, 0.0, std::move(why)});
        return parts_.back();
    }
    ErrorPart& add(std::string source, std::string how, const Proxies& with,
                   const Proxies& without) {
        ErrorPart part{std::move(source), std::move(how), {}, {}, 0.0, {}};
        part.position = distance_between(with, without);
        part.level = from_level(with);
        part.known_to_um =
            std::hypot(with.reference.own_error.rms_um, without.reference.own_error.rms_um);
        if (part.position.frames == 0) part.why_not = "nothing was touched";
        parts_.push_back(std::move(part));
        return parts_.back();
    }
    /// How far proxies are from the level of the truth.
    StudyRun::Error from_level(const Proxies& proxies) const {
        if (!variants_.why_not().empty()) return {};
        return from_level_of(*truth_scene_, proxies);
    }
    static StudyRun::Error from_level_of(const Scene& scene, const Proxies& proxies) {
        const SceneSurface& surface = scene.surfaces().front();
        const auto sampler = surface.baked.field->make_sampler();
        const double trust_m = LevelScale::of(*surface.baked.field, surface.level).trust_m;
        std::vector<double> distances_um;
        for (std::size_t i = 0; i < proxies.proxies.size(); ++i)
            if (proxies.in_contact[i])
                distances_um.push_back(kMicrometres *
                                       std::abs(level_distance(*sampler, proxies.proxies[i],
                                                               surface.level.level, trust_m)));
        return internal::error_of(std::move(distances_um));
    }
    Box path_box() const {
        Box box;
        for (const DeviceState& input : inputs_)
            if (is_finite(input.position)) box.add(input.position);
        for (const Vec3& proxy : truth_.proxies)
            box.add(proxy);
        return box;
    }
    bool touches() const {
        return std::find(truth_.in_contact.begin(), truth_.in_contact.end(), 1) !=
               truth_.in_contact.end();
    }

    void voxelisation();
    void voxels_of_formula(std::shared_ptr<const VoxelVolume> voxels);
    void voxels_of_data();
    void baking_of_data();
    void extraction(const Scene& scene);
    void solver();
    void together();

    internal::SceneVariants variants_;
    std::span<const DeviceState> inputs_;
    BudgetSettings settings_;
    const Progress& progress_;
    double done_ = 0.0;
    LoopDescription own_loop_;
    std::shared_ptr<const Scene> truth_scene_;
    Proxies truth_;
    std::shared_ptr<const Scene> smoothed_scene_; // null: no voxels of a formula
    std::vector<ErrorPart> parts_;
};

void Budget::voxelisation() {
    const std::string words =
        fmt::format("voxels of {:g} mm against the formula", settings_.voxel_mm);
    std::string why = variants_.why_not();
    if (why.empty() && variants_.is_formula()) {
        const auto voxels =
            variants_.voxels_of(*truth_scene_, path_box(), 1e-3 * settings_.voxel_mm);
        if (voxels && touches()) return voxels_of_formula(voxels);
        why = voxels ? "nothing was touched" : "the path's box has too many voxels of this size";
    }
    if (why.empty()) return baking_of_data();
    missing("voxelisation", words, why);
    missing("smoothing", "the smoothed voxels against the voxels", why);
    missing("float32", "values as float32 against exact ones", why);
}

void Budget::voxels_of_formula(std::shared_ptr<const VoxelVolume> voxels) {
    const Proxies plain = converged(variants_.over(voxels, 0.0));
    add("voxelisation", fmt::format("voxels of {:g} mm against the formula", settings_.voxel_mm),
        plain, truth_);
    smoothed_scene_ = variants_.over(voxels, settings_.smooth_voxels);
    add("smoothing",
        fmt::format("a Gaussian of {:g} voxels; the level as given; against none",
                    settings_.smooth_voxels),
        converged(smoothed_scene_), plain)
        .level = {}; // with that of the voxels: not its own
    const auto coarse =
        variants_.voxels_of(*truth_scene_, path_box(), 1e-3 * settings_.voxel_mm, kFewBits);
    ErrorPart& part = add("float32",
                          fmt::format("values of {} bits against 24 and divided by {}: estimated",
                                      kFewBits, 1 << (24 - kFewBits)),
                          converged(variants_.over(coarse, 0.0)), plain);
    const double share = std::ldexp(1.0, kFewBits - 24);
    part.level = {};
    part.position.rms_um *= share;
    part.position.p99_um *= share;
    part.position.max_um *= share;
    part.known_to_um *= share;
}

// What is left of a difference between voxels of 2 h and h for h alone (Richardson). Between nodes
// the surface is off by the square of h and to the same side: its difference is 3 errors. The proxy
// on it is off by its normal, too, by h, and where in a voxel it is decides to which side: from all
// of the difference, where both err to the same side by the first power, down to one part in the
// root of 17, where they err independently by the square. The estimate is the middle.
constexpr double kOfLevel = 1.0 / 3.0;
const double kLeastOfPosition = 1.0 / std::sqrt(17.0);
const double kOfPosition = 0.5 * (1.0 + kLeastOfPosition);
const double kMarginOfPosition = 0.5 * (1.0 - kLeastOfPosition);

/// Whether differences fall from voxels of 4 h and 2 h to those of 2 h and h, by the root at least:
/// if they do not, they say nothing of finer ones.
bool falls(const StudyRun::Error& fine, const StudyRun::Error& coarse) {
    return fine.frames > 0 && coarse.rms_um > std::sqrt(2.0) * fine.rms_um;
}

void scale(StudyRun::Error& error, double factor) {
    error.rms_um *= factor;
    error.p99_um *= factor;
    error.max_um *= factor;
}

void Budget::voxels_of_data() {
    const std::string words = "voxels against finer ones: estimated from every 2nd and every 4th";
    const Box box = path_box();
    const auto half = variants_.over_every(2, box);
    const auto quarter = variants_.over_every(4, box);
    if (!half || !quarter || !touches()) {
        missing("voxelisation", words,
                touches() ? "the data have too few voxels to leave some out"
                          : "nothing was touched");
        return;
    }
    const Proxies of_half = converged(half);
    const Proxies of_quarter = converged(quarter);
    const StudyRun::Error fine = distance_between(of_half, truth_);
    const StudyRun::Error coarse = distance_between(of_quarter, of_half);
    if (!falls(fine, coarse)) {
        missing(
            "voxelisation", words,
            fmt::format("the difference does not fall with the voxels: {} um rms from every 4th "
                        "to every 2nd; {} um from there to all",
                        internal::readable(coarse.rms_um), internal::readable(fine.rms_um)));
        return;
    }
    ErrorPart& part =
        add("voxelisation", words + "; without what the scanner blurred", of_half, truth_);
    scale(part.position, kOfPosition);
    part.known_to_um = std::hypot(part.known_to_um, kMarginOfPosition * fine.rms_um);
    if (falls(part.level, from_level_of(*half, of_quarter)))
        scale(part.level, kOfLevel);
    else
        part.level = {};
}

void Budget::baking_of_data() {
    voxels_of_data();
    const SceneDescription& description = truth_scene_->description();
    const double smoothing = smoothing_of(description.surfaces.at(variants_.name()));
    const std::string words =
        fmt::format("the scene's Gaussian of {:g} voxels against none", smoothing);
    if (smoothing == 0.0) {
        missing("smoothing", words, "the scene does not smooth");
    } else {
        SceneDescription unsmoothed = description;
        unsmoothed.surfaces.at(variants_.name()).smooth_voxels = 0.0;
        add("smoothing", words, truth_, converged(variants_.built(std::move(unsmoothed))))
            .level = {};
    }
    const SceneSurface& surface = truth_scene_->surfaces().front();
    const double slope = LevelScale::of(*surface.baked.field, surface.level).typical_slope;
    missing(
        "float32", "values as float32 against exact ones",
        fmt::format("not measured; half a unit of the last bit at the level is {:.2g} um by "
                    "the typical slope",
                    kMicrometres * std::abs(surface.level.level) * std::ldexp(1.0, -24) / slope));
}

void Budget::extraction(const Scene& scene) {
    const std::string words = "the mesh alone against the level";
    if (!variants_.why_not().empty()) {
        missing("extraction", words, variants_.why_not());
        return;
    }
    try {
        if (!variants_.is_formula()) {
            if (scene.surfaces().front().mesh.scene)
                add("extraction", words, converged(variants_.with_contact(ContactKind::mesh)),
                    truth_);
            else
                missing("extraction", words, "the scene's contact needs no mesh");
            return;
        }
        const IsosurfaceSettings facets = variants_.facets();
        const auto mesh = variants_.mesh_of(*truth_scene_, truth_, facets);
        add("extraction",
            fmt::format("a mesh of {} facets ({:g} mm; {:g} mm) against the level",
                        mesh->triangles.size(), 1e3 * facets.facet_size_m,
                        1e3 * facets.facet_distance_m),
            converged(variants_.with_contact(ContactKind::mesh, mesh)), truth_);
    } catch (const std::runtime_error& error) {
        std::string why = error.what();
        if (why == "cancelled") throw;
        std::replace(why.begin(), why.end(), ',', ';');
        missing("extraction", words, why);
    }
}

void Budget::solver() {
    const std::string words = "one plane at each proxy: solved in double against long double";
    if (!variants_.why_not().empty()) {
        missing("solver", words, variants_.why_not());
        return;
    }
    const SceneSurface& surface = truth_scene_->surfaces().front();
    const auto sampler = surface.baked.field->make_sampler();
    const LevelScale scale = LevelScale::of(*surface.baked.field, surface.level);
    const double stiffness = truth_scene_->description().coupling.stiffness_n_per_m;
    std::vector<double> distances_um;
    for (std::size_t i = 0; i < truth_.proxies.size(); ++i) {
        ContactPlane contact;
        const Vec3& proxy = truth_.proxies[i];
        if (!truth_.in_contact[i] ||
            !level_plane(sampler->sample(proxy), proxy, surface.level.level, surface.level, scale,
                         contact))
            continue;
        PrimitiveSet primitives;
        if (!std::isinf(contact.plane.strength_n)) continue; // yields: it does not place the proxy
        primitives.add(contact.plane);
        const Vec3 probe = inputs_[i].position;
        const Vec3 solved = solve_proxy(primitives, probe, stiffness).proxy;
        const PlanePrimitive& plane = contact.plane;
        long double offset = 0.0L;
        long double squared = 0.0L; // of a normal that is a unit in double alone
        for (int axis = 0; axis < 3; ++axis) {
            const long double n = plane.normal[axis];
            offset += n * (static_cast<long double>(probe[axis]) - plane.anchor[axis]);
            squared += n * n;
        }
        const long double back = std::min(offset, 0.0L) / squared;
        long double error = 0.0L;
        for (int axis = 0; axis < 3; ++axis) {
            const long double left = probe[axis] - back * plane.normal[axis] - solved[axis];
            error += left * left;
        }
        distances_um.push_back(kMicrometres * static_cast<double>(std::sqrt(error)));
    }
    ErrorPart part{"solver", words, internal::error_of(std::move(distances_um)), {}, 0.0, {}};
    if (part.position.frames == 0) part.why_not = "no hard plane was felt";
    parts_.push_back(std::move(part));
}

void Budget::together() {
    if (!smoothed_scene_) return;
    const std::string words = fmt::format("voxels of {:g} mm; smoothed by {:g}; the scene's method",
                                          settings_.voxel_mm, settings_.smooth_voxels);
    add("together", words + ": against the formula",
        proxies_with(smoothed_scene_, inputs_, own_loop_, told()), truth_);
}

} // namespace

std::vector<ErrorPart> error_budget(std::shared_ptr<const Scene> scene,
                                    std::span<const DeviceState> inputs,
                                    const SceneResources& resources, const BudgetSettings& settings,
                                    const Progress& progress) {
    return Budget(*scene, inputs, resources, settings, progress).parts(scene);
}

std::string error_budget_table(const std::vector<ErrorPart>& parts) {
    constexpr const char* kRow = "{:<13} {:>15} {:>10} {:>10} {:>10} {:>12} {:>10}  {}\n";
    std::string text = fmt::format(fmt::runtime(kRow), "error of", "position um rms", "known to",
                                   "p99", "max", "level um rms", "max", "how");
    for (const ErrorPart& part : parts) {
        const auto number = [](const StudyRun::Error& error, double value) {
            return internal::readable(error.frames > 0 ? std::optional(value) : std::nullopt);
        };
        text += fmt::format(
            fmt::runtime(kRow), part.source, number(part.position, part.position.rms_um),
            number(part.position, part.known_to_um), number(part.position, part.position.p99_um),
            number(part.position, part.position.max_um), number(part.level, part.level.rms_um),
            number(part.level, part.level.max_um),
            part.why_not.empty() ? part.how : "not known: " + part.why_not);
    }
    return text;
}

std::string error_budget_csv(const std::vector<ErrorPart>& parts) {
    std::string text = "source,frames,position_rms_um,position_p99_um,position_max_um,level_rms_um,"
                       "level_p99_um,level_max_um,known_to_um,how,why_not\n";
    for (const ErrorPart& part : parts) {
        text += fmt::format("{},{}", part.source, part.position.frames);
        for (const StudyRun::Error& error : {part.position, part.level})
            for (const double value : {error.rms_um, error.p99_um, error.max_um})
                text += "," + (error.frames > 0 ? fmt::format("{:.17g}", value) : "");
        text += part.position.frames > 0 ? fmt::format(",{:.17g}", part.known_to_um) : ",";
        text +=
            fmt::format(",{},{}\n", internal::csv_cell(part.how), internal::csv_cell(part.why_not));
    }
    return text;
}

} // namespace palpate
