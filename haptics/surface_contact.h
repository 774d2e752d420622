// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include <palpate/haptics/fixed_vector.h>
#include <palpate/haptics/gain.h>
#include <palpate/haptics/primitives.h>
#include <palpate/haptics/proxy_solver.h>
#include <palpate/haptics/surface_state.h>

namespace palpate {

/// A plane that a surface offers at the proxy, with what curvature corrections need to know of it.
struct ContactPlane {
    PlanePrimitive plane;
    double level_gap = 0.0; ///< c0 - f at the sampled point, unit U; < 0: deeper than the level
    Vec3 slope{0.0}; ///< exact derivative of f there, U/m; zero: not known, take the plane as it is
    double gradient_length = 0.0; ///< length of the continuous gradient, U/m, > 0
    Mat3 depth_hessian{0.0};      ///< of the depth D = (f - c0) / |g|, 1/m; zero: taken as flat
};

/// The planes of one evaluation, in canonical order: surface by surface.
class ContactSet {
public:
    static constexpr std::size_t kCapacity = PrimitiveSet::kCapacity;
    /// Neither planes nor an overflow any more.                                         [loop]
    void clear() noexcept {
        contacts_.clear();
        overflowed_ = false;
    }
    /// Adds a plane; false, and remembered as overflow, when there is no room for it. [loop]
    bool add(const ContactPlane& contact) noexcept {
        if (contacts_.full()) {
            overflowed_ = true;
            return false;
        }
        contacts_.push_back(contact);
        return true;
    }
    /// Takes back the plane that was added last, of at least one.                      [loop]
    void drop_last() noexcept { contacts_.pop_back(); }
    /// Moves a plane and its level inwards, m.                                          [loop]
    void sink(std::size_t i, double by_m) noexcept {
        contacts_[i].plane.anchor -= by_m * contacts_[i].plane.normal;
        contacts_[i].level_gap += by_m * contacts_[i].gradient_length;
    }
    std::size_t size() const noexcept { return contacts_.size(); } ///< [loop]
    bool overflowed() const noexcept { return overflowed_; }       ///< [loop]
    /// `i` < size().                                                                    [loop]
    const ContactPlane& operator[](std::size_t i) const noexcept { return contacts_[i]; }

private:
    FixedVector<ContactPlane, kCapacity> contacts_;
    bool overflowed_ = false;
};

/// How far a surface lets a chord through.
struct Chord {
    double fraction = 1.0; ///< of the chord that is certified, [0,1]
    bool engaged = false;  ///< the surface has offered planes at the chord's start: it corrects,
                           ///< rather than stops
    bool bends =
        false; ///< the rest lies round an edge of its own: not an obstacle, go on from there
};

/// A straight piece of the way on which a surface leads the proxy by itself.
struct SlideLeg {
    enum class End {
        goes_on, ///< at `corner`, which is nearer
        rests,   ///< it is where the surface holds it
        stuck,   ///< it stays, though it is not
    };
    Vec3 corner{0.0}; ///< m, scene frame
    End end = End::rests;
};

/// What a surface has computed so far: counters that only grow.
struct QueryCount {
    std::uint64_t field_samples = 0;
    std::uint64_t roots = 0;
    std::uint64_t surface_queries = 0;
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

    /// The plane of the surface's own level where `proxy` is at most `reach_m` in front of it or,
    /// by less than one plane can be trusted for, behind; nothing elsewhere, nor where the surface
    /// is not felt. Its strength is the caller's to set. `pull`: where the proxy is drawn to; it
    /// tells which plane round an edge of a mesh. To be asked for just before offer(), at its
    /// place: what both need is computed once. [loop]
    virtual std::optional<ContactPlane> nearest(const Vec3& proxy, const Vec3& pull,
                                                double reach_m) noexcept = 0;

    /// A frame begins with another gain than the one before: its strength is from now on
    /// Gain::strength_n() of its own. At 0 it is as if open, and inside until the gain has risen
    /// and the proxy has left it. While the gain moves, a membrane gives way as a surface that
    /// holds, so that the hand is let in as gently as the gain falls. [loop]
    virtual void set_gain(const Gain& gain) noexcept = 0;

    /// A frame begins with another gain of its texture than the one before: heights are from now on
    /// so many times their own, as far as SurfaceTexture::set_gain() allows. [loop]
    virtual void set_texture_gain(double gain) noexcept { static_cast<void>(gain); }

    /// Adds the planes felt at `proxy`: none in free space.                             [loop]
    virtual void offer(const Vec3& proxy, ContactSet& contacts) noexcept = 0;

    /// Told which of its planes are needed: `first` is the index of its first offered one. Others
    /// are forgotten.   [loop]
    virtual void keep_active(const ProxySolution& solution, std::size_t first) noexcept = 0;

    /// A certified point nearer to the level, when the last offer() found the proxy so deep in the
    /// certificate's band that planes alone could deadlock (contact.md 7.4); nothing otherwise.
    /// [loop]
    virtual std::optional<Vec3> restore(const Vec3& proxy) noexcept = 0;

    /// The point of the level that the slope at `proxy` leads to, from either side, where a frame
    /// that cannot go on may end; nothing where there is none within the trusted step. [loop]
    virtual std::optional<Vec3> settle(const Vec3& proxy) noexcept = 0;

    /// How far the chord from -> to holds this surface's certificate. A surface met on the way may
    /// remember its plane; its level never moves here.                                     [loop]
    virtual Chord carry(const Vec3& from, const Vec3& to) noexcept = 0;

    /// Told that a chord from -> to was blocked at `fraction` with no room left: a plane found
    /// there may open another way. Returns a point between on the level that the proxy may go to,
    /// if there is one.  [loop]
    virtual std::optional<Vec3> obstructed(const Vec3& from, const Vec3& to,
                                           double fraction) noexcept = 0;

    /// Longest step that one evaluation's planes are trusted for, m.                    [any]
    virtual double trust_m() const noexcept = 0;

    /// The frame ends at `proxy`; the only place where the anchored level moves. `yielded`: its
    /// multiplier reached its strength in the last solution; `felt`: it was above 0. [loop]
    virtual void commit(const Vec3& proxy, bool yielded, bool felt) noexcept = 0;

    /// Where the proxy stands with the surface, as of the last commit(), restart(), set_gain() or
    /// open().
    /// Inside, the surface is not felt and no certificate of it holds.  [any]
    virtual SurfaceState state() const noexcept = 0;

    /// The force at which a membrane opens, N; infinite for surfaces that do not ("holds", or a
    /// strength that is infinite), and while their gain moves.  [any]
    virtual double opens_above_n() const noexcept {
        return std::numeric_limits<double>::infinity();
    }

    /// The membrane opens: from now on it is not felt, until it has been left.          [loop]
    virtual void open() noexcept {}

    /// Whether, in the frame just committed, the surface's mesh held back what its volume would
    /// have let through.  [any]
    virtual bool guarded() const noexcept { return false; }

    virtual QueryCount queries() const noexcept = 0; ///< [any]

    /// Whether slide() is exact where this surface alone holds the proxy; otherwise planes and
    /// chords do.  [loop]
    virtual bool slides() const noexcept { return false; }

    /// The next piece of the proxy's way when `pull` draws it and this surface alone holds it: on
    /// the surface, off it, back onto it. Certified as carry()'s chords are; the distance to `pull`
    /// never grows. [loop]
    virtual SlideLeg slide(const Vec3& from, const Vec3& pull) noexcept {
        static_cast<void>(pull);
        return {from, SlideLeg::End::rests};
    }
};

} // namespace palpate
