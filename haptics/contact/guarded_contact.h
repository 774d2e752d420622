// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <palpate/geometry/certified_mesh.h>
#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/contact/mesh_walk.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/contact/way_out.h>

namespace palpate {

/// Contact `guarded`: the volume leads, and a mesh of the same field holds it on a leash
/// (docs/contact.md).
///
/// Level, planes and certificate are the volume's. Beside the proxy a guard goes along, a proxy of
/// the mesh that is drawn to it: over the mesh, never through. Where the volume lets the proxy
/// through what the mesh has closed, as in a wall thinner than a voxel, the guard stays on its
/// side, and the proxy gets no farther from it than the leash: a plane across the leash holds it.
///
/// Invariant: every accepted chord holds the volume's certificate and ends within the leash of the
/// guard, which never passed through the mesh; unless the surface itself yields in that very
/// sub-step, or is open. Where the proxy comes back in front of a surface that yielded, the guard
/// begins anew, in front of the mesh.
class GuardedContact final : public SurfaceContact, public Membrane, public FieldSurface {
public:
    /// Mesh and field must be of the same baked field, the mesh oriented towards free space.
    /// `leash_m` > 0: several times what the mesh errs by (docs/contact.md). A texture stands in
    /// front of the mesh, where the guard flies along. Throws std::invalid_argument as
    /// VolumeContact and MeshContact do.                                                [setup]
    GuardedContact(std::shared_ptr<const ScalarField> field, const LevelSettings& settings,
                   std::shared_ptr<const CertifiedMesh> mesh, double leash_m,
                   const TextureSettings& texture = {});

    bool restart(const Vec3& proxy) noexcept override;
    void set_gain(const Gain& gain) noexcept override;
    void set_texture_gain(double gain) noexcept override { volume_.set_texture_gain(gain); }
    void offer(const Vec3& proxy, ContactSet& contacts,
               NearestPlane* nearest = nullptr) noexcept override;
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept override;
    std::optional<Vec3> restore(const Vec3& proxy) noexcept override {
        return volume_.restore(proxy);
    }
    std::optional<Vec3> settle(const Vec3& proxy) noexcept override {
        return volume_.settle(proxy);
    }
    Chord carry(const Vec3& from, const Vec3& to) noexcept override;
    std::optional<Vec3> obstructed(const Vec3& from, const Vec3& to,
                                   double fraction) noexcept override;
    double trust_m() const noexcept override { return volume_.trust_m(); }
    void commit(const Vec3& proxy, bool yielded, bool felt) noexcept override;
    SurfaceState state() const noexcept override { return volume_.state(); }
    double opens_above_n() const noexcept override { return volume_.opens_above_n(); }
    void open() noexcept override;
    bool guarded() const noexcept override { return leash_holds_; }
    std::optional<Leash> leash() const noexcept override {
        return on_duty_ ? std::optional(Leash{guard_, leash_m_, leash_offered_}) : std::nullopt;
    }
    QueryCount queries() const noexcept override;
    std::any save_state() const override;
    void restore_state(const std::any& state) override;
    /// Also from a VolumeContact with the same level: the proxy stays where that holds it, and the
    /// guard comes on duty at the end of the first frame that finds the proxy in front of the mesh,
    /// or behind it by less than the leash.
    bool go_on_from(const SurfaceContact& before) noexcept override;
    Membrane* membrane() noexcept override { return volume_.membrane() ? this : nullptr; }
    FieldSurface* of_field() noexcept override { return this; }

    /// Where the guard is, m; nothing while it is not on duty.                           [loop]
    std::optional<Vec3> guard() const noexcept {
        return on_duty_ ? std::optional(guard_) : std::nullopt;
    }

private:
    /// What it remembers from frame to frame.
    struct State {
        std::any volume;
        std::any guard_contact;
        bool on_duty = false;
        Vec3 guard{0.0};
        Vec3 followed{0.0};
        bool leash_holds = false;
    };

    bool post_guard(const Vec3& proxy) noexcept;
    bool deep_inside(const Vec3& proxy) noexcept;
    void follow(const Vec3& proxy) noexcept;
    void regroup(const Vec3& proxy) noexcept;
    double leash_share(const Vec3& from, const Vec3& to) noexcept;

    std::shared_ptr<const CertifiedMesh> mesh_;
    WayOut way_out_;
    MeshWalk walk_;
    VolumeContact volume_;
    std::optional<MeshContact> guard_contact_; // always there: optional to be set anew
    double leash_m_;

    bool on_duty_ = false;
    bool regrouped_ = false; // tried in this frame
    Vec3 guard_{0.0};
    Vec3 followed_{0.0}; // where the proxy was when the guard last went along
    std::size_t volume_planes_ = 0;
    bool leash_offered_ = false;
    bool leash_holds_ = false; // its multiplier was above 0 in the last solution
    std::uint64_t searches_ = 0;
};

} // namespace palpate
