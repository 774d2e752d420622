// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/truth/surface_distance.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/range.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/contact/mesh_walk.h>
#include <palpate/volume/fields/nearest_on_level.h>

namespace palpate {
namespace {

const SceneSurface& surface_named(const Scene& scene, std::string_view name) {
    std::string names;
    for (const SceneSurface& surface : scene.surfaces()) {
        if (surface.name == name) return surface;
        names += (names.empty() ? "" : ", ") + surface.name;
    }
    throw std::invalid_argument(
        "surface \"" + std::string(name) + "\" is none that the scene lets one feel; " +
        (names.empty() ? "there are none: add an effect with type = \"surface\""
                       : "give one of: " + names));
}

/// A mesh near the level, where there is one or one can be had quickly.
std::shared_ptr<const SurfaceScene> mesh_near(const SceneSurface& surface) {
    if (surface.mesh.scene || !surface.baked.grid) return surface.mesh.scene;
    auto preview =
        std::make_shared<const TriangleMesh>(surface.baked.grid->preview(surface.level.level));
    return preview->triangles.empty() ? nullptr
                                      : std::make_shared<const SurfaceScene>(std::move(preview));
}

} // namespace

struct SurfaceDistance::Parts {
    Parts(std::shared_ptr<const Scene> of, std::string_view name)
        : scene(required("surface distance: scene", std::move(of))),
          surface(surface_named(*scene, name)), mesh(mesh_near(surface)) {
        if (!surface.is_felt_by_mesh()) sampler = surface.baked.field->make_sampler();
    }

    std::optional<NearestPoint> on_mesh(const Vec3& point) const {
        const auto hit = mesh->closest_point(point, kReach_m);
        if (!hit) return std::nullopt;
        const MeshWalk walk(*surface.mesh.certified);
        const MeshSpot spot = walk.spot_at(hit->triangle, 1, hit->position);
        const bool behind = walk.side_seen_from(spot, point) < 0;
        return NearestPoint{hit->position, hit->normal, behind ? -hit->distance_m : hit->distance_m,
                            !surface.mesh.certified->has_border()};
    }

    std::optional<NearestPoint> on_level(const Vec3& point) const {
        const double feature_m = surface.baked.field->feature_size_m();
        std::optional<LevelFoot> best;
        const auto look_from = [&](const Vec3& start) {
            const auto foot =
                nearest_on_level(*sampler, surface.level.level, feature_m, point, start, kReach_m);
            if (foot && (!best || std::abs(foot->depth_m) < std::abs(best->depth_m))) best = foot;
        };
        look_from(point);
        if (mesh)
            if (const auto hit = mesh->closest_point(point, kReach_m)) look_from(hit->position);
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j)
                for (int k = -1; k <= 1; ++k)
                    if (i != 0 || j != 0 || k != 0)
                        look_from(point + 0.5 * feature_m * glm::normalize(Vec3(i, j, k)));
        if (!best) return std::nullopt;
        NearestPoint nearest;
        nearest.position = best->position;
        nearest.distance_m = -best->depth_m;
        const Vec3 slope = sampler->sample(best->position).slope;
        const double length = glm::length(slope);
        if (length > 0.0) nearest.normal = -slope / length;
        return nearest;
    }

    std::shared_ptr<const Scene> scene;
    const SceneSurface& surface;
    std::shared_ptr<const SurfaceScene> mesh; // null: a formula
    std::unique_ptr<FieldSampler> sampler;    // null: felt by the mesh alone
};

SurfaceDistance::SurfaceDistance(std::shared_ptr<const Scene> scene, std::string_view surface)
    : parts_(std::make_unique<Parts>(std::move(scene), surface)) {}
SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

std::optional<NearestPoint> SurfaceDistance::nearest(const Vec3& point) const {
    if (!is_finite(point)) return std::nullopt;
    return parts_->sampler ? parts_->on_level(point) : parts_->on_mesh(point);
}

} // namespace palpate
