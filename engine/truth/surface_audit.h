// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/place_on.h>

namespace palpate {

/// A sphere around the origin that is felt.
struct FeltSphere {
    double radius_m = 0.0; ///< m, > 0 where there is one
    double outwards = 1.0; ///< 1: its material is outside, a cavity; -1: within

    /// The level of a volume's formula, where that is a sphere.                         [setup]
    static std::optional<FeltSphere> of(const VolumeDescription& volume, double level);
    /// Its point nearest to another, which is not its centre; m.                        [any]
    Vec3 nearest(const Vec3& point) const { return radius_m * glm::normalize(point); }
};

/// Measures, outside the loop and with queries of its own, how true frames were to a surface: how
/// far the proxy in contact with it is from the level, and how deep the chords between its corners
/// went; of a surface felt by its mesh alone, how far the proxy is from the mesh, and how many
/// chords passed through it. Frames in which the surface was open (begun inside, or yielded) do not
/// count. Not for the loop: allocates.
class SurfaceAudit {
public:
    /// The scene must outlive the audit.                                                [setup]
    SurfaceAudit(const Scene& scene, const SceneSurface& surface);

    /// One frame and the proxy's corners in it (HapticLoop::path()).                    [setup]
    void add(const FrameReport& frame, std::span<const Vec3> path);

    /// The deepest sample of all chords.
    struct Deepest {
        double above_level =
            0.0; ///< value minus level, the field's unit; <= 0: never below the surface
        double depth_m = 0.0;    ///< its distance from the surface, m
        std::uint64_t frame = 0; ///< FrameReport::frame of it
    };

    /// The one that is audited.                                                         [any]
    const SceneSurface& surface() const noexcept { return surface_; }

    // Of spheres, however they are felt.
    const std::vector<double>& position_error_m() const noexcept {
        return position_error_m_;
    } ///< from the point nearest to the probe; per contact frame

    // Of the level; nothing where the mesh alone is felt.
    const std::vector<double>& level_distance_m() const noexcept {
        return level_distance_m_;
    } ///< signed, > 0 inside; per contact frame
    const std::optional<FeltSphere>& sphere() const noexcept {
        return sphere_;
    } ///< of a surface that is one and does not yield
    /// Of all frames so far; nothing went below the level: depth_m is 0.                   [setup]
    Deepest deepest() const;
    std::uint64_t frames_inside() const noexcept {
        return frames_inside_;
    } ///< that ended deeper than the certificate's tolerance
    double certificate() const noexcept { return scale_.certificate; } ///< tau, the field's unit

    // Of the mesh, where it alone is felt.
    const std::vector<double>& mesh_distance_m() const noexcept {
        return mesh_distance_m_;
    } ///< >= 0; per contact frame
    std::uint64_t chords_through() const noexcept {
        return chords_through_;
    } ///< whose ends are more than a skin away from a facet between them, on either side

    // Contact guarded.
    std::uint64_t guarded_frames() const noexcept {
        return guarded_frames_;
    } ///< in which the mesh held the proxy back
    std::uint64_t guarded_events() const noexcept {
        return guarded_events_;
    } ///< runs of such frames; less than kEventGap frames apart they are one
    /// Frames between two events of guarded_events().
    static constexpr std::uint64_t kEventGap = 20;

private:
    void add_to_level(const FrameReport& frame, const Vec3& place, std::span<const Vec3> path);
    void add_to_mesh(const FrameReport& frame, const Vec3& place, std::span<const Vec3> path);
    void add_position(const FrameReport& frame, const Vec3& place);
    void add_guarded(const FrameReport& frame);
    bool passes_through(const Vec3& from, const Vec3& to) const;

    const SceneSurface& surface_;
    PlaceOn place_;
    LevelScale scale_;
    std::unique_ptr<FieldSampler> sampler_; // null where the mesh alone is felt
    std::uint64_t bit_; // of the surface in FrameReport::surfaces_felt; 0 past the 64th
    std::optional<FeltSphere> sphere_; // where the closest point is known
    std::vector<double> level_distance_m_;
    std::vector<double> position_error_m_;
    std::uint64_t frames_inside_ = 0;
    Deepest deepest_;
    Vec3 deepest_at_{0.0};

    std::vector<double> mesh_distance_m_;
    std::uint64_t chords_through_ = 0;

    std::uint64_t guarded_frames_ = 0;
    std::uint64_t guarded_events_ = 0;
    std::uint64_t last_guarded_ = 0; // frame and trial of the last one
    std::uint32_t last_guarded_trial_ = 0;
};

/// What a user should know where the mesh of a guarded surface held the proxy back; empty where it
/// never did.  [setup]
std::string guard_warning(const SurfaceAudit& audit);

/// The point of a level that the slope leads to from a point, by Newton steps on the field as
/// interpolated; short of it where there is no slope. m.                                [setup]
Vec3 level_foot(FieldSampler& sampler, const Vec3& point, double level, double longest_step_m);

/// Signed distance of a point from a level along the slope, > 0 inside, by Newton steps on the
/// field as interpolated; a bound of what is left is its last step. m. [setup]
double level_distance(FieldSampler& sampler, const Vec3& point, double level,
                      double longest_step_m);

} // namespace palpate
