// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/softness.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

double slope_of(const Softness& softness, std::size_t knot) noexcept {
    const Softness::Knot from = knot == 0 ? Softness::Knot{} : softness.knots[knot - 1];
    const Softness::Knot& to = softness.knots[knot];
    return (to.force_n - from.force_n) / (to.press_m - from.press_m);
}

} // namespace

double Softness::steepest() const noexcept {
    double most = 0.0;
    for (std::size_t i = 0; i < count; ++i)
        most = std::max(most, slope_of(*this, i));
    return most;
}

void Softness::check(std::string_view what) const {
    const std::string name(what);
    require(name + ": damping", damping, kNotNegative);
    if (count > kCapacity)
        throw std::invalid_argument(name + ": has more than " + std::to_string(kCapacity) +
                                    " knots; give fewer");
    Knot before;
    for (std::size_t i = 0; i < count; ++i) {
        const std::string of_knot = name + ": knot " + std::to_string(i + 1) + ": ";
        require(of_knot + "press_m", knots[i].press_m, kPositive);
        require(of_knot + "force_n", knots[i].force_n, kNotNegative);
        if (!(knots[i].press_m - before.press_m >= kLeastRise_m))
            throw std::invalid_argument(of_knot +
                                        "press_m is not above the knot's before by 1 nm or "
                                        "more; give depths that rise");
        if (knots[i].force_n < before.force_n)
            throw std::invalid_argument(of_knot + "force_n is below the knot's before; give forces "
                                                  "that do not fall");
        before = knots[i];
    }
    if (count > 0 && !(before.force_n > 0.0))
        throw std::invalid_argument(name + ": no knot has a force above 0; give one");
}

PressLaw::PressLaw(const Softness& softness, double coupling) noexcept : coupling_(coupling) {
    bool softer = false;
    Point last;
    for (std::size_t i = 0; i < softness.count; ++i) {
        const Softness::Knot from = i == 0 ? Softness::Knot{} : softness.knots[i - 1];
        const Softness::Knot& to = softness.knots[i];
        const double rise_n = to.force_n - from.force_n;
        const bool is_soft = slope_of(softness, i) < coupling;
        softer = softer || is_soft;
        // What would be stiffer than the coupling does not give way: the coupling alone does.
        const double press_m = is_soft ? to.press_m - from.press_m : rise_n / coupling;
        last.press_m += press_m;
        last.force_n = to.force_n;
        if (is_soft) last.tissue_m += press_m - rise_n / coupling;
        points_[i] = last;
    }
    count_ = softer ? softness.count : 0;
}

double PressLaw::force_n(double press_m) const noexcept {
    if (is_hard()) return coupling_ * press_m;
    const std::size_t i = piece([&](const Point& end) { return press_m > end.press_m; });
    const Point begin = begin_of(i);
    return begin.force_n + (press_m - begin.press_m) * slope(press_m);
}

double PressLaw::slope(double press_m) const noexcept {
    if (is_hard()) return coupling_;
    const std::size_t i = piece([&](const Point& end) { return press_m > end.press_m; });
    const Point begin = begin_of(i);
    return (points_[i].force_n - begin.force_n) / (points_[i].press_m - begin.press_m);
}

double PressLaw::energy_j(double press_m) const noexcept {
    if (is_hard()) return 0.5 * coupling_ * press_m * press_m;
    double energy_j = 0.0;
    for (std::size_t i = 0;; ++i) {
        const Point begin = begin_of(i);
        const double way_m = points_[i].press_m - begin.press_m;
        const double slope = (points_[i].force_n - begin.force_n) / way_m; // ways are above 0
        const bool is_last = i + 1 == count_ || press_m <= points_[i].press_m;
        const double left_m = is_last ? press_m - begin.press_m : way_m;
        energy_j += left_m * (begin.force_n + 0.5 * slope * left_m);
        if (is_last) return energy_j;
    }
}

double PressLaw::ratio_within(double ratio) const noexcept {
    if (is_hard()) return 1.0;
    double steepest = 0.0; // of what is not hard it ends above 0
    for (std::size_t i = 0; i < count_; ++i) {
        const Point begin = begin_of(i);
        steepest = std::max(steepest, (points_[i].force_n - begin.force_n) /
                                          (points_[i].press_m - begin.press_m));
    }
    return std::min(ratio, coupling_ / steepest);
}

PressLaw PressLaw::scaled(double ratio) const noexcept {
    PressLaw law = *this;
    for (std::size_t i = 0; i < count_; ++i) {
        Point& point = law.points_[i];
        point.force_n *= ratio;
        point.tissue_m = std::max(0.0, point.press_m - point.force_n / coupling_);
    }
    return law;
}

double PressLaw::softest() const noexcept {
    double least = is_hard() ? coupling_ : 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
        const Point begin = begin_of(i);
        const double slope =
            (points_[i].force_n - begin.force_n) / (points_[i].press_m - begin.press_m);
        if (slope > 0.0 && (least == 0.0 || slope < least)) least = slope;
    }
    return least;
}

double PressLaw::press_m(double force_n) const noexcept {
    if (is_hard()) return force_n / coupling_;
    const std::size_t i = piece([&](const Point& end) { return force_n > end.force_n; });
    const Point begin = begin_of(i);
    const double rise_n = points_[i].force_n - begin.force_n;
    if (!(rise_n > 0.0)) return std::numeric_limits<double>::infinity();
    return begin.press_m +
           (force_n - begin.force_n) / rise_n * (points_[i].press_m - begin.press_m);
}

double PressLaw::strength_of_hard_n(double strength_n) const noexcept {
    return is_hard() || !(strength_n > 0.0) ? strength_n : coupling_ * press_m(strength_n);
}

PressLaw::Tissue PressLaw::tissue(double indentation_m) const noexcept {
    const double stiffest = kStiffest * coupling_;
    if (is_hard()) return {stiffest * indentation_m, stiffest};
    double force_n = 0.0, left_m = indentation_m;
    for (std::size_t i = 0;; ++i) {
        const Point begin = begin_of(i);
        const double rise_n = points_[i].force_n - begin.force_n;
        const double way_m = std::max(points_[i].tissue_m - begin.tissue_m, rise_n / stiffest);
        const double slope = rise_n / way_m; // ways of a law are above 0
        if (left_m <= way_m || i + 1 == count_) return {force_n + slope * left_m, slope};
        force_n += rise_n;
        left_m -= way_m;
    }
}

double PressLaw::indentation_m(double force_n) const noexcept {
    if (is_hard()) return force_n / coupling_ / kStiffest;
    const double stiffest = kStiffest * coupling_;
    double indentation_m = 0.0;
    for (std::size_t i = 0;; ++i) {
        const Point begin = begin_of(i);
        const double rise_n = points_[i].force_n - begin.force_n;
        const double way_m = std::max(points_[i].tissue_m - begin.tissue_m, rise_n / stiffest);
        const double left_n = force_n - begin.force_n;
        if (left_n <= rise_n || i + 1 == count_) {
            if (rise_n > 0.0) return indentation_m + left_n / rise_n * way_m;
            return left_n > 0.0 ? std::numeric_limits<double>::infinity() : indentation_m;
        }
        indentation_m += way_m;
    }
}

PressLaw::Balance PressLaw::damped(double press_m, double before_m, double damping,
                                   double period_s) const noexcept {
    const double viscous = damping / period_s;
    const double tissue_m = solved(press_m, before_m, viscous, coupling_).tissue_m;
    const double force_n = coupling_ * (press_m - tissue_m);
    if (force_n > 0.0) return {force_n, tissue_m};
    return {0.0, solved(press_m, before_m, viscous, 0.0).tissue_m};
}

PressLaw::Balance PressLaw::solved(double press_m, double before_m, double viscous,
                                   double spring) const noexcept {
    // What is left over at a point of the law; it rises along the law.
    const auto rest_n = [&](const Point& at) {
        return at.force_n + viscous * (at.tissue_m - before_m) - spring * (press_m - at.tissue_m);
    };
    const std::size_t i = piece([&](const Point& end) { return rest_n(end) < 0.0; });
    const Point begin = begin_of(i);
    const double at_begin_n = rest_n(begin), rise_n = rest_n(points_[i]) - at_begin_n;
    const double share = rise_n > 0.0 ? std::max(0.0, -at_begin_n / rise_n) : 0.0;
    return {begin.force_n + share * (points_[i].force_n - begin.force_n),
            begin.tissue_m + share * (points_[i].tissue_m - begin.tissue_m)};
}

} // namespace palpate
