// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>

#include <palpate/haptics/contact/level_settings.h>
#include <palpate/haptics/contact/plane_bundle.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/contact/surface_strength.h>
#include <palpate/haptics/contact/surface_texture.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// The plane of the level at a point: through the point of the level that the continuous gradient
/// points to, with the continuous normal where it can be relied on and the trilinear one elsewhere
/// (contact.md 1.2, steps 1 and 4). False in free space and where there is no normal. [loop]
bool level_plane(const FieldSample& sample, const Vec3& point, double level,
                 const LevelSettings& settings, const LevelScale& scale,
                 ContactPlane& contact) noexcept;

/// The plane of the surface's own level where `point` is at most `reach_m` in front of it, or
/// behind by no more than planes are trusted for. [loop]
std::optional<ContactPlane> plane_within(const FieldSample& sample, const Vec3& point,
                                         const LevelSettings& settings, const LevelScale& scale,
                                         double reach_m) noexcept;

/// Contact `volume`: the level of a field found, refined and guarded by the field alone
/// (contact.md 1.2).
///
/// Invariant: no accepted chord reaches max(c0 + tau, value at its start) from below, whatever the
/// speed, whatever the solver says; unless the surface itself yields in that very sub-step.
///
/// A texture stands in front of the level: it is what planes, levels and yielding are of, and where
/// free flight ends, found by steps of a part of its wavelength. The invariant is the field's.
class VolumeContact final : public SurfaceContact, public Membrane, public FieldSurface {
public:
    /// Throws std::invalid_argument as LevelScale::of and SurfaceTexture do.            [setup]
    VolumeContact(std::shared_ptr<const ScalarField> field, const LevelSettings& settings,
                  const TextureSettings& texture = {});

    bool restart(const Vec3& proxy) noexcept override;
    void set_gain(const Gain& gain) noexcept override;
    void set_texture_gain(double gain) noexcept override;
    /// One sample, whatever is asked.
    void offer(const Vec3& proxy, ContactSet& contacts,
               NearestPlane* nearest = nullptr) noexcept override;
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept override;
    std::optional<Vec3> restore(const Vec3& proxy) noexcept override;
    std::optional<Vec3> settle(const Vec3& proxy) noexcept override;
    Chord carry(const Vec3& from, const Vec3& to) noexcept override;
    std::optional<Vec3> obstructed(const Vec3& from, const Vec3& to,
                                   double fraction) noexcept override;
    double trust_m() const noexcept override { return scale_.trust_m; }
    void commit(const Vec3& proxy, bool yielded, bool felt) noexcept override;
    SurfaceState state() const noexcept override { return state_; }
    double opens_above_n() const noexcept override { return strength_.opens_above_n; }
    void open() noexcept override;
    QueryCount queries() const noexcept override;
    std::any save_state() const override;
    void restore_state(const std::any& state) override;
    bool go_on_from(const SurfaceContact& before) noexcept override;
    Membrane* membrane() noexcept override { return strength_.is_membrane() ? this : nullptr; }
    FieldSurface* of_field() noexcept override { return this; }

    /// Of its planes with the present gain, N; infinite for a membrane that may open.    [loop]
    double offered_strength_n() const noexcept { return strength_.offered_n; }
    const LevelScale& scale() const noexcept { return scale_; } ///< with the texture       [loop]
    /// c0, U: the level, or where a yielding surface holds now.                          [loop]
    double anchored_level() const noexcept { return level_; }

private:
    /// What it remembers from frame to frame.
    struct State {
        SurfaceStrength strength;
        double texture_gain = 0.0;
        double level = 0.0;
        SurfaceState state = SurfaceState::free;
        PlaneBundle bundle;
    };

    void look(const Vec3& point) noexcept;
    double felt_value(const Vec3& point) noexcept;
    std::optional<double> felt_root(const Vec3& from, const Vec3& to) noexcept;
    double refined_root(const Vec3& from, const Vec3& to, double low, double high) noexcept;
    std::optional<Vec3> downhill(const Vec3& proxy, const FieldSample& at) noexcept;
    bool not_felt() const noexcept { return state_ == SurfaceState::inside; }

    std::shared_ptr<const ScalarField> field_;
    LevelSettings settings_;
    SurfaceStrength strength_; // with the gain
    LevelScale scale_;
    double bare_trust_m_; // without the texture
    double bare_patch_cosine_;
    double patch_cosine_;
    std::unique_ptr<FieldSampler> sampler_;
    SurfaceTexture texture_;

    double level_; // c0
    SurfaceState state_ = SurfaceState::free;
    FieldSample here_;        // at the last offer(), with the texture
    double bare_value_ = 0.0; // of the field itself there, U
    bool engaged_ = false;    // planes were offered there
    PlaneBundle bundle_;
    std::uint32_t offered_ = 0;
};

} // namespace palpate
