// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/frame_truth.h>

#include <algorithm>
#include <cmath>

namespace palpate {

FrameTruth::FrameTruth(const Scene& scene, Measure measure) {
    const bool of_meshes = measure == Measure::what_is_felt;
    for (const SceneSurface& surface : scene.surfaces())
        if (of_meshes && surface.is_felt_by_mesh()) meshes_.emplace_back(scene, surface);
    for (FeltLevel& felt : felt_levels(scene)) {
        if (of_meshes && felt.surface && felt.surface->is_felt_by_mesh()) continue;
        const LevelScale scale = LevelScale::of(*felt.field, felt.settings);
        auto sampler = felt.field->make_sampler();
        std::optional<PlaceOn> place;
        if (felt.surface) place.emplace(scene, *felt.surface);
        levels_.push_back({std::move(felt), std::move(sampler), scale, place});
    }
}

FrameFinding FrameTruth::of(const FrameReport& frame) {
    FrameFinding finding;
    const auto take = [&](const std::optional<FrameError>& error) {
        if (error &&
            (!finding.error || std::abs(error->level_m) > std::abs(finding.error->level_m)))
            finding.error = error;
    };
    for (SurfaceAudit& mesh : meshes_)
        take(of_mesh(mesh, frame));
    if (!is_computed(frame.flags)) return finding;
    for (Level& level : levels_) {
        if (level.felt.surface && level.felt.bit == 0) continue; // no frame says whether it is open
        if (frame.surfaces_open & level.felt.bit) continue;
        take(of_level(level, frame));
        if (const std::optional<Vec3> place = level.place_of(frame))
            finding.depth_m = std::max(finding.depth_m.value_or(0.0), depth(level, *place));
    }
    return finding;
}

std::optional<FeltSphere> FrameTruth::sphere() const noexcept {
    if (!meshes_.empty() || levels_.size() != 1) return {};
    return levels_.front().felt.sphere;
}

std::optional<FrameError> FrameTruth::of_mesh(SurfaceAudit& audit, const FrameReport& frame) {
    const std::size_t before = audit.mesh_distance_m().size();
    const std::size_t positions = audit.position_error_m().size();
    audit.add(frame, {}); // its chords are not asked for
    if (audit.mesh_distance_m().size() == before) return {};
    FrameError error{audit.mesh_distance_m().back(), {}};
    if (audit.position_error_m().size() > positions)
        error.position_m = audit.position_error_m().back();
    return error;
}

std::optional<FrameError> FrameTruth::of_level(Level& level, const FrameReport& frame) {
    const bool counts = level.felt.surface
                            ? (frame.surfaces_felt & level.felt.bit) != 0
                            : level.sampler->value(frame.probe) > level.felt.settings.level;
    const bool textured = level.felt.surface && !level.felt.surface->texture.none();
    if (!counts || textured) return {}; // what is felt is in front of the level
    const std::optional<Vec3> place = level.place_of(frame);
    if (!place) return {};
    FrameError error{
        level_distance(*level.sampler, *place, level.felt.settings.level, level.scale.trust_m), {}};
    if (level.felt.sphere && (frame.surfaces_felt & ~level.felt.bit) == 0)
        error.position_m = glm::length(*place - level.felt.sphere->nearest(frame.probe));
    return error;
}

double FrameTruth::depth(Level& level, const Vec3& proxy) {
    const double bound = level.felt.settings.level + level.scale.certificate;
    if (!(level.sampler->value(proxy) > bound)) return 0.0;
    const double depth_m =
        depth_behind(level.felt, *level.sampler, proxy, level.scale.trust_m, deepest_m_);
    deepest_m_ = std::max(deepest_m_, depth_m);
    return depth_m;
}

} // namespace palpate
