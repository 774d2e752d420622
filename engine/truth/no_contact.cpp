// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/truth/no_contact.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/surface_audit.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

constexpr std::size_t kMostPositions = 500; // looked at: enough to tell a wrong unit
constexpr double kAnywhere = 1e6;           // m: beyond every mesh that is read
constexpr double kLongestStep = 1.0;        // m of Newton's, towards a formula's level

std::string in_mm(const Box& box) {
    const Vec3 lower = 1e3 * box.lower, upper = 1e3 * box.upper;
    return fmt::format("{:.4g} {:.4g} {:.4g} to {:.4g} {:.4g} {:.4g} mm", lower.x, lower.y, lower.z,
                       upper.x, upper.y, upper.z);
}

/// Where surfaces are, and how far from them a point is.
class Surfaces {
public:
    explicit Surfaces(const Scene& scene) {
        for (const SceneSurface& surface : scene.surfaces())
            add(surface);
    }

    const Box& box() const noexcept { return box_; }

    /// To the nearest point of any of them, m.
    double distance(const Vec3& point) const {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& mesh : meshes_)
            if (const auto hit = mesh->closest_point(point, kAnywhere))
                nearest = std::min(nearest, hit->distance_m);
        for (const Formula& formula : formulas_)
            nearest = std::min(nearest, std::abs(level_distance(*formula.sampler, point,
                                                                formula.level, kLongestStep)));
        return nearest;
    }

private:
    struct Formula {
        std::unique_ptr<FieldSampler> sampler;
        double level = 0.0;
    };

    void add(const SceneSurface& surface) {
        std::shared_ptr<const SurfaceScene> mesh = surface.mesh.scene;
        if (!mesh && surface.baked.grid)
            mesh = std::make_shared<SurfaceScene>(std::make_shared<const TriangleMesh>(
                surface.baked.grid->preview(surface.level.level)));
        if (mesh) {
            for (const Vec3& vertex : mesh->mesh().vertices)
                box_.add(vertex);
            meshes_.push_back(std::move(mesh));
            return;
        }
        const Box bounds = surface.baked.field->bounds_at(surface.level.level);
        box_.add(bounds.lower);
        box_.add(bounds.upper);
        formulas_.push_back({surface.baked.field->make_sampler(), surface.level.level});
    }

    Box box_;
    std::vector<std::shared_ptr<const SurfaceScene>> meshes_;
    std::vector<Formula> formulas_;
};

/// Positions all over a path.
std::vector<Vec3> some_of(std::span<const Vec3> probes) {
    std::vector<Vec3> some;
    const std::size_t step = (probes.size() + kMostPositions - 1) / kMostPositions;
    for (std::size_t i = 0; i < probes.size(); i += std::max<std::size_t>(step, 1))
        if (is_finite(probes[i])) some.push_back(probes[i]);
    return some;
}

/// How near a path would come were its file's numbers read as `scale`, after a turn that takes RAS
/// to LPS or leaves them, mm.
double nearest_mm(const Surfaces& surfaces, const std::vector<Vec3>& probes, const Vec3& scale) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& probe : probes)
        nearest = std::min(nearest, surfaces.distance(scale * probe));
    return 1e3 * nearest;
}

bool is_read_from_path(const DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    return device.kind == Kind::path || (device.kind == Kind::hand && !device.file.empty());
}

} // namespace

std::string no_contact_in_words(const Scene& scene, std::span<const Vec3> probes) {
    const std::string begin = fmt::format("{}: nothing is touched in any of the {} frames",
                                          scene.description().file.string(), probes.size());
    const std::string remedy = "; lead the probe to what can be felt";
    const std::vector<Vec3> some = some_of(probes);
    if (scene.surfaces().empty() || some.empty()) return begin + remedy;
    Box box;
    for (const Vec3& probe : probes)
        if (is_finite(probe)) box.add(probe);
    const Surfaces surfaces(scene);
    const double away_mm = nearest_mm(surfaces, some, Vec3(1.0));
    std::string text = fmt::format(
        "{}: the probe is within {}, the surfaces within {} (LPS), the nearest {:.4g} mm away",
        begin, in_mm(box), in_mm(surfaces.box()), away_mm);
    // Where the path is among the surfaces, neither its unit nor its frame is to blame.
    if (!is_read_from_path(scene.description().device) || away_mm == 0.0) return text + remedy;
    const Vec3 turn(-1.0, -1.0, 1.0); // RAS to LPS
    return text + fmt::format("; were the path in millimetres it would be {:.4g} mm, in RAS {:.4g} "
                              "mm, in both {:.4g} mm away: its numbers are to be metres, LPS",
                              nearest_mm(surfaces, some, Vec3(1e-3)),
                              nearest_mm(surfaces, some, turn),
                              nearest_mm(surfaces, some, 1e-3 * turn));
}

std::string no_contact_warning(const Scene& scene, std::span<const FrameReport> frames) {
    if (scene.surfaces().empty() || frames.empty()) return {};
    std::vector<Vec3> probes;
    for (const FrameReport& frame : frames) {
        if (frame.contacts > 0) return {};
        if ((frame.flags & kDeviceStale) == 0) probes.push_back(frame.probe); // else it was nowhere
    }
    if (probes.empty()) return {};
    return no_contact_in_words(scene, probes);
}

} // namespace palpate
