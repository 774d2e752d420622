// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/internal/surface_statuses.h>

#include <limits>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/volume/fields/nearest_on_level.h>

namespace palpate::internal {
namespace {

using Standing = SurfaceStatus::Standing;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

Standing standing_of(const LoopSurface& surface) noexcept {
    const SurfaceState state = surface.contact().state();
    if (surface.gain_value(SurfacePart::strength) == 0.0) return Standing::off;
    if (state == SurfaceState::inside)
        return surface.began_inside() ? Standing::began_inside : Standing::open;
    if (state == SurfaceState::yielded || surface.yields()) return Standing::yielding;
    return surface.is_felt() ? Standing::touched : Standing::out;
}

} // namespace

SurfaceStatuses::SurfaceStatuses(const Scene& scene)
    : scene_(scene), statuses_(scene.surfaces().size()) {
    for (const SceneSurface& surface : scene.surfaces())
        samplers_.push_back(surface.is_felt_by_mesh() ? nullptr
                                                      : surface.baked.field->make_sampler());
}

std::span<const SurfaceStatus> SurfaceStatuses::of(const Subdivision& subdivision,
                                                   const Vec3& proxy) noexcept {
    for (std::size_t i = 0; i < statuses_.size(); ++i) {
        const LoopSurface& surface = subdivision.surface(i);
        SurfaceStatus& status = statuses_[i];
        status.standing = standing_of(surface);
        status.guarded = surface.contact().guarded();
        const MovingSurface* body = surface.moving();
        const Vec3& place = subdivision.place_on(i, proxy);
        status.depth_m = depth_m(i, status.standing, body ? body->to_body(place) : place);
    }
    return statuses_;
}

/// `proxy` as the surface's own body sees it.
double SurfaceStatuses::depth_m(std::size_t i, Standing standing, const Vec3& proxy) noexcept {
    const SceneSurface& surface = scene_.surfaces()[i];
    if (samplers_[i]) {
        const auto foot =
            foot_on_level(*samplers_[i], surface.level.level, surface.baked.field->feature_size_m(),
                          proxy, SurfaceStatus::kDepthReach_m);
        return foot ? foot->depth_m : kUnknown;
    }
    if (standing == Standing::off) return kUnknown;
    const auto near = surface.mesh.scene->closest_point(proxy, SurfaceStatus::kDepthReach_m);
    if (!near) return kUnknown;
    const bool behind = standing == Standing::yielding || standing == Standing::open;
    return behind ? near->distance_m : -near->distance_m;
}

} // namespace palpate::internal
