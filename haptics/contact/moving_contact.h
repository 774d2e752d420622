// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>

#include <palpate/geometry/rigid_pose.h>
#include <palpate/haptics/contact/latest.h>
#include <palpate/haptics/contact/surface_contact.h>

namespace palpate {

/// A surface of a rigid body that moves: a contact of any kind, which stays in the body's own frame
/// and knows nothing of the pose, seen from the scene.
///
/// A rigid map keeps lengths, planes and straight lines, so what the contact certifies in its frame
/// holds in the scene. That the proxy has one place in both frames matters: a contact tells by the
/// very bits whether the proxy was moved. So the place of the proxy, and those that were asked or
/// answered in this frame, are kept as pairs.
class MovingContact final : public SurfaceContact,
                            public SlidingSurface,
                            public Membrane,
                            public FieldSurface,
                            public MovingSurface {
public:
    /// `contact`: in the body's frame, which is the scene's as long as no pose is set. Throws
    /// std::invalid_argument where there is none.                                       [setup]
    explicit MovingContact(std::unique_ptr<SurfaceContact> contact);

    bool restart(const Vec3& proxy) noexcept override;
    void set_gain(const Gain& gain) noexcept override { contact_->set_gain(gain); }
    void offer(const Vec3& proxy, ContactSet& contacts,
               NearestPlane* nearest = nullptr) noexcept override;
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept override {
        contact_->keep_active(solution, first);
    }
    Chord carry(const Vec3& from, const Vec3& to) noexcept override;
    double trust_m() const noexcept override { return contact_->trust_m(); }
    void commit(const Vec3& proxy, bool yielded, bool felt) noexcept override;
    SurfaceState state() const noexcept override { return contact_->state(); }
    bool guarded() const noexcept override { return contact_->guarded(); }
    std::optional<Leash> leash() const noexcept override;
    QueryCount queries() const noexcept override { return contact_->queries(); }
    std::any save_state() const override;
    void restore_state(const std::any& state) override;
    bool go_on_from(const SurfaceContact& before) noexcept override;
    SlidingSurface* sliding() noexcept override { return contact_->sliding() ? this : nullptr; }
    Membrane* membrane() noexcept override { return contact_->membrane() ? this : nullptr; }
    FieldSurface* of_field() noexcept override { return contact_->of_field() ? this : nullptr; }
    MovingSurface* moving() noexcept override { return this; }

    SlideLeg slide(const Vec3& from, const Vec3& pull) noexcept override;
    double opens_above_n() const noexcept override;
    void open() noexcept override { contact_->membrane()->open(); }
    void set_texture_gain(double gain) noexcept override {
        contact_->of_field()->set_texture_gain(gain);
    }
    std::optional<Vec3> restore(const Vec3& proxy) noexcept override;
    std::optional<Vec3> settle(const Vec3& proxy) noexcept override;
    std::optional<Vec3> obstructed(const Vec3& from, const Vec3& to,
                                   double fraction) noexcept override;

    void set_pose(const RigidPose& pose) noexcept override { asked_.set(pose); }
    bool begin_motion() noexcept override;
    double turn_left() const noexcept override;
    void try_pose(double share) noexcept override;
    Vec3 along(const Vec3& proxy) noexcept override;
    PlanePrimitive along(const PlanePrimitive& plane) const noexcept override;
    bool goes_along(const Vec3& from, const Vec3& to) noexcept override;
    Chord carry_relative(const Vec3& from, const Vec3& to) noexcept override;
    void take_pose(const Vec3& proxy) noexcept override;
    bool restart_at(const RigidPose& pose, const Vec3& proxy) noexcept override;
    const RigidPose& pose() const noexcept override { return pose_; }
    Vec3 to_body(const Vec3& scene) const noexcept override { return map_.point_back(scene); }

private:
    /// One place in both frames, m.
    struct Place {
        Vec3 scene{0.0};
        Vec3 body{0.0};
    };
    /// What it remembers from frame to frame.
    struct State {
        std::any contact;
        RigidPose pose;
        RigidPose goal;
        Place proxy;
    };

    Vec3 proxy_in_body(const Vec3& scene) noexcept;
    Vec3 place_in_body(const Vec3& scene) noexcept;
    Vec3 place_in_scene(const Vec3& body) noexcept;
    Vec3 relative_end(const Vec3& from, const Vec3& to) noexcept;
    void remember(const Place& place) noexcept;
    void take_goal() const noexcept;
    void be_at(const RigidPose& pose) noexcept;
    void be_at(const RigidPose& pose, const RigidMap& map) noexcept;

    std::unique_ptr<SurfaceContact> contact_;
    // A pose that was set is the goal, whether or not the loop has taken it yet.
    mutable Latest<RigidPose> asked_;
    mutable RigidPose goal_;
    mutable bool was_set_ = false; // the goal, by set_pose()
    RigidPose pose_, tried_;
    RigidMap map_, tried_map_;

    Place proxy_;
    struct {
        Vec3 from{0.0}, to{0.0};    // m, scene frame
    } gone_along_;                  // where the tried pose takes the proxy
    std::array<Place, 3> places_{}; // others of this frame, the newest at next_ - 1
    std::size_t count_ = 0, next_ = 0;
};

} // namespace palpate
