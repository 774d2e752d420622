// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/solver/internal/smoothed_problem.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <palpate/haptics/solver/internal/solver_limits.h>

namespace palpate::internal {
namespace {

constexpr double kFirstCompliance = 0.01;
constexpr double kCompliancePerStage = 0.01;
// The identity in the Hessian 1 + 1/e must not be lost to rounding.
constexpr double kLeastCompliance = 1e-14;
// A stage ends when its gradient is below this share of the residual that its anchors leave.
constexpr double kStageShare = 0.5;
// Rounding of the sum of all multipliers, of their lengths and the scale.
constexpr double kRounding = 4e-16;
// Below this many roundings of the gradient, slopes along a step are noise.
constexpr double kNearRounding = 100.0;
// A search along a step ends where its slope has fallen to this share.
constexpr double kFlat = 0.1;
// A stage that takes more passes goes to and fro over a hinge's narrow range; as a rule one takes
// fewer than ten.
constexpr int kLongStage = 40;
// Nearer to an end of its range, in shares of it, a hinge may be taken to hold: steps end there but
// for rounding.
constexpr double kAtEnd = 1e-9;

/// A symmetric matrix, at least the identity: the sum of the identity and squares.
struct Hessian {
    double xx = 1.0, yy = 1.0, zz = 1.0, xy = 0.0, xz = 0.0, yz = 0.0;

    void add_identity(double weight) noexcept {
        xx += weight;
        yy += weight;
        zz += weight;
    }
    void add_square(const Vec3& v, double weight) noexcept {
        xx += weight * v.x * v.x;
        yy += weight * v.y * v.y;
        zz += weight * v.z * v.z;
        xy += weight * v.x * v.y;
        xz += weight * v.x * v.z;
        yz += weight * v.y * v.z;
    }

    /// H^-1 b by elimination with pivots from the diagonal. None is below 1 but by rounding.
    Vec3 solve(const Vec3& b) const noexcept {
        double m[3][3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
        double rest[3] = {b.x, b.y, b.z};
        int order[3] = {0, 1, 2};
        for (int k = 0; k < 3; ++k) {
            int largest = k;
            for (int i = k + 1; i < 3; ++i)
                if (m[order[i]][order[i]] > m[order[largest]][order[largest]]) largest = i;
            std::swap(order[k], order[largest]);
            const int p = order[k];
            m[p][p] = std::max(1.0, m[p][p]);
            for (int i = k + 1; i < 3; ++i) {
                const int row = order[i];
                const double share = m[row][p] / m[p][p];
                rest[row] -= share * rest[p];
                for (int j = k + 1; j < 3; ++j)
                    m[row][order[j]] -= share * m[p][order[j]];
            }
        }
        double x[3] = {0.0, 0.0, 0.0};
        for (int k = 3; k-- > 0;) {
            const int p = order[k];
            x[p] = rest[p];
            for (int j = k + 1; j < 3; ++j)
                x[p] -= m[p][order[j]] * x[order[j]];
            x[p] /= m[p][p];
        }
        return {x[0], x[1], x[2]};
    }
};

bool holds(const Hinge& hinge, double lambda) noexcept {
    return lambda > 0.0 && lambda < hinge.bound;
}

} // namespace

SmoothedProblem::SmoothedProblem(const MixedPrimitives& primitives) noexcept
    : primitives_(primitives), compliance_(kFirstCompliance),
      anchors_(primitives.hinges.size(), primitives.tethers.size()), now_(primitives),
      trial_(primitives) {}

void SmoothedProblem::solve(int pass_cap) noexcept {
    if (!(primitives_.scale > 0.0)) return; // every anchor is at a'
    evaluate(now_, Vec3{0.0}, now_);
    while (passes_ < pass_cap) {
        const double rounding =
            kRounding * (primitives_.scale + primitives_.sum_of_lengths(now_.multipliers));
        const double left_m = compliance_ * primitives_.largest_change(anchors_, now_.multipliers);
        const double slope_m = glm::length(now_.gradient);
        const bool settled = slope_m <= std::max(rounding, kStageShare * left_m);
        if (settled && left_m <= rounding) return;
        const bool near = slope_m <= kNearRounding * rounding;
        if (!settled && (near ? take_full_step() : take_searched_step())) continue;
        if (near && left_m <= rounding) return;
        if (compliance_ <= kLeastCompliance) return;
        begin_stage(settled || near ? Anchors::move : Anchors::stay);
    }
}

/// One pass over all primitives: `to` becomes `from` moved by `step`.
void SmoothedProblem::evaluate(const Iterate& from, const Vec3& step, Iterate& to) noexcept {
    ++passes_;
    to.y = from.y + step;
    to.gradient = to.y;
    to.value = 0.5 * squared_length(to.y);
    for (std::size_t i = 0; i < primitives_.hinges.size(); ++i) {
        const Hinge& hinge = primitives_.hinges[i];
        const double gap = from.offsets.gap[i] + glm::dot(hinge.normal, step);
        const double lambda = std::clamp(anchors_.lambda[i] - gap / compliance_, 0.0, hinge.bound);
        const double change = lambda - anchors_.lambda[i];
        to.offsets.gap[i] = gap;
        to.multipliers.lambda[i] = lambda;
        to.gradient -= lambda * hinge.normal;
        to.value -= lambda * gap + 0.5 * compliance_ * change * change;
    }
    for (std::size_t j = 0; j < primitives_.tethers.size(); ++j) {
        const Tether& tether = primitives_.tethers[j];
        const Vec3 offset = from.offsets.way[j] + step * tether.across;
        Vec3 pull = anchors_.pull[j] - offset / compliance_;
        to.wish[j] = glm::length(pull);
        if (to.wish[j] > tether.bound) pull *= tether.bound / to.wish[j];
        to.offsets.way[j] = offset;
        to.multipliers.pull[j] = pull;
        to.gradient -= tether.across * pull;
        to.value -=
            glm::dot(pull, offset) + 0.5 * compliance_ * squared_length(pull - anchors_.pull[j]);
    }
}

/// Whether a hinge is at an end of the range in which it holds: its state is one or the other.
bool SmoothedProblem::is_at_end(std::size_t i) const noexcept {
    const double bound = primitives_.hinges[i].bound;
    const double wish = anchors_.lambda[i] - now_.offsets.gap[i] / compliance_;
    return std::min(std::abs(wish), std::abs(wish - bound)) <= kAtEnd * bound;
}

/// The step at which the gradient would vanish, if no primitive changed its state. The range in
/// which a hinge holds is narrow, e sigma. A step may end at the one end of it again and again, and
/// the next step at the other one: so in a long stage what is at an end holds, and the step goes
/// along it.
Vec3 SmoothedProblem::newton_step(const Vec3& gradient) const noexcept {
    const bool is_long = passes_ - stage_began_ > kLongStage;
    Hessian h;
    for (std::size_t i = 0; i < primitives_.hinges.size(); ++i)
        if (holds(primitives_.hinges[i], now_.multipliers.lambda[i]) || (is_long && is_at_end(i)))
            h.add_square(primitives_.hinges[i].normal, 1 / compliance_);
    for (std::size_t j = 0; j < primitives_.tethers.size(); ++j) {
        const Tether& tether = primitives_.tethers[j];
        const bool slips = now_.wish[j] > tether.bound;
        const double weight = (slips ? tether.bound / now_.wish[j] : 1.0) / compliance_;
        h.add_identity(weight);
        h.add_square(tether.axis, -weight);
        if (slips) h.add_square(tether.across * now_.multipliers.pull[j] / tether.bound, -weight);
    }
    return -h.solve(gradient);
}

/// Stiffens the primitives. What holds is expected to go on holding: the first step brings its
/// offset to zero.
void SmoothedProblem::begin_stage(Anchors anchors) noexcept {
    if (anchors == Anchors::move) anchors_ = now_.multipliers;
    compliance_ = std::max(compliance_ * kCompliancePerStage, kLeastCompliance);
    stage_began_ = passes_;
    Vec3 gradient = now_.gradient;
    for (std::size_t i = 0; i < primitives_.hinges.size(); ++i)
        if (holds(primitives_.hinges[i], now_.multipliers.lambda[i]))
            gradient += (now_.offsets.gap[i] / compliance_) * primitives_.hinges[i].normal;
    for (std::size_t j = 0; j < primitives_.tethers.size(); ++j) {
        const Tether& tether = primitives_.tethers[j];
        if (now_.wish[j] <= tether.bound)
            gradient += tether.across * (now_.offsets.way[j] / compliance_);
        else
            now_.wish[j] = tether.bound + glm::length(now_.offsets.way[j]) / compliance_;
    }
    evaluate(now_, newton_step(gradient), trial_);
    evaluate(now_, Vec3{0.0}, now_);
    if (trial_.value <= now_.value) std::swap(now_, trial_);
}

/// A Newton step where slopes along it are rounding. False: so is the gradient, nothing moved.
bool SmoothedProblem::take_full_step() noexcept {
    evaluate(now_, newton_step(now_.gradient), trial_);
    if (squared_length(trial_.gradient) >= squared_length(now_.gradient)) return false;
    std::swap(now_, trial_);
    return true;
}

/// A Newton step, shortened where it goes too far. False: rounding left nothing to gain.
bool SmoothedProblem::take_searched_step() noexcept {
    search_along(newton_step(now_.gradient));
    const bool gained = trial_.value < now_.value ||
                        squared_length(trial_.gradient) < squared_length(now_.gradient);
    std::swap(now_, trial_);
    return gained;
}

/// Leaves in trial_ a point of the step near the least value along it. The slope grows along
/// the step and bends where primitives change their state: first between which of these it
/// passes zero, then where.
void SmoothedProblem::search_along(const Vec3& step) noexcept {
    const auto slope_at = [&](double t) {
        evaluate(now_, t * step, trial_);
        return glm::dot(step, trial_.gradient);
    };
    const double flat = -kFlat * glm::dot(step, now_.gradient); // > 0: H is positive
    double low = 0.0;
    double high = 1.0;
    double slope_low = -flat / kFlat;
    double slope_high = slope_at(high);
    if (slope_high <= 0.0 || (slope_high <= flat && trial_.value <= now_.value)) return;
    int side = 0; // of the last secant
    const Shares bends = bends_along(step);
    std::size_t first = 0;
    std::size_t last = bends.size();
    for (int pass = 0; pass < kPassesBeyondCap; ++pass) {
        const bool between = first < last;
        const std::size_t middle = (first + last) / 2;
        const double secant = low + (high - low) * slope_low / (slope_low - slope_high);
        const double t = between ? bends[middle] : secant;
        const double slope = slope_at(t);
        if (std::abs(slope) <= flat && (slope <= 0.0 || trial_.value <= now_.value)) return;
        if (slope < 0.0) {
            low = t;
            slope_low = slope;
            first = middle + 1;
            if (side < 0) slope_high *= 0.5; // Illinois: no end may stay for ever
            side = between ? 0 : -1;
        } else {
            high = t;
            slope_high = slope;
            last = middle;
            if (side > 0) slope_low *= 0.5;
            side = between ? 0 : 1;
        }
    }
}

/// The shares in (0, 1) of a step at which a primitive changes its state, ascending.
SmoothedProblem::Shares SmoothedProblem::bends_along(const Vec3& step) const noexcept {
    Shares bends;
    const auto insert = [&](double t) {
        if (!(t > 0.0 && t < 1.0)) return;
        std::size_t k = bends.size();
        bends.push_back(t);
        for (; k > 0 && bends[k - 1] > t; --k)
            bends[k] = bends[k - 1];
        bends[k] = t;
    };
    for (std::size_t i = 0; i < primitives_.hinges.size(); ++i) {
        const double rate = glm::dot(primitives_.hinges[i].normal, step);
        if (rate == 0.0) continue;
        const double released = compliance_ * anchors_.lambda[i] - now_.offsets.gap[i];
        insert(released / rate);
        insert((released - compliance_ * primitives_.hinges[i].bound) / rate);
    }
    for (std::size_t j = 0; j < primitives_.tethers.size(); ++j) { // |from - t way| = e sigma
        const Vec3 way = step * primitives_.tethers[j].across;
        const double length2 = squared_length(way);
        if (length2 == 0.0) continue;
        const Vec3 from = compliance_ * anchors_.pull[j] - now_.offsets.way[j];
        const double radius = compliance_ * primitives_.tethers[j].bound;
        const double nearest = glm::dot(from, way) / length2;
        const double square =
            nearest * nearest - (squared_length(from) - radius * radius) / length2;
        if (square < 0.0) continue;
        insert(nearest - std::sqrt(square));
        insert(nearest + std::sqrt(square));
    }
    return bends;
}

} // namespace palpate::internal
