// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <palpate/geometry/rigid_pose.h>
#include <palpate/haptics/contact/contact_set.h>
#include <palpate/haptics/contact/query_count.h>
#include <palpate/haptics/contact/surface_state.h>
#include <palpate/haptics/solver/gain.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate {

/// A question to offer(): the plane of the surface's own level, even if no plane is felt there.
/// Magnets use it.
struct NearestPlane {
    Vec3 pull{0.0};       ///< where the proxy is drawn to, m, scene frame: at an edge of a mesh it
                          ///< decides which facet's plane is the answer
    double reach_m = 0.0; ///< how far in front of the level the proxy may be, >= 0
    /// The answer. Nothing if the proxy is farther in front, or deeper behind than one plane can be
    /// trusted, or if the surface is not felt. The caller sets the strength.
    std::optional<ContactPlane> found = {};
};

/// How far a surface lets a chord through.
struct Chord {
    double fraction = 1.0; ///< of the chord that is certified, [0,1]
    bool engaged = false;  ///< the surface is felt at the chord's start already; false: the chord
                           ///< ends where it first meets the surface
    bool bends = false;    ///< the rest of the way goes round an edge of this mesh: no obstacle
    bool leashed = false;  ///< it is the leash that ends the chord, not the level (contact.md 4)
};

/// What keeps the proxy of a volume's level from getting far behind a mesh of the same surface.
struct Leash {
    Vec3 guard{0.0};       ///< where the mesh's own proxy is, m, scene frame
    double length_m = 0.0; ///< how far from it a chord may end, m, > 0
    bool offered = false;  ///< the last plane of the last offer() was the leash's
};

/// A straight piece of the way on which a surface leads the proxy by itself.
struct SlideLeg {
    enum class End {
        goes_on, ///< the leg ends at `corner`, which is nearer to the pull
        rests,   ///< no leg: the proxy is where the surface holds it
        stuck,   ///< no leg was found, though the proxy is not yet where it should rest
    };
    Vec3 corner{0.0}; ///< m, scene frame
    End end = End::rests;
    bool settles = false; ///< goes on: the next slide(), from `corner`, would say `rests`
};

/// Implemented by a surface that can lead the proxy by itself.
class SlidingSurface {
public:
    virtual ~SlidingSurface() = default;

    /// The next piece of the proxy's way when `pull` draws it and this surface alone holds it: on
    /// the surface, off it, back onto it. Exact, and certified as the chords of
    /// SurfaceContact::carry() are; the distance to `pull` never grows.                     [loop]
    virtual SlideLeg slide(const Vec3& from, const Vec3& pull) noexcept = 0;

    /// A facet's plane, scene frame.
    struct Face {
        Vec3 anchor{0.0}; ///< m, scene frame
        Vec3 normal{0.0}; ///< unit, towards free space
    };
    /// If SurfaceContact::offer() at `proxy`, m, scene frame, would give exactly one hard, flat
    /// plane: does the work of offer() and keep_active(), and returns that plane. Otherwise returns
    /// nothing; call offer() then.                                                       [loop]
    virtual std::optional<Face> offer_face(const Vec3& proxy) noexcept {
        static_cast<void>(proxy);
        return std::nullopt;
    }
};

/// Implemented by a surface that opens where it is pressed too hard.
class Membrane {
public:
    virtual ~Membrane() = default;

    virtual double opens_above_n() const noexcept = 0; ///< the force at which it does, N, > 0 [any]
    /// It opens: from now on it is not felt, until it has been left.                     [loop]
    virtual void open() noexcept = 0;
};

/// Implemented by a surface that is a level of a field. Its certificate ends a little behind the
/// level, so the proxy may have to be brought back onto the level.
class FieldSurface {
public:
    virtual ~FieldSurface() = default;

    /// A frame begins with another gain of its texture than the one before: heights are from now on
    /// so many times their own, as far as SurfaceTexture::set_gain() allows. [loop]
    virtual void set_texture_gain(double gain) noexcept = 0;

    /// A certified point nearer to the level, when the last offer() found the proxy so deep in the
    /// certificate's band that planes alone could deadlock (contact.md 7.4); nothing otherwise.
    /// [loop]
    virtual std::optional<Vec3> restore(const Vec3& proxy) noexcept = 0;

    /// The point of the level that the slope at `proxy` leads to, from either side, where a frame
    /// that cannot go on may end; nothing where there is none within the trusted step. [loop]
    virtual std::optional<Vec3> settle(const Vec3& proxy) noexcept = 0;

    /// Told that a chord from -> to was blocked at `fraction` with no room left: a plane found
    /// there may open another way. Returns a point between on the level that the proxy may go to,
    /// if there is one.  [loop]
    virtual std::optional<Vec3> obstructed(const Vec3& from, const Vec3& to,
                                           double fraction) noexcept = 0;
};

/// Implemented by a surface of a rigid body that moves. The body moves between two frames: from the
/// pose of the last frame towards its goal, the pose that was set last. The loop tries poses on the
/// way, and takes one for which the proxy has a place that every surface certifies.
class MovingSurface {
public:
    virtual ~MovingSurface() = default;

    /// Where the body is to be from the next frame on; finite, with an orientation of length 1.
    /// From one thread at a time.                                                       [any]
    virtual void set_pose(const RigidPose& pose) noexcept = 0;

    /// A frame begins: the goal is the pose that was set last. Whether the body is not there yet.
    /// [loop]
    virtual bool begin_motion() noexcept = 0;
    /// The angle by which it still has to turn, rad, [0, pi].                           [loop]
    virtual double turn_left() const noexcept = 0;

    /// Tries the pose at `share` of the way to the goal, (0, 1].                        [loop]
    virtual void try_pose(double share) noexcept = 0;
    // Of the pose that was tried last:

    /// Where it takes a proxy that goes along, m, scene frame.                          [loop]
    virtual Vec3 along(const Vec3& proxy) noexcept = 0;
    /// Where it takes a plane of this surface, scene frame.                             [loop]
    virtual PlanePrimitive along(const PlanePrimitive& plane) const noexcept = 0;
    /// Whether the proxy, on its way from `from` to `to`, m, scene frame, goes along: then there
    /// is nothing to certify.                                                           [loop]
    virtual bool goes_along(const Vec3& from, const Vec3& to) noexcept = 0;
    /// How far the way of the proxy holds this surface's certificate, as the body sees it, if the
    /// body goes to the tried pose and the proxy from `from` to `to`: straight in the body's own
    /// frame.                                                                           [loop]
    virtual Chord carry_relative(const Vec3& from, const Vec3& to) noexcept = 0;
    /// The body is there from now on, and the proxy at `proxy`, m, scene frame: a place that was
    /// certified whole.                                                                 [loop]
    virtual void take_pose(const Vec3& proxy) noexcept = 0;
    /// SurfaceContact::restart() with the body at `pose`; where it is to go stays.      [loop]
    virtual bool restart_at(const RigidPose& pose, const Vec3& proxy) noexcept = 0;

    virtual const RigidPose& pose() const noexcept = 0; ///< where it is in this frame   [loop]
    /// A point of the scene in the body's frame, m, at pose().                          [loop]
    virtual Vec3 to_body(const Vec3& scene) const noexcept = 0;
};

/// One loop's contact with one immutable surface. It offers planes at a point, and says how far a
/// chord may be followed; it knows no forces, the solver knows no geometry, and the loop alone
/// knows both (composition.md 2.1). State moves in commit() alone, by the table of SurfaceState;
/// but for a membrane that opens in the midst of a frame, and set_gain(). Scene frame, m. Not for
/// two threads at once.
class SurfaceContact {
public:
    virtual ~SurfaceContact() = default;

    /// Forgets everything; the proxy is set to a new place. True when that is inside the surface,
    /// which is then not felt until the proxy has left it. [loop]
    virtual bool restart(const Vec3& proxy) noexcept = 0;

    /// A frame begins with another gain than the one before: its strength is from now on
    /// Gain::strength_n() of its own. At 0 it is as if open, and inside until the gain has risen
    /// and the proxy has left it. While the gain moves, a membrane gives way as a surface that
    /// holds; where that ends above 0, one that is pressed with its strength opens. [loop]
    virtual void set_gain(const Gain& gain) noexcept = 0;

    /// Adds the planes felt at `proxy`: none in free space. If `nearest` is not null, also answers
    /// it. [loop]
    virtual void offer(const Vec3& proxy, ContactSet& contacts,
                       NearestPlane* nearest = nullptr) noexcept = 0;

    /// Told which of its planes are needed: `first` is the index of its first offered one. Others
    /// are forgotten.   [loop]
    virtual void keep_active(const ProxySolution& solution, std::size_t first) noexcept = 0;

    /// How far the chord from -> to holds this surface's certificate. What was met on the way may
    /// change the planes of the next offer(); neither state() nor a level moves here, and the same
    /// chord asked again holds as far.                                                    [loop]
    virtual Chord carry(const Vec3& from, const Vec3& to) noexcept = 0;

    /// Longest step that one evaluation's planes are trusted for, m.                    [any]
    virtual double trust_m() const noexcept = 0;

    /// The frame ends at `proxy`; the only place where the anchored level moves. `yielded`: its
    /// multiplier reached its strength in the last solution; `felt`: it was above 0. [loop]
    virtual void commit(const Vec3& proxy, bool yielded, bool felt) noexcept = 0;

    /// Where the proxy stands with the surface, as of the last commit(), restart(), set_gain() or
    /// Membrane::open(). Inside, the surface is not felt and no certificate of it holds.  [any]
    virtual SurfaceState state() const noexcept = 0;

    /// Whether, in the frame just committed, the surface's mesh held back what its volume would
    /// have let through.  [any]
    virtual bool guarded() const noexcept { return false; }

    /// Its leash as of the last offer() or carry(); nothing where it has none now.       [loop]
    virtual std::optional<Leash> leash() const noexcept { return std::nullopt; }

    virtual QueryCount queries() const noexcept = 0; ///< [any]

    /// A copy of all that it remembers from frame to frame, but for queries(): a struct State of
    /// the contact's own. Between frames.                                                   [setup]
    virtual std::any save_state() const = 0;
    /// From here on it remembers what save_state() gave, of itself or of a contact that was made
    /// alike, of the same surface; without allocation. Between frames. Throws std::bad_any_cast on
    /// what another kind of contact gave.                                               [setup]
    virtual void restore_state(const std::any& state) = 0;
    /// The same of another contact's present state, without a copy between; with its own strength
    /// and texture. False, and nothing has changed, where it cannot: `before` is of another kind.
    /// [loop]
    virtual bool go_on_from(const SurfaceContact& before) noexcept {
        static_cast<void>(before);
        return false;
    }

    // What not every surface can do. Each returns null if the surface cannot do it now.

    /// For a proxy that this surface alone holds. Null: use planes and chords.          [loop]
    virtual SlidingSurface* sliding() noexcept { return nullptr; }
    /// Null also where its strength is infinite, and while its gain moves.              [loop]
    virtual Membrane* membrane() noexcept { return nullptr; }
    virtual FieldSurface* of_field() noexcept { return nullptr; } ///< [loop]
    virtual MovingSurface* moving() noexcept { return nullptr; }  ///< [any]
};

} // namespace palpate
