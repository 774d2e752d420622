// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/soft_borders.h>

#include <algorithm>
#include <memory>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>

namespace palpate::internal {
namespace {

constexpr double kBeside = 1.5;       // voxels from a border within which the neighbour is
constexpr double kLeastShared = 10.0; // squared voxels: less is a corner that touches

bool is_within(const Box& box, const Vec3& at) {
    return glm::all(glm::greaterThanEqual(at, box.lower)) &&
           glm::all(glm::lessThanEqual(at, box.upper));
}

/// Area, m2, of one surface that has the other one `beside_m` out of it, and not `behind_m` into
/// it.
double shared_m2(const SceneSurface& one, const SceneSurface& other, double beside_m,
                 double behind_m) {
    const TriangleMesh mesh = one.baked.grid->preview(one.level.level);
    const Box reach = other.baked.grid->bounds();
    const std::unique_ptr<FieldSampler> sampler = other.baked.field->make_sampler();
    const auto is_inside = [&](const Vec3& at) { return sampler->value(at) >= other.level.level; };
    double area_m2 = 0.0;
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const Vec3 twice = glm::cross(b - a, c - a);
        const double length = glm::length(twice);
        const Vec3 centre = (a + b + c) / 3.0;
        if (!(length > 0.0) || !is_within(reach, centre)) continue;
        const Vec3 out = twice / length;
        if (is_inside(centre + beside_m * out) && !is_inside(centre - behind_m * out))
            area_m2 += 0.5 * length;
    }
    return area_m2;
}

/// All labels of two surfaces, as a scene names them.
std::string union_of(const SurfaceDescription& one, const SurfaceDescription& other) {
    std::set<std::string> labels(one.labels.begin(), one.labels.end());
    labels.insert(other.labels.begin(), other.labels.end());
    return fmt::format("label = [\"{}\"]", fmt::join(labels, "\", \""));
}

} // namespace

std::vector<std::string> warnings_of_soft_borders(const Scene& scene) {
    const SceneDescription& description = scene.description();
    std::vector<const SceneSurface*> soft;
    for (const SceneSurface& surface : scene.surfaces()) {
        const SurfaceDescription& said = description.surfaces.at(surface.name);
        if (is_soft(description, said) && !said.labels.empty() && surface.baked.grid)
            soft.push_back(&surface);
    }
    std::vector<std::string> warnings;
    for (std::size_t i = 0; i < soft.size(); ++i)
        for (std::size_t k = i + 1; k < soft.size(); ++k) {
            const SceneSurface &one = *soft[i], &other = *soft[k];
            const SurfaceDescription& said = description.surfaces.at(one.name);
            const SurfaceDescription& of_other = description.surfaces.at(other.name);
            if (said.volume != of_other.volume) continue;
            const double voxel_m =
                std::max(one.baked.field->feature_size_m(), other.baked.field->feature_size_m());
            // Where they meet, smoothing leads each into the other (BakedSurface::joined).
            const double into = std::max(smoothing_of(said), smoothing_of(of_other));
            const double area_m2 =
                shared_m2(one, other, kBeside * voxel_m, (kBeside + 2.0 * into) * voxel_m);
            if (area_m2 < kLeastShared * voxel_m * voxel_m) continue;
            warnings.push_back(fmt::format(
                "surfaces {} and {} are both soft and share a border of {:.3g} cm2, where each "
                "pushes a finger to its own side: make them one surface, {}",
                one.name, other.name, 1e4 * area_m2, union_of(said, of_other)));
        }
    return warnings;
}

} // namespace palpate::internal
