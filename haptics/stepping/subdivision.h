// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/surface_magnets.h>
#include <palpate/haptics/solver/gain.h>
#include <palpate/haptics/solver/proxy_solver.h>
#include <palpate/haptics/stepping/calming.h>
#include <palpate/haptics/stepping/loop_effect.h>
#include <palpate/haptics/stepping/loop_surface.h>
#include <palpate/haptics/stepping/proxy_path.h>
#include <palpate/haptics/stepping/stepping.h>
#include <palpate/haptics/stepping/sub_step.h>
#include <palpate/haptics/stepping/touch.h>

namespace palpate {

/// The result of a frame's subdivision.
struct SubdivisionResult {
    Vec3 proxy{0.0};               ///< x', m
    std::uint32_t evaluations = 0; ///< how often primitives were gathered and solved
    std::uint32_t sub_steps = 0;   ///< movements of the proxy
    std::uint32_t contacts = 0; ///< primitives that push in the last solution, without friction's
    double residual_m = 0.0;    ///< length of the last movement that the solver asked for
    std::uint32_t flags = 0;    ///< FrameFlag bits
    std::uint32_t work = 0;     ///< spent of the budget, in the units of kWorkOfSolvers
    // felt_bit(i) of the next three: the i-th surface given to Subdivision's constructor.
    std::uint64_t felt = 0;    ///< the surface pushed back at the frame's end
    std::uint64_t open = 0;    ///< in a part of the frame the surface did not hold at its own
                               ///< level: the proxy was inside, or the surface yielded
    std::uint64_t guarded = 0; ///< the surface's mesh held the proxy back where its volume alone
                               ///< would have let it through
};

/// The contacts of one frame. There is room for all: no solution has more planes than a
/// PrimitiveSet, no more surfaces end than pushed in the frame before, and of soft surfaces beside
/// others, each of which is one, there are at most Subdivision::kMostLayers.
using TouchList = FixedVector<Touch, 3 * PrimitiveSet::kCapacity>;

/// Cuts the movement of the proxy in one frame into sub-steps (section 4.1 of the paper;
/// composition.md 2.2). Each sub-step gathers primitives at the proxy (6), solves for the
/// candidate (7), counts the steps that the time still allows (8), and takes a share of the way (9)
/// or a step that follows the curvature. It then moves the proxy as far as every certificate holds:
/// the check of a surface that a straight movement goes no deeper than its tolerance. Numbers in
/// brackets are the paper's equations (docs/equations.md). Contacts and effects belong to the
/// caller. What a loop remembers of them is here: gains, energy banks, magnets, friction, calming.
class Subdivision {
public:
    /// The work that a frame may do. One unit is what a solver does for one primitive in one pass.
    /// A frame may spend kWorkOfSolvers, and 3 kWorkOfEvaluation for each evaluation that its
    /// method may make. An evaluation costs kWorkOfEvaluation without its solver. Evaluations,
    /// steps around a mesh's edges, friction's repeated solutions and solver passes all spend from
    /// this budget. When it is spent, the frame ends where it is (kEvaluationCap). Methods but
    /// adaptive do not follow what the solver then had no time to solve (kSolverCap), but in a
    /// frame's first sub-step.
    static constexpr int kWorkOfSolvers = 8192;
    static constexpr int kWorkOfEvaluation = 64;
    /// The most legs (SlideLeg: straight pieces of way along a surface) in one frame, besides one
    /// for each share.
    static constexpr int kMostLegs = 1024;
    /// The most soft surfaces that are felt beside others.
    static constexpr std::size_t kMostLayers = PrimitiveSet::kCapacity;

    /// Surfaces and effects must be in an order that does not depend on how the scene is written
    /// (composition.md 2.4). `finish` is that of each surface; those that it lacks are plain. All
    /// pointers must outlive this. Throws std::invalid_argument on settings out of range.  [setup]
    Subdivision(const SteppingSettings& settings, std::vector<SurfaceContact*> surfaces,
                const std::vector<Effect*>& effects, Clock& clock,
                std::vector<SurfaceFinish> finish = {});

    /// From the next frame on it also computes what Needs leaves out, and asks a surface again
    /// where a leg says that the proxy settles: the same bits, and slower. For tests, and to
    /// measure what is saved. [setup]
    void compute_everything() noexcept;

    /// From the next frame on `observer` is told every sub-step; null: nobody is. The frames keep
    /// their bits. It must outlive this, or be taken away before.                        [setup]
    void observe(SubStepObserver* observer) noexcept { observer_ = observer; }
    SubStepObserver* observer() const noexcept { return observer_; } ///< who is told      [setup]

    /// Gain of a part of a surface, or of an effect, by their index, which exists; 0 switches off.
    /// Any thread may call GainRamp::set() while the loop runs; its other functions are the loop's.
    /// A trial begins with the gains that were set last. [any]
    GainRamp& gain(std::size_t surface, SurfacePart part) noexcept {
        return of_surface(surface).gain(part);
    }
    GainRamp& gain(std::size_t effect) noexcept { return effects_[effect].gain(); }

    /// How a soft surface was pressed in the last frame.
    struct Pressed {
        double indentation_m = 0.0; ///< d: from the front to the tip, m; 0: not pressed
        double slope_n_per_m =
            0.0;                   ///< of the force over how far the probe is behind the front, N/m
        Vec3 front{0.0};           ///< y, m, scene frame
        std::uint32_t surface = 0; ///< by the order in which surfaces were given: of several the
                                   ///< one that is pressed in farthest
    };

    /// All that it remembers from frame to frame, also of surfaces and effects. path() and
    /// steps_left() are left out, as they only describe the last frame.
    struct State {
        std::vector<LoopSurface::State> surfaces;
        std::vector<LoopEffect::State> effects;
        CoulombFriction::State friction;
        Calming calming;
        Stepping::State stepping;
        struct OfLayer;
        Pressed pressed;             ///< of the last frame
        std::vector<OfLayer> layers; ///< what is soft and not alone
        PrimitiveSet primitives;     ///< of the last evaluation: their pull begins the next frame's
    };
    State save_state() const; ///< between frames                                         [setup]
    /// Between frames; allocates only if an effect's own restore_state() does. Settings, surfaces
    /// and effects must be the same as those of the state. If their number or kinds differ, throws
    /// std::invalid_argument that says what differs, and changes nothing. Also throws what
    /// Effect::restore_state() throws.                                                   [setup]
    void restore_state(const State& state);

    /// A new trial: the proxy is set to `proxy`. Returns FrameFlag bits.                 [loop]
    std::uint32_t restart(const Vec3& proxy) noexcept;
    /// Which part of another Subdivision a part of this one goes on from; as kNew: from none.
    struct Heritage {
        static constexpr std::size_t kNew = static_cast<std::size_t>(-1);
        std::span<const std::size_t> surfaces; ///< for each surface of this one
        std::span<const std::size_t> effects;  ///< for each effect
    };
    /// Continues `before`. Surfaces and effects that both have keep their state; the others begin
    /// as at a new trial. `proxy`: where the last frame ended. Where a surface was soft beside
    /// others, and is hard or alone now, `proxy` moves to its front if every certificate allows the
    /// way. Where a surface was soft and alone, and is so no more, `proxy` stays, unless it goes on
    /// and is hard now: then it is in front of it. Returns FrameFlag bits. [loop]
    std::uint32_t go_on_from(const Subdivision& before, const Heritage& heritage,
                             Vec3& proxy) noexcept;

    /// One frame's movement of the proxy from frame.start. With steps_left() of an earlier run in
    /// the place of the clock it gives the same bits as that run.                       [loop]
    SubdivisionResult advance(const FrameContext& frame,
                              std::span<const std::uint32_t> steps_left = {}) noexcept;

    /// Whether there is a surface that may be soft. Then the proxy of a frame is the tip, and each
    /// frame goes on from the front that this keeps, not from frame.start.             [any]
    bool has_softness() const noexcept { return needs_.softness; }
    const Pressed& pressed() const noexcept { return pressed_; } ///< where has_softness() [loop]
    /// Whether what is soft is alone: frames go on from its front, whatever frame.start. [any]
    bool keeps_front() const noexcept { return needs_.alone; }
    /// Where the proxy, at `proxy` at the end of the last frame, is for the next one: the front of
    /// what is soft and alone, m, scene frame.                                           [loop]
    const Vec3& front(const Vec3& proxy) const noexcept {
        return needs_.alone ? pressed_.front : proxy;
    }
    /// The same for one surface: its front, where it is soft.                            [loop]
    const Vec3& place_on(std::size_t surface, const Vec3& proxy) const noexcept {
        const Layer* layer = layer_of(surface);
        return layer ? layer->y : front(proxy);
    }

    /// The corners of the proxy's way in the last frame, frame.start first; of what is soft: of the
    /// front.                                                                            [loop]
    std::span<const Vec3> path() const noexcept { return path_.corners(); }
    /// N_steps of eq. (8) after each evaluation of the last frame: with these a run whose clock
    /// decided can be replayed.                                                           [loop]
    std::span<const std::uint32_t> steps_left() const noexcept { return steps_left_; }
    /// What was touched at the end of the last frame, surface by surface; what it replaces may be
    /// anything. After an advance(), before a restart() or restore_state(). [loop]
    void find_touches(TouchList& touches) const noexcept;
    /// By the order in which surfaces were given.                                        [loop]
    const LoopSurface& surface(std::size_t i) const noexcept {
        const Layer* layer = layer_of(i);
        return layer ? layer->front->surfaces_.front() : surfaces_[i];
    }
    /// The coupling's force plus what effects put on the device directly, each with its gain, N:
    /// Effect::device_force_n().                                                          [loop]
    Vec3 with_device_forces(Vec3 force_n) const noexcept;
    /// The sum of the forces with which effects push though the hand has not pressed, each with its
    /// gain and at most `most_n`, N: Effect::unasked_force_n().                           [loop]
    double unasked_force_n(double most_n) const noexcept;
    /// Whether anything that is on, a magnet or a body too, may move a hand that did not press:
    /// Effect::is_active().                                                               [loop]
    bool is_active() const noexcept;
    /// Queries to the fields that strengths of surfaces and magnets depend on.            [any]
    QueryCount queries() const noexcept;
    /// Estimated time of a sub-step, eq. (10), us; 0 if the method needs no clock.        [any]
    double estimate_us() const noexcept { return stepping_.estimate_us(); }

private:
    /// Whether a proxy may be led there: finite, and not too far away.
    static bool is_a_place(const Vec3& point) noexcept {
        return squared_length(point) < kFarthest_m * kFarthest_m; // false for what is no number
    }
    /// After so many evaluations in a row that did not move the proxy, other ways are tried.
    static constexpr int kTriesOfOneWay = 2;
    static constexpr double kFarthest_m = 1e7; ///< ten times what HapticLoop accepts of a probe
    static std::uint64_t bit_of(std::size_t i, bool set) noexcept { return set ? felt_bit(i) : 0; }

    /// How the proxy moves after an evaluation.
    struct Move {
        using Kind = SubStep::Kind;
        Kind kind = Kind::none;
        Vec3 to{0.0};
    };

    /// Where the proxy could go while bodies move.
    struct Passage {
        Vec3 to{0.0};       // m
        double share = 0.0; // of the way there that every certificate holds; 1: it can go there
    };

    /// A soft surface that is not alone: its front follows the tip, which others hold, too.
    struct Layer {
        std::size_t surface = 0;            // by the order in which surfaces were given
        std::unique_ptr<Subdivision> front; // over the surface alone, as if it were hard
        Softness softness;
        PressLaw law;
        // Of the last frame's end.
        double tissue_m = 0.0; // d of the tissue, with a damper
        bool pushes = false;
        Vec3 touched_at{0.0}; // where the tip was when it pushed last, m
        Vec3 touched_normal{0.0};
        bool pushed_before = false; // the same of the frame before
        bool gave_way = false;      // its front, in this frame
        // Of the last evaluation.
        Vec3 y{0.0};                // where the front is, m
        Vec3 normal{0.0};           // from the tip to there
        double indentation_m = 0.0; // d
        double force_n = 0.0;
        double slope_n_per_m = 0.0; // of the force over d
        bool at_strength = false;   // it holds with no more, wherever the tip goes
        std::uint32_t flags = 0;    // of the front, in this frame
    };

    /// What the surfaces and effects call for. The rest is not computed.
    struct Needs {
        bool bodies = false;      // a surface may move
        bool softness = false;    // a surface may be soft
        bool alone = false;       // it is the only surface, and every effect only pushes
        bool layers = false;      // it is felt beside others
        bool starts = false;      // a frame may begin elsewhere: bodies, alone
        bool others = false;      // there are effects, or layers
        bool magnets = false;     // a surface may have one
        bool calming = false;     // frames may contradict each other
        bool one_alone = false;   // one surface, which may not come to rest by itself: voxels may
                                  // be noise; a soft one may overshoot with few evaluations
        bool nothing = false;     // there are neither surfaces nor effects
        bool only_slides = false; // one surface, which can lead the proxy, without friction,
                                  // magnet or body, and no effect
        bool everything = false;  // compute_everything()
    };

    SubdivisionResult run(std::span<const std::uint32_t> replayed) noexcept;
    void begin_pressing() noexcept;
    Vec3 tip_of(const Vec3& front) noexcept;
    Vec3 along_front(const Vec3& gradient, const Vec3& n, double press_m) const noexcept;
    void make_layers(const SteppingSettings& settings, const std::vector<SurfaceContact*>& contacts,
                     const std::vector<SurfaceFinish>& finish, Clock& clock,
                     const std::vector<Effect*>& effects);
    void require_alike(const State& state) const;
    const Layer* was_layer(const Subdivision& before, const Heritage& heritage,
                           std::size_t i) const noexcept;
    template <class Asked>
    bool goes_to(const Vec3& proxy, const Vec3& to, const Asked& asked) noexcept;
    const Layer* layer_of(std::size_t surface) const noexcept {
        for (const Layer& layer : layers_)
            if (layer.surface == surface) return &layer;
        return nullptr;
    }
    LoopSurface& of_surface(std::size_t i) noexcept {
        const Layer* layer = layer_of(i);
        return layer ? layer->front->surfaces_.front() : surfaces_[i];
    }
    double resistance_n_per_m() const noexcept;
    double unspent_m() const noexcept;
    void press_layers(const Vec3& tip) noexcept;
    void hold_at_strength(const Vec3& tip) noexcept;
    bool reaches_held_tip(const Layer& layer) const noexcept;
    void correct_for_layers(const Vec3& tip) noexcept;
    double share_to_balance(const Vec3& full, const Vec3& step) const noexcept;
    void press(Layer& layer, const Vec3& tip) noexcept;
    Mat3 turning_of(const Layer& layer) const noexcept;
    void commit_layers(const Vec3& tip) noexcept;
    Touch touch_of(const Layer& layer) const noexcept;
    void begin(std::span<const std::uint32_t> replayed) noexcept;
    Vec3 follow_bodies(Vec3 proxy) noexcept;
    Passage place_beside_bodies(const Vec3& proxy, int& looks) noexcept;
    Passage between_bodies(const Vec3& proxy, int& looks) noexcept;
    Passage relative_way(const Vec3& from, const Vec3& to, const LoopSurface* along_with,
                         int& looks) noexcept;
    void look(std::size_t surface, const Vec3& proxy) noexcept;
    void begin_calming() noexcept;
    void follow_gains() noexcept;
    bool is_driven() const noexcept;
    bool frames_may_contradict() const noexcept;
    void begin_approach() noexcept;
    void gather(const Vec3& proxy) noexcept;
    void solve(const Vec3& proxy) noexcept;
    bool solve_on_facet(const Vec3& proxy) noexcept;
    void evaluated(const Vec3& proxy, int work_left) noexcept;
    void count_steps_left() noexcept;
    Move next_move(const Vec3& proxy) noexcept;
    Vec3 follow(const Move& move, const Vec3& proxy) noexcept;
    void tell(const Move& move, const Vec3& from, const Vec3& to) noexcept;
    bool goes_on(const Move& move, const Vec3& before, const Vec3& proxy) noexcept;
    bool open_a_membrane() noexcept;
    bool let_friction_slip() noexcept;
    SubdivisionResult run_free() noexcept;
    SubdivisionResult commit(const Vec3& proxy) noexcept;
    SubdivisionResult end_frame(const Vec3& proxy) noexcept;
    void note_open() noexcept;
    void note_touch(LoopSurface& surface, const Vec3& proxy) const noexcept;
    Vec3 held_with(const Vec3& proxy) const noexcept;
    Vec3 friction_at(std::size_t contact) const noexcept;
    bool may_give_way(const Vec3& proxy) const noexcept;
    bool has_given_up() const noexcept;

    bool keeps_its_place() noexcept;
    LoopSurface& leader() noexcept;
    bool one_surface_leads() noexcept;
    bool is_held_anew() const noexcept;
    bool rests_firmly(const Vec3& proxy) noexcept;
    /// The probe, shifted by forces and springs.
    Vec3 pull() const noexcept { return primitives_.pull(frame_.probe, frame_.stiffness); }
    Vec3 candidate(const Vec3& proxy) noexcept;
    std::optional<Vec3> restored(const Vec3& proxy) noexcept;
    Vec3 curved_candidate(const Vec3& proxy) noexcept;
    Vec3 carry(const Vec3& from, const Vec3& to) noexcept;
    void note_stop(const LoopSurface& surface, const Chord& chord, const Vec3& from,
                   const Vec3& to) noexcept;
    Vec3 slide_along(Vec3 proxy, const Vec3& pull) noexcept;
    Vec3 record_move(const Vec3& proxy) noexcept;
    Vec3 final_proxy(Vec3 proxy) noexcept;
    Vec3 settled(const Vec3& proxy, const Vec3& to) noexcept;
    bool is_astray(const Vec3& proxy) const noexcept;
    double most_lift_m() const noexcept;
    Vec3 taken_back(Vec3 proxy) noexcept;
    Vec3 within(Vec3 wanted) const noexcept;
    bool is_inside(const Vec3& proxy) const noexcept;

    Stepping stepping_;
    std::vector<LoopSurface> surfaces_;
    std::vector<LoopEffect> effects_;
    CoulombFriction friction_;
    Calming calming_;

    // Of one evaluation.
    ContactSet contacts_; // of surfaces, then of magnets
    PrimitiveSet primitives_;
    ProxySolution solution_;

    // Of one frame.
    FrameContext frame_;
    FrameBudget budget_;
    ProxyPath path_;
    std::vector<std::uint32_t> steps_left_;
    SubdivisionResult result_;
    bool led_ = false; // the last move was the leading surface's own
    Pressed pressed_;
    std::vector<Layer> layers_;
    std::vector<std::unique_ptr<SurfaceContact>> stand_ins_; // for the contacts of layers
    bool layers_press_ = false;                              // in this evaluation
    double shortened_m_ = 0.0; // the tip's step, where the laws of layers shorten it, m; else 0
    Mat3 tissue_{0.0};         // by how much their forces fall with the tip's step, N/m
    Vec3 aside_n_{0.0};        // of the last frame: towards where the surface is softer
    double softened_ = 1.0;    // force of the last frame over that of a hard surface, (0, 1]

    Needs needs_;
    int work_of_a_frame_ = 0; // grows with the evaluations of the method
    SubStepObserver* observer_ = nullptr;
    SubStep::Stop stop_; // of the move that is under way, where there is an observer
};

/// A soft surface that is not alone.
struct Subdivision::State::OfLayer {
    State front;           ///< of the Subdivision that leads it
    Vec3 y{0.0};           ///< where it is, m
    double tissue_m = 0.0; ///< d with a damper, m
    bool pushes = false;   ///< in the last frame
    Vec3 touched_at{0.0};  ///< where the tip was when it pushed last, m
    Vec3 touched_normal{0.0};
};

} // namespace palpate
