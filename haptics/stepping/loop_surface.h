// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <typeinfo>
#include <utility>

#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/local_strength.h>
#include <palpate/haptics/effects/surface_magnets.h>
#include <palpate/haptics/solver/gain.h>
#include <palpate/haptics/stepping/level_bank.h>
#include <palpate/volume/fields/stiffness_map.h>

namespace palpate {

/// What of a surface can be made weaker or stronger while a loop runs.
enum class SurfacePart : std::uint8_t {
    strength,
    friction, ///< its coefficients
    magnet,   ///< its strength
    texture   ///< its heights
};
inline constexpr std::size_t kSurfaceParts = 4;

/// One surface as one loop has it: its contact, its strength by place, its magnet, its gains, and
/// its planes in the current evaluation. Friction is not here, because it couples surfaces
/// (CoulombFriction). Only GainRamp::set() may be called from a second thread.
class LoopSurface {
public:
    /// The contact must outlive this. Throws std::invalid_argument on a finish out of range.
    /// [setup]
    LoopSurface(SurfaceContact& contact, const SurfaceFinish& finish);

    /// What it remembers from frame to frame.
    struct State {
        const std::type_info* kind = nullptr; ///< of the contact
        std::any contact;
        LocalStrength::State strength;
        LoopMagnet::State magnet;
        LevelBank bank;
        double tissue_m = 0.0;
        std::array<GainRamp::State, kSurfaceParts> gains;
        bool pushes_back = false;
        bool yields = false;
        bool began_inside = false;
        Vec3 touched_at{0.0};
        Vec3 touched_normal{0.0};
        bool let_go = false;
    };
    State save_state() const; ///< between frames                                         [setup]
    /// Whether it is of the same kind of contact.                                        [any]
    bool takes(const State& state) const noexcept { return *state.kind == typeid(*contact_); }
    /// Between frames, of one that takes() it and was made alike.                        [setup]
    void restore_state(const State& state);

    /// GainRamp::set() is for any thread, all else of it for the loop.                   [any]
    GainRamp& gain(SurfacePart part) noexcept { return gains_[static_cast<std::size_t>(part)]; }
    /// In this frame, [0, GainRamp::kHighest].                                           [loop]
    double gain_value(SurfacePart part) const noexcept {
        return gains_[static_cast<std::size_t>(part)].value();
    }
    /// Of what never yields at gain 1, in this frame, N (Gain::strength_n).               [loop]
    double strength_n(double force_limit_n) const noexcept {
        const GainRamp& strength = gains_[static_cast<std::size_t>(SurfacePart::strength)];
        return strength.gain(force_limit_n).strength_n(std::numeric_limits<double>::infinity());
    }
    /// Whether every gain is 1 in this frame.                                            [loop]
    bool is_as_set() const noexcept { return as_set_; }
    /// Whether frames may find it of another strength elsewhere.                         [any]
    bool depends_on_place() const noexcept { return strength_.depends_on_place(); }
    SurfaceContact& contact() const noexcept { return *contact_; } ///< [any]
    /// The body that it is of; null where it does not move.                              [any]
    MovingSurface* moving() const noexcept { return moving_; }
    /// Whether it may be soft.                                                           [any]
    bool has_softness() const noexcept { return soft_ != nullptr; }
    /// Of the fields that its strength and its magnet depend on.                         [any]
    std::uint64_t samples() const noexcept { return strength_.samples() + magnet_.samples(); }

    /// Takes the place of `before`, of the same surface in another loop, with gains of its own;
    /// true where the proxy is inside. Of what it cannot go on from it is as after restart().
    /// [loop]
    bool go_on_from(const LoopSurface& before, const Vec3& proxy) noexcept {
        return go_on_from(before, proxy, before.tissue_m());
    }
    /// The same of one whose tissue was pressed in by `tissue_m`, m, >= 0, with a damper. [loop]
    bool go_on_from(const LoopSurface& before, const Vec3& proxy, double tissue_m) noexcept;
    /// A new trial: the proxy is set to a new place. True when that is inside. A body that moves is
    /// at `body`, or, where that is null, at the pose that was set last.                 [loop]
    bool restart(const Vec3& proxy, const RigidPose* body = nullptr) noexcept;

    // While bodies move, before the frame begins.

    /// The proxy is at another place, or a body at another pose.                         [loop]
    void look_anew() noexcept { looked_ = false; }
    /// Whether nobody has asked since look_anew().                                       [loop]
    bool looks_first() noexcept { return !std::exchange(looked_, true); }

    // Of one that has_softness(). Then all else is about its front, and forces as of a hard surface
    // in its place (docs/palpation.md).

    /// A frame begins, behind a coupling that may be another one; to be called before
    /// follow_gains(). [loop]
    void follow_coupling(const FrameContext& frame) noexcept;
    /// Of a hard one that leads the front of a layer: it yields where a tissue of this law, which
    /// must outlive it, presses with its strength; null: where a spring of the coupling does. [any]
    void yield_as(const PressLaw* tissue) noexcept { tissue_ = tissue; }
    /// How far the tissue was pressed in at the last frame's end, m, >= 0, with a damper. [loop]
    double tissue_m() const noexcept { return soft_ ? soft_->tissue_m : 0.0; }
    /// Whether it is softer than that coupling.                                          [loop]
    bool is_soft() const noexcept { return soft_ && !soft_->law.is_hard(); }
    /// What it presses with where it is soft.
    struct Press {
        double force_n = 0.0;       ///< F, N, >= 0
        double slope_n_per_m = 0.0; ///< of F over delta, without the tissue's damper, N/m
        double energy_j = 0.0;      ///< by how much the stored energy rises with the ratio, J per 1
    };
    /// Whether it is stiffer over what lies beneath: a map says by which ratio.          [any]
    bool has_stiffness_map() const noexcept { return soft_ && soft_->stiffness; }
    /// What lies beneath a front, m, scene frame; of has_stiffness_map().                [loop]
    StiffnessMap::Sample beneath(const Vec3& front) const noexcept {
        return soft_->stiffness->sample(front);
    }
    /// The frame ends with a delta of `press_m`, m, >= 0, where the surface is `ratio` times as
    /// stiff as its law, > 0.                                                            [loop]
    Press press(double press_m, double period_s, double ratio) noexcept;

    // In a frame. Places in m, scene frame.

    /// Whether a gain is on its way, or has just come to its end.                        [loop]
    bool gains_move() const noexcept;
    /// A frame begins: the gains take a step, and the surface is as strong as they and the place
    /// say. Whether any gain moved.                                                      [loop]
    bool follow_gains(const FrameContext& frame) noexcept;
    /// A frame begins, after the effects: notes whether it pushed; its magnet begins.     [loop]
    void begin(const FrameContext& frame) noexcept {
        pushed_before_ = is_felt();
        if (!has_magnet_) return;
        FrameContext seen = moving_ ? in_body(frame) : frame;
        seen.gain = gain_value(SurfacePart::magnet);
        magnet_.begin(seen);
    }
    /// Adds the planes felt at `proxy`, and finds the magnet's. `pull`: where the forces draw it.
    /// [loop]
    void offer(const Vec3& proxy, const Vec3& pull, ContactSet& contacts) noexcept;
    /// offer(), and in the frame's first evaluation ration_restoring(), of a surface without a
    /// magnet that is the only one, and holds the proxy (m, scene frame) by one hard and flat plane
    /// at which nothing is to be rationed. `begins`: it is the frame's first evaluation. Nothing
    /// where it is not so; then these are to be called.                                   [loop]
    std::optional<SlidingSurface::Face> offer_face(const Vec3& proxy, bool begins) noexcept;
    /// take() of that plane; `holds`: its multiplier is above 0.                          [loop]
    void take_face(bool holds) noexcept {
        pushes_back_ = holds;
        yields_ = let_go_ = false;
    }
    /// After the frame's first offer(): asks the energy bank how far the proxy may be lifted in
    /// this frame. A longer lift would give the hand more energy than the drift has taken. [loop]
    void ration_restoring(const FrameContext& frame, const ContactSet& contacts) noexcept;
    /// Moves the planes of the last offer() inwards by the depth that must remain.       [loop]
    void sink(ContactSet& contacts) const noexcept;
    /// Adds the magnet's plane, if that draws the proxy.                                 [loop]
    void offer_magnet(ContactSet& contacts) const noexcept {
        if (has_magnet_) magnet_.gather(contacts);
    }
    /// Told what became of its planes.                                                   [loop]
    void take(const ProxySolution& solution) noexcept;
    /// It pushes back at the frame's end: the place, m, and the normal are kept for the frame in
    /// which that ends. [loop]
    void note_touch(const Vec3& proxy, const Vec3& normal) noexcept {
        touched_at_ = proxy;
        touched_normal_ = normal;
    }
    /// The normal of its plane that pushes most, of at least one.                        [loop]
    Vec3 strongest_normal(const ProxySolution& solution, const ContactSet& contacts) const noexcept;
    /// The frame ends at `proxy`.                                                        [loop]
    void commit(const Vec3& proxy, const FrameContext& frame) noexcept;

    // After an evaluation: take().

    /// Whether it offered planes.                                                        [loop]
    bool is_touched() const noexcept { return first_ != last_; }
    /// Whether a multiplier of its planes is above 0.                                    [loop]
    bool pushes_back() const noexcept { return pushes_back_; }
    /// Of one that is_soft(): the tip has left its tissue, which comes back more slowly, in front
    /// of which the front still is.                                                         [loop]
    void let_go() noexcept { let_go_ = true; }
    /// Whether it pushes the tip, too.                                                    [loop]
    bool is_felt() const noexcept { return pushes_back_ && !let_go_; }
    /// Whether that was so at the end of the frame before, too.                          [loop]
    bool pushed_before() const noexcept { return pushed_before_; }
    /// Where the proxy was in the last frame in which it pushed back, m, and the normal. [loop]
    const Vec3& touched_at() const noexcept { return touched_at_; }
    const Vec3& touched_normal() const noexcept { return touched_normal_; }
    /// Whether the trial began inside, and the proxy has not left it since.              [loop]
    bool began_inside() const noexcept { return began_inside_; }
    /// Whether a multiplier of its planes has reached the surface's strength.            [loop]
    bool yields() const noexcept { return yields_; }
    /// Whether the bank allows only a part of the way back to its level.                 [loop]
    bool is_rationed() const noexcept { return sunk_m_ > 0.0; }
    /// Whether it has a magnet that could draw the proxy at some gain, somewhere.         [any]
    bool has_magnet() const noexcept { return has_magnet_; }
    /// Whether its magnet could draw the proxy in this frame.                            [loop]
    bool has_magnet_on() const noexcept { return magnet_.is_on(); }
    /// What could lead a proxy that nothing else holds; null where it cannot.             [loop]
    SlidingSurface* sliding() const noexcept { return yields_ ? nullptr : contact_->sliding(); }
    /// Whether it does not hold at its own level: the proxy is inside, or it yielded.     [loop]
    bool is_open() const noexcept;
    /// Whether it is a membrane that this balance presses above its strength: it opens.  [loop]
    bool open_if_pressed(const ProxySolution& solution, const ContactSet& contacts) noexcept;
    /// The longest step for which its planes are trusted, m; infinite where there are none. [loop]
    double trust_m() const noexcept;
    /// FieldSurface::restore(), as far as it may; nothing where it need not, or yields. [loop]
    std::optional<Vec3> restore(const Vec3& proxy, const FrameContext& frame) noexcept;
    /// FieldSurface::settle(), where it holds the proxy and need not ration.              [loop]
    std::optional<Vec3> settle(const Vec3& proxy) noexcept;

    /// Energy that the drift below its level has taken, J, >= 0.                         [loop]
    double drifted_j() const noexcept { return bank_.energy_j(); }

private:
    /// Of one that has_softness().
    struct Soft {
        Softness softness;
        std::shared_ptr<const StiffnessMap> stiffness; // null: the same everywhere
        double own_strength_n = 0.0;
        PressLaw law;
        double yields_at_m = 0.0; // delta of the law
        double tissue_m = 0.0;    // d of the tissue at the last frame's end, with a damper
    };

    double damped_n(const PressLaw& law, double press_m, double period_s) noexcept;
    Press press_over_lumps(double press_m, double period_s, double ratio) noexcept;
    bool is_off() const noexcept { return gain_value(SurfacePart::strength) == 0.0; }
    bool all_gains_are_one() const noexcept;
    FrameContext in_body(const FrameContext& frame) const noexcept;
    FrameContext seen(const FrameContext& frame) const noexcept;
    void set_strength(const FrameContext& frame) noexcept;

    SurfaceContact* contact_;
    MovingSurface* moving_;
    LocalStrength strength_;
    LoopMagnet magnet_;
    bool has_magnet_;
    LevelBank bank_;
    std::array<GainRamp, kSurfaceParts> gains_;
    bool as_set_ = true; // all_gains_are_one(), as of the last time that one moved

    std::size_t first_ = 0, last_ = 0; // of its planes in the ContactSet: [first_, last_)
    bool pushes_back_ = false;
    bool yields_ = false;
    double sunk_m_ = 0.0; // how far its planes lie below its level in this frame, >= 0

    std::unique_ptr<Soft> soft_;       // apart, as most surfaces are hard
    const PressLaw* tissue_ = nullptr; // yield_as()

    bool looked_ = false;
    bool pushed_before_ = false; // at the end of the last frame
    bool let_go_ = false;        // let_go(), in the last evaluation
    bool began_inside_ = false;
    Vec3 touched_at_{0.0};
    Vec3 touched_normal_{0.0};
};

/// The farthest point on the way from `proxy` to `to` that the energy allows: the coupling there
/// stores no more than at the frame's start plus `drifted_j`, J. Nothing if the proxy may not be
/// lifted at all. m, scene frame. [loop]
std::optional<Vec3> lifted(const Vec3& proxy, const Vec3& to, double drifted_j,
                           const FrameContext& frame) noexcept;

} // namespace palpate
