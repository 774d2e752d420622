// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/curve_guide.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace palpate {
namespace {

constexpr int kFirstEvaluation = 2; // as counted when its solution is judged
// Below this part of a unit vector its direction is noise: the pull leads straight on beyond an
// end, or the curve straight back.
constexpr double kStraightOn = 1e-9;
// A proxy this near to a corner is at it, m.
constexpr double kAtCorner = 1e-9;

// Of places in their order along the curve, corners even and pieces odd: the next piece in either
// sense. The shift rounds down, below 0 too.
constexpr std::int64_t piece_behind(std::int64_t order) noexcept { return (order + 1) >> 1; }
constexpr std::int64_t piece_before(std::int64_t order) noexcept { return (order - 2) >> 1; }

} // namespace

void CurveGuide::restart(const Vec3&) noexcept {
    capture_.restart();
    lean_ = Vec3{0.0};
}

std::any CurveGuide::save_state() const { return State{capture_.save_state(), place_, lean_}; }

void CurveGuide::restore_state(const std::any& state) {
    const auto& from = std::any_cast<const State&>(state);
    const std::int64_t piece = from.place.piece;
    if (!curve_.exists(piece) && !(from.place.at_corner && curve_.exists(piece - 1)))
        throw std::invalid_argument("guide: the state is of one along another curve");
    capture_.restore_state(from.capture);
    place_ = from.place;
    lean_ = from.lean;
}

void CurveGuide::begin(const FrameContext& frame) noexcept {
    frame_ = frame;
    evaluations_ = 0;
    looks_ = frame.looks;
    low_.reset();
    high_.reset();
    if (!(capture_.strength_at(frame) > 0.0)) {
        capture_.let_go();
        return;
    }
    if (capture_.holds()) {
        // The proxy may have been carried elsewhere than the guide has led it.
        place_ = curve_.walk(place_, frame.start);
        capture_.begin(glm::length(frame.start - curve_.position(place_)));
        return;
    }
    const auto nearest = curve_.nearest(frame.start, capture_.reach_m());
    if (!nearest) return;
    capture_.begin(0.0);
    place_ = *nearest;
    lean_ = Vec3{0.0};
}

void CurveGuide::gather(const Vec3&, PrimitiveSet& primitives) noexcept {
    if (!capture_.holds() || !(capture_.strength_n() > 0.0)) return;
    if (std::exchange(looks_, false)) { // does it rest where it is?
        pull_ = primitives.pull(frame_.probe, frame_.stiffness);
        step_to(held_target());
    } else if (evaluations_++ == 0) {
        pull_ = primitives.pull(frame_.probe, frame_.stiffness);
        step_to(pull_ + lean_);
    } else {
        next_footing();
    }
    if (hold_ == Hold::point) {
        primitives.add_point({anchor_, capture_.strength_n()});
        return;
    }
    primitives.add_line({anchor_, axis_, capture_.strength_n()});
    if (place_.cut)
        primitives.add(
            {anchor_, (place_.along_m > 0.0 ? -1.0 : 1.0) * axis_, capture_.strength_n()});
}

/// Under a held probe, the place that the proxy is at: where it rests, nothing else need be tried.
/// Not from a corner or an end itself, whose line is across the pull.
Vec3 CurveGuide::held_target() const noexcept {
    const PolylinePlace place = curve_.walk(place_, frame_.start);
    if (!place.at_corner || glm::length(frame_.start - curve_.position(place)) > kAtCorner)
        return frame_.start;
    return pull_ + lean_;
}

/// Where the way along the curve towards a point ends.
void CurveGuide::step_to(const Vec3& target) noexcept {
    const PolylinePlace place = curve_.walk(place_, target);
    if (!place.at_corner) {
        step_on(place);
        return;
    }
    if (!curve_.exists(place.piece) || !curve_.exists(place.piece - 1)) {
        step_on_end(place, target);
        return;
    }
    // Between the directions of both pieces, across the pull: it leads on from the first, back from
    // the second.
    const Vec3 way = target - curve_.position(place);
    const Vec3& before = curve_.direction(place.piece - 1);
    const Vec3& behind = curve_.direction(place.piece);
    step_on_corner(place.piece, glm::dot(way, before) * behind - glm::dot(way, behind) * before);
}

void CurveGuide::step_on(const PolylinePlace& place) noexcept {
    place_ = place;
    anchor_ = curve_.position(place);
    axis_ = curve_.direction(place.piece);
    hold_ = Hold::line;
}

/// `axis` of any length; where it has none, that of a piece will do.
void CurveGuide::step_on_corner(std::int64_t corner, const Vec3& axis) noexcept {
    place_ = {corner, 0.0, true, false};
    // Where the curve goes straight back, no direction is across the pull: it is held as at an end.
    if (glm::length(curve_.direction(corner - 1) + curve_.direction(corner)) < kStraightOn)
        return step_on_tip(place_);
    anchor_ = curve_.position(place_);
    const double length = glm::length(axis);
    axis_ = length > 0.0 ? axis / length : curve_.direction(corner);
    hold_ = Hold::line;
}

std::int64_t CurveGuide::piece_at_end(std::int64_t corner) const noexcept {
    return curve_.exists(corner) ? corner : corner - 1;
}

/// An open end that the pull leads beyond: a line across the pull, as at a corner.
void CurveGuide::step_on_end(const PolylinePlace& end, const Vec3& target) noexcept {
    place_ = end;
    anchor_ = curve_.position(end);
    const Vec3 direction = curve_.direction(piece_at_end(end.piece));
    const Vec3 way = target - anchor_;
    const double length = glm::length(way);
    hold_ = Hold::point;
    axis_ = Vec3{0.0};
    if (!(length > 0.0)) return;
    const Vec3 across = direction - glm::dot(direction, way / length) * (way / length);
    const double part = glm::length(across);
    if (part < kStraightOn) return;
    axis_ = across / part;
    hold_ = Hold::line;
}

/// How far beyond its place the last solution went along the curve, m; 0: the place is right.
double CurveGuide::asked() const noexcept {
    const double along = glm::dot(end_ - anchor_, axis_);
    if (!place_.at_corner) return curve_.beyond(place_.piece, place_.along_m + along);
    return std::abs(along) > Polyline::kOnPiece ? along : 0.0;
}

/// Where the solutions so far lead. The answer is kept between two tries of which one asked to go
/// on and one to go back; by and by they come to a piece, or to a corner between two.
void CurveGuide::next_footing() noexcept {
    if (place_.cut) return; // beyond it nothing is known: the next frame goes on
    if (hold_ == Hold::point) {
        leave_end();
        return;
    }
    const double asked_m = asked();
    if (asked_m == 0.0) return;
    if (place_.at_corner && !(curve_.exists(place_.piece) && curve_.exists(place_.piece - 1))) {
        const std::int64_t piece = piece_at_end(place_.piece);
        step_on({piece, curve_.exists(place_.piece) ? 0.0 : curve_.length_m(piece), false, false});
        return;
    }
    const int sense = asked_m > 0.0 ? 1 : -1;
    (sense > 0 ? low_ : high_) = Try{place_.order(), axis_, asked_m, evaluations_};
    const PolylinePlace foot = further(sense);
    std::optional<Try>& bound = sense > 0 ? high_ : low_;
    if (bound && sense * (bound->order - foot.order()) <= 0) {
        // Two tries in a row are of one mind about where the surfaces are; an older one is not, and
        // the first is of where they were before the proxy moved.
        if (bound->evaluation == evaluations_ - 1 && bound->evaluation > kFirstEvaluation) {
            step_between();
            return;
        }
        bound.reset();
    }
    if (foot.at_corner) {
        step_on_tip(foot);
    } else {
        step_on(foot);
    }
}

/// Where the solution leads from the place it was found for, in a sense: a piece, the next at
/// least, or an open end that has none behind it.
PolylinePlace CurveGuide::further(int sense) const noexcept {
    const std::int64_t order = place_.order();
    const std::int64_t next = sense > 0 ? piece_behind(order) : piece_before(order);
    if (!curve_.exists(next)) return {sense > 0 ? next : 0, 0.0, true, false};
    const PolylinePlace foot = curve_.walk({next, 0.0, false, false}, end_);
    if (sense * (foot.order() - order) <= 0) return curve_.middle(next);
    if (!foot.at_corner) return foot;
    // Whether it stays at a corner, only the pieces on both sides can tell: that behind it first.
    const std::int64_t behind = sense > 0 ? foot.piece : foot.piece - 1;
    return curve_.middle(curve_.exists(behind) ? behind : behind - sense);
}

void CurveGuide::step_on_tip(const PolylinePlace& end) noexcept {
    place_ = end;
    anchor_ = curve_.position(end);
    axis_ = Vec3{0.0};
    hold_ = Hold::point;
}

/// Between a try that asked to go on and one that asked to go back: a piece where there is one,
/// else the corner, with the axis at which nothing more would be asked for, were both exact.
void CurveGuide::step_between() noexcept {
    const double share = low_->asked_m / (low_->asked_m - high_->asked_m); // > 0 - < 0
    const std::int64_t first = piece_behind(low_->order);
    const std::int64_t last = piece_before(high_->order);
    if (first > last) {
        step_on_corner(first, low_->asked_m * high_->axis - high_->asked_m * low_->axis);
        return;
    }
    const double pieces = share * static_cast<double>(last - first + 1);
    step_on(curve_.middle(std::clamp(first + static_cast<std::int64_t>(pieces), first, last)));
}

/// The proxy has slipped off an end, or a turn straight back; whether that leads back along the
/// curve.
void CurveGuide::leave_end() noexcept {
    const std::int64_t piece = piece_at_end(place_.piece);
    const bool at_begin = curve_.exists(place_.piece);
    const double outwards =
        (at_begin ? -1.0 : 1.0) * glm::dot(end_ - anchor_, curve_.direction(piece));
    if (!(outwards < -Polyline::kOnPiece)) return;
    low_.reset();
    high_.reset();
    step_on({piece, at_begin ? 0.0 : curve_.length_m(piece), false, false});
}

void CurveGuide::commit(const FrameOutcome& outcome) noexcept {
    if (evaluations_ == 0 || !capture_.holds()) return;
    // The next frame begins where this one's pull along the curve vanished: a held probe finds the
    // same line. At rest nothing is to be learnt from a first evaluation.
    if (!(frame_.held && outcome.proxy == frame_.start))
        lean_ = place_.cut ? Vec3{0.0} : glm::dot(end_ - pull_, axis_) * axis_;
    place_.piece = curve_.first_round(place_.piece);
    place_.cut = false;
}

} // namespace palpate
