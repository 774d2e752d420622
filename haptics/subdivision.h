// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <palpate/haptics/effect.h>
#include <palpate/haptics/gain.h>
#include <palpate/haptics/level_bank.h>
#include <palpate/haptics/local_strength.h>
#include <palpate/haptics/proxy_solver.h>
#include <palpate/haptics/settling.h>
#include <palpate/haptics/step_time_estimator.h>
#include <palpate/haptics/surface_contact.h>
#include <palpate/haptics/surface_magnets.h>

namespace palpate {

/// How a frame's movement of the proxy is cut into sub-steps.
enum class SteppingMethod {
    single,   ///< one evaluation: the state before the paper
    paper,    ///< eqs (6)-(10): as many shares as the clock allows
    fixed,    ///< eqs (6), (7), (9) with a given number of shares
    adaptive, ///< full steps with curvature until the residual is below the tolerance
};

struct SteppingSettings {
    SteppingMethod method = SteppingMethod::adaptive;
    int sub_steps = 8;         ///< fixed: evaluations per frame, [1, Subdivision::kMostEvaluations]
    double budget_us = 900.0;  ///< paper: t_delta of eq. (8), us, > 0
    double tolerance_m = 1e-7; ///< adaptive: a step expected to leave less is the last, m, > 0
    int evaluation_cap = 8; ///< adaptive: evaluations per frame at most, besides one for each edge
                            ///< that the proxy goes over where several meshes hold it together,
                            ///< [1, kMostEvaluations]
};

/// What a frame's subdivision came to.
struct SubdivisionResult {
    Vec3 proxy{0.0}; ///< x', m
    std::uint32_t evaluations = 0;
    std::uint32_t sub_steps = 0;
    std::uint32_t contacts = 0; ///< multipliers above 0 in the last solution
    double residual_m = 0.0;    ///< length of the last movement that the solver asked for
    std::uint32_t flags = 0;    ///< FrameFlag bits
    std::uint32_t work = 0;     ///< as Subdivision::kWorkOfSolvers counts it
    std::uint64_t felt = 0; ///< bit i: surface i (canonical order, up to 64) pushed back at the end
    std::uint64_t open = 0; ///< bit i: surface i did not hold at its own level in a part of the
                            ///< frame: the proxy is inside, or it yielded
    std::uint64_t guarded = 0; ///< bit i: the mesh of surface i held back what its volume would
                               ///< have let through
};

/// Spends a frame in sub-steps (section 4.1 of the paper; composition.md 2.2): gathers primitives
/// at the proxy (6), solves (7), sees how many more steps fit (8), takes a share of the movement
/// (9) or a curvature-corrected one, and lets the surfaces carry the proxy as far as every
/// certificate holds. Owns nothing that moves but the loop's iteration memory.
class Subdivision {
public:
    /// Bounds every frame, also where a clock stands still.
    static constexpr int kMostEvaluations = 4096;
    /// What a frame may take, in primitives that a solver looks at once: so many for its solvers,
    /// and three times kWorkOfEvaluation, which is an evaluation without them, for each evaluation
    /// that its method may make. Evaluations, bends, friction's rounds and solver passes spend of
    /// it alike. Where it is spent an adaptive frame ends with what it has (kEvaluationCap), and
    /// others go on with one short round an evaluation (kSolverCap where that does not do).
    static constexpr int kWorkOfSolvers = 8192;
    static constexpr int kWorkOfEvaluation = 64;
    /// Pieces of way on which surfaces lead the proxy by themselves, in one frame.
    static constexpr int kMostLegs = 1024;

    /// Surfaces, the finish of each (plain where there are fewer) and effects in canonical order;
    /// all must outlive this. Throws std::invalid_argument on settings out of range.  [setup]
    Subdivision(const SteppingSettings& settings, std::vector<SurfaceContact*> surfaces,
                std::vector<Effect*> effects, Clock& clock, std::vector<SurfaceFinish> finish = {});

    /// Gain of a surface (its strength), of the friction on it (its coefficients), of its texture
    /// (its heights), of its magnet or of an effect, by their index: [0, GainRamp::kHighest]; 0
    /// switches off. From any thread while the loop runs; followed as GainRamp says. A trial begins
    /// with the gains that were set last. [any]
    void set_surface_gain(std::size_t surface, double gain) noexcept {
        surface_gains_[surface].set(gain);
    }
    void set_friction_gain(std::size_t surface, double gain) noexcept {
        friction_gains_[surface].set(gain);
    }
    void set_magnet_gain(std::size_t surface, double gain) noexcept {
        magnet_gains_[surface].set(gain);
    }
    void set_texture_gain(std::size_t surface, double gain) noexcept {
        texture_gains_[surface].set(gain);
    }
    void set_effect_gain(std::size_t effect, double gain) noexcept {
        effect_gains_[effect].set(gain);
    }

    /// A new trial: the proxy is set to `proxy`. Returns FrameFlag bits.                 [loop]
    std::uint32_t restart(const Vec3& proxy) noexcept;

    /// One frame's movement of the proxy from frame.start.                              [loop]
    SubdivisionResult advance(const FrameContext& frame) noexcept;

    /// The same with the clock's decisions of an earlier run: N_steps of eq. (8) for each
    /// evaluation. Reproduces its bits.   [loop]
    SubdivisionResult advance(const FrameContext& frame,
                              std::span<const std::uint32_t> steps_left) noexcept;

    /// The proxy's corners in the last frame, frame.start first: every chord that was carried.
    /// [loop]
    std::span<const Vec3> path() const noexcept { return path_; }
    /// N_steps after each evaluation of the last frame: with these, wall-clock runs can be
    /// replayed.  [loop]
    std::span<const std::uint32_t> steps_left() const noexcept { return steps_left_; }
    /// The coupling's force with what effects put on the device beside it, each with its gain, N:
    /// Effect::device_force_n().                                                          [loop]
    Vec3 with_device_forces(Vec3 force_n) const noexcept;
    /// What effects push unasked, each with its gain and by no more than `most_n`, N:
    /// Effect::unasked_force_n().                                                         [loop]
    double unasked_force_n(double most_n) const noexcept;
    /// Whether anything that is on, a magnet too, may move a hand that did not press:
    /// Effect::is_active().                                                               [loop]
    bool is_active() const noexcept;
    /// Of the fields that strengths of surfaces and magnets depend on.                   [any]
    QueryCount queries() const noexcept;
    double estimate_us()
        const noexcept; ///< of a sub-step, eq. (10); 0 where the method needs no clock  [any]

private:
    /// Whether something may be led there: finite, and no further away than a probe may be.
    static bool is_a_place(const Vec3& point) noexcept {
        return squared_length(point) < kFarthest_m * kFarthest_m; // false for what is no number
    }
    /// Evaluations in a row that may fail to move the proxy before the frame is given up.
    static constexpr int kTriesToMove = 3;
    static constexpr double kFarthest_m = 1e7; ///< ten times what the loop takes from a probe

    /// Bit i where `set`; 0 past the 64th.
    static std::uint64_t bit_of(std::size_t i, bool set) noexcept {
        return set && i < 64 ? std::uint64_t{1} << i : 0;
    }
    SubdivisionResult run() noexcept;
    void begin(SubdivisionResult& result) noexcept;
    bool may_bend() const noexcept;
    bool is_on(std::size_t effect) const noexcept { return effect_gains_[effect].value() > 0.0; }
    Vec3 relaxed(Vec3 proxy, SubdivisionResult& result) noexcept;
    bool membrane_opens(SubdivisionResult& result) noexcept;
    bool breaks_away(const SubdivisionResult& result) noexcept;
    void note_open(SubdivisionResult& result) const noexcept;
    void gather(const Vec3& proxy) noexcept;
    double depth_not_to_restore(std::size_t surface, const Vec3& proxy) noexcept;
    void solve(const Vec3& proxy, SubdivisionResult& result) noexcept;
    std::uint32_t steps_still_affordable(const SubdivisionResult& result) noexcept;
    bool all_flat() const noexcept;
    int all_work() const noexcept;
    int evaluations_left(const SubdivisionResult& result) const noexcept;
    bool keeps_its_place(const SubdivisionResult& result) noexcept;
    Vec3 candidate(const Vec3& proxy, std::uint32_t steps_left, double residual_m) noexcept;
    std::optional<Vec3> restored(const Vec3& proxy, bool only_try) const noexcept;
    double lift_share(double drifted_j, const Vec3& proxy, const Vec3& to) const noexcept;
    Vec3 within(Vec3 wanted) const noexcept;
    Vec3 curved_candidate(const Vec3& proxy, double residual_m) noexcept;
    Vec3 carried(const Vec3& from, const Vec3& to, SubdivisionResult& result) noexcept;
    Vec3 accepted(const Vec3& proxy, SubdivisionResult& result) noexcept;
    SurfaceContact* leading_surface() const noexcept;
    bool rests_firmly(const SurfaceContact& surface, const Vec3& proxy) const noexcept;
    Vec3 pull() const noexcept;
    Vec3 led(SurfaceContact& surface, Vec3 proxy, std::uint32_t steps_left,
             SubdivisionResult& result) noexcept;
    bool is_astray(const Vec3& proxy) const noexcept;
    Vec3 settled(Vec3 proxy, SubdivisionResult& result) noexcept;
    void commit(const Vec3& proxy, SubdivisionResult& result) noexcept;
    bool any_state(std::size_t surface, MultiplierState state) const noexcept;

    SteppingSettings settings_;
    std::vector<SurfaceContact*> surfaces_;
    std::vector<Effect*> effects_;
    Clock& clock_;
    StepTimeEstimator estimator_;

    CoulombFriction friction_;
    SurfaceMagnets magnets_;
    std::vector<LocalStrength> strengths_; // of each surface, where they depend on the place
    std::vector<LevelBank> banks_;         // of each surface
    Settling settling_;
    std::vector<GainRamp> surface_gains_;
    std::vector<GainRamp> friction_gains_; // of each surface
    std::vector<GainRamp> magnet_gains_;   // of each surface
    std::vector<GainRamp> texture_gains_;  // of each surface
    std::vector<GainRamp> effect_gains_;

    // Of one evaluation.
    ContactSet contacts_; // of surfaces, then of magnets
    PrimitiveSet primitives_;
    ProxySolution solution_;
    std::vector<std::size_t> first_contact_; // of each surface, in contacts_; one more at their end

    // Of one frame.
    FrameContext frame_;
    double settling_n_per_m_ = 0.0; // of the spring towards the frame's start
    double began_us_ = 0.0;         // t_0
    double last_us_ = 0.0;          // t_n
    bool begins_ = false;           // nothing gathered yet
    std::vector<double> sunk_m_;    // of each surface: how far its planes lie below its level
    double damping_ = 1.0;          // of tangential steps (contact.md 1.2, step 5)
    double last_residual_m_ = 0.0;
    bool converged_ = false; // the last step is expected to leave less than the tolerance
    int unmoved_ = 0;        // evaluations in a row that did not move the proxy
    int bends_ = 0;          // evaluations that an edge of a surface's own cost: not of the cap
    int legs_left_ = 0;      // of kMostLegs
    int work_left_ = 0;      // of all_work()
    std::span<const std::uint32_t> replayed_;
    std::vector<Vec3> path_;
    std::vector<std::uint32_t> steps_left_;
};

} // namespace palpate
