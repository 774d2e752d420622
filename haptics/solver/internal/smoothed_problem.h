// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/solver/internal/mixed_primitives.h>

namespace palpate::internal {

/// A displacement y = x - a' and what follows from it within a stage.
struct Iterate {
    /// At y = 0, without multipliers.
    explicit Iterate(const MixedPrimitives& primitives) noexcept
        : offsets(primitives.at_target),
          multipliers(primitives.hinges.size(), primitives.tethers.size()),
          wish(primitives.tethers.size(), 0.0) {}

    Vec3 y{0.0}; ///< m
    Offsets offsets;
    Multipliers multipliers;
    FixedVector<double, PrimitiveSet::kCapacity> wish; ///< |w0 - r/e|, m: above the bound: slips
    Vec3 gradient{0.0};                                ///< m
    double value = 0.0;                                ///< m^2
};

/// The method of multipliers. With all multipliers in metres (N / k), the problem is
///
///     min over y of  1/2 |y|^2 + sum over primitives of  max over w in W of  -w.r(y)
///
/// where r is a primitive's offset (a plane's gap; the way from a line, from a point) and W what
/// its multiplier may be (the interval [0, sigma]; a disc, a ball of radius sigma). A stage gives
/// every primitive a compliance e around an anchor w0, the multiplier of the stage before:
///
///     max over w in W of  -w.r - e/2 |w - w0|^2,      attained at  w = P_W(w0 - r/e)
///
/// which is smooth in y, convex, and quadratic in pieces: Newton steps in three unknowns with a
/// search along each converge from anywhere. Its solution has a natural residual of at most
/// e |w - w0|, for w - r = w + e nu - e (w0 - w) with nu normal to W at w, and P_W does not expand.
/// Then w0 := w, e := e/100, until that is rounding. Multipliers that are unique converge within
/// three or four stages; where they are not, e alone makes the residual small.
///
/// Offsets are carried along with the steps (r += step), never computed anew from y: that errs as
/// anchors moved by rounding would, and lets w0 - r/e keep its digits where r is tiny.
class SmoothedProblem {
public:
    explicit SmoothedProblem(const MixedPrimitives& primitives) noexcept;

    /// Stages until what their anchors leave is rounding, or that or the cap ends it: `pass_cap`
    /// passes over the primitives, and up to 16 to end a step.  [loop]
    void solve(int pass_cap) noexcept;

    const Iterate& iterate() const noexcept { return now_; }
    /// The solution of the last stage that came to its end.
    const Multipliers& anchors() const noexcept { return anchors_; }
    int passes() const noexcept { return passes_; }

private:
    enum class Anchors { stay, move };

    void evaluate(const Iterate& from, const Vec3& step, Iterate& to) noexcept;
    bool is_at_end(std::size_t i) const noexcept;
    Vec3 newton_step(const Vec3& gradient) const noexcept;
    void begin_stage(Anchors anchors) noexcept;
    bool take_full_step() noexcept;
    bool take_searched_step() noexcept;
    void search_along(const Vec3& step) noexcept;
    using Shares = FixedVector<double, 2 * PrimitiveSet::kCapacity>;
    Shares bends_along(const Vec3& step) const noexcept;

    const MixedPrimitives& primitives_;
    double compliance_;   // e
    Multipliers anchors_; // w0
    Iterate now_;
    Iterate trial_;
    int passes_ = 0;
    int stage_began_ = 0; ///< at this pass
};

} // namespace palpate::internal
