// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/contact/way_out.h>

namespace palpate {

/// Contact `direct`: the plain idea, for studies of what leaving the certificate out costs. An
/// Embree ray along the chord finds a facet; the plane there goes through the level one Newton step
/// away, with the normal of the field's gradient. Once a facet has been met or passed, the plane at
/// the proxy follows the level in the same way, whatever the length of a step, until the proxy is
/// more than a trusted step in front of the level, and a ray says that it is behind no facet.
/// Nothing else: between evaluations no test says
/// what the chord passes through. So it does get lost in thin and concave bone (contact.md 7.3).
/// Nor does its level move: a weak one pushes back with its strength wherever it was pressed
/// through, without play, and pushes out what is behind when it is strong again.
class DirectContact final : public SurfaceContact {
public:
    /// Surface and field must be of the same baked field. Throws std::invalid_argument as
    /// LevelScale::of does.  [setup]
    DirectContact(std::shared_ptr<const SurfaceScene> surface,
                  std::shared_ptr<const ScalarField> field, const LevelSettings& settings);

    bool restart(const Vec3& proxy) noexcept override;
    void set_gain(const Gain& gain) noexcept override;
    void offer(const Vec3& proxy, ContactSet& contacts,
               NearestPlane* nearest = nullptr) noexcept override;
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept override;
    Chord carry(const Vec3& from, const Vec3& to) noexcept override;
    double trust_m() const noexcept override { return scale_.trust_m; }
    void commit(const Vec3&, bool, bool felt) noexcept override { felt_ = felt; }
    SurfaceState state() const noexcept override {
        if (strength_n_ == 0.0) return SurfaceState::inside;
        return felt_ ? SurfaceState::in_contact : SurfaceState::free;
    }
    QueryCount queries() const noexcept override;
    std::any save_state() const override;
    void restore_state(const std::any& state) override;
    bool go_on_from(const SurfaceContact& before) noexcept override;

private:
    /// What it remembers from frame to frame.
    struct State {
        double strength_n = 0.0;
        bool engaged = false;
        bool felt = false;
        PlaneBundle bundle;
        PlaneBundle met;
    };

    bool behind_a_facet(const Vec3& proxy) noexcept;
    bool is_offered(const ContactPlane& contact, const SurfaceHit& hit) const noexcept;

    std::shared_ptr<const SurfaceScene> surface_;
    WayOut way_out_;
    std::shared_ptr<const ScalarField> field_;
    LevelSettings settings_;
    double strength_n_; // with the gain
    LevelScale scale_;
    double patch_cosine_;
    std::unique_ptr<FieldSampler> sampler_;

    bool engaged_ = false; // the level is followed: near it, or behind a facet
    bool felt_ = false;    // in the last frame
    PlaneBundle bundle_;
    PlaneBundle met_; // by chords since the last offer(), which takes them into bundle_
    std::uint32_t offered_ = 0;
    double depth_m_ = 0.0; // below the level, where planes were offered last; 0 in front of it
    std::uint64_t rays_ = 0;
};

} // namespace palpate
