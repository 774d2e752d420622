// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/internal/frame_truth.h>

#include <cmath>

namespace palpate::internal {

FrameTruth::FrameTruth(const Scene& scene) {
    for (const SceneSurface& surface : scene.surfaces())
        audits_.emplace_back(scene, surface);
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (!planned.on || effect.kind != EffectKind::gradient_surface) continue;
        const VolumeDescription& volume = scene.description().volumes.at(effect.volume);
        if (volume.analytic.empty()) continue;
        const auto field = scene.effect_field(effect.volume);
        walls_.push_back({field->make_sampler(), LevelScale::of(*field, {}).trust_m,
                          FeltSphere::of(volume, 0.0)});
    }
}

std::optional<FrameError> FrameTruth::of(const FrameReport& frame) {
    std::optional<FrameError> worst;
    const auto take = [&](const std::optional<FrameError>& error) {
        if (error && (!worst || std::abs(error->level_m) > std::abs(worst->level_m))) worst = error;
    };
    for (SurfaceAudit& audit : audits_)
        take(of_surface(audit, frame));
    if (frame.flags & kProbeNotFinite) return worst;
    for (Wall& wall : walls_)
        take(of_wall(wall, frame));
    return worst;
}

std::optional<FeltSphere> FrameTruth::sphere() const noexcept {
    if (audits_.empty() && walls_.size() == 1) return walls_.front().sphere;
    if (walls_.empty() && audits_.size() == 1) return audits_.front().sphere();
    return {};
}

std::optional<FrameError> FrameTruth::of_surface(SurfaceAudit& audit, const FrameReport& frame) {
    const std::vector<double>& distances =
        audit.surface().is_felt_by_mesh() ? audit.mesh_distance_m() : audit.level_distance_m();
    const std::size_t before = distances.size();
    audit.add(frame, {}); // its chords are not asked for
    if (distances.size() == before) return {};
    FrameError error{distances.back(), {}};
    if (!audit.position_error_m().empty()) error.position_m = audit.position_error_m().back();
    return error;
}

std::optional<FrameError> FrameTruth::of_wall(Wall& wall, const FrameReport& frame) {
    if (!(wall.sampler->value(frame.probe) > 0.0)) return {};
    FrameError error{level_distance(*wall.sampler, frame.proxy, 0.0, wall.trust_m), {}};
    if (wall.sphere)
        error.position_m = glm::length(frame.proxy - wall.sphere->nearest(frame.probe));
    return error;
}

} // namespace palpate::internal
