// SPDX-License-Identifier: Apache-2.0
// Where the proxy is to go after an evaluation, and how it gets there: along chords that every
// surface certifies, or where one surface leads it.
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include <palpate/haptics/contact/curvature_step.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

// A movement below this is rounding where friction holds (composition.md 2.2, step 2).
constexpr double kStuck = 1e-10; // m
// A blocked chord is halved down to 1/16 before it is given up (contact.md 1.2, step 7).
constexpr double kShortestShare = 1.0 / 16.0;
// After one evaluation that did not move the proxy, a new plane may help. After two in a row,
// other ways are tried (Subdivision::kTriesOfOneWay). Adaptive steps: the planes' own step, then
// out of all bands, or along the exact slopes. Shares: out of all bands, or a step with curvature,
// then along the exact slopes. After these nothing will change any more: the frame is stalled.
constexpr int kTriesBeforeSlopes = 3;
constexpr int tries_before_lift(bool seeks_balance) noexcept {
    return seeks_balance ? kTriesBeforeSlopes : kTriesBeforeSlopes - 1;
}

// To where a piece of the way leads out of a workspace, to 1e-9 of its length.
constexpr int kExitHalvings = 30;

// What an adaptive frame may leave of its way without a flag, in tolerances.
constexpr double kRestTolerances = 5.0;

// From so many evaluations on the tip of soft layers is damped no more while its steps lead on.
constexpr std::uint32_t kEvaluationsToLengthen = 8;
// Cosine of the angle between two steps that lead the same way.
constexpr double kSameWay = 0.95;

/// Where the front of a soft layer is about to let go, the tip's steps hardly become shorter, and
/// all lead the same way: to damp them is to creep. What share of a step is made then: twice the
/// last move, at most all of it. 0 where the step leads elsewhere.
double share_on(std::span<const Vec3> corners, const Vec3& step) noexcept {
    if (corners.size() < 2) return 0.0;
    const Vec3 last = corners[corners.size() - 1] - corners[corners.size() - 2];
    const double length = glm::length(last), wanted = glm::length(step);
    if (!(glm::dot(last, step) > kSameWay * length * wanted)) return 0.0;
    return std::min(1.0, 2.0 * length / wanted);
}

/// The plane of a contact, but with the exact slope of its field as normal, where that is known.
/// Planes are felt with the continuous gradient, which may lead the wrong way within a cell.
PlanePrimitive across_slope(const ContactPlane& contact, const Vec3& proxy) noexcept {
    PlanePrimitive plane = contact.plane;
    const double slope = glm::length(contact.slope);
    if (!(slope > 0.0)) return plane;
    plane.normal = -contact.slope / slope;
    plane.anchor = proxy - (contact.level_gap / slope) * plane.normal;
    return plane;
}

/// Where to lift the proxy so that it is in front of all levels, by their exact slopes. A band is
/// the layer between a level and the edge of its certificate.
std::optional<Vec3> out_of_bands(const Vec3& proxy, const ContactSet& contacts,
                                 std::span<const LoopSurface> surfaces,
                                 const FrameContext& frame) noexcept {
    PrimitiveSet planes;
    for (std::size_t c = 0; c < contacts.size(); ++c)
        if (contacts[c].surface != ContactSet::kNoSurface &&
            !surfaces[contacts[c].surface].yields())
            planes.add(across_slope(contacts[c], proxy));
    double drifted_j = 0.0; // into all of them
    for (const LoopSurface& surface : surfaces)
        if (surface.is_touched()) drifted_j += surface.drifted_j();
    const Vec3 out = solve_proxy(planes, proxy, frame.stiffness).proxy;
    return lifted(proxy, out, drifted_j, frame);
}

/// A step that is no longer than one evaluation's planes are trusted for.
Vec3 trusted(const Vec3& step, std::span<const LoopSurface> surfaces) noexcept {
    double trust_m = std::numeric_limits<double>::infinity();
    for (const LoopSurface& surface : surfaces)
        trust_m = std::min(trust_m, surface.trust_m());
    const double length = glm::length(step);
    return length > trust_m ? trust_m / length * step : step;
}

/// Where `pull` leads along all levels, by their exact slopes, as deep behind them as the proxy is.
Vec3 along_slopes(const Vec3& proxy, const Vec3& pull, const ContactSet& contacts,
                  std::span<const LoopSurface> surfaces, double stiffness) noexcept {
    PrimitiveSet planes;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        if (contacts[c].surface == ContactSet::kNoSurface || surfaces[contacts[c].surface].yields())
            continue;
        PlanePrimitive plane = across_slope(contacts[c], proxy);
        plane.anchor = proxy;
        planes.add(plane);
    }
    return proxy + trusted(solve_proxy(planes, pull, stiffness).proxy - proxy, surfaces);
}

} // namespace

// ---- where it is to go -------------------------------------------------------------------------

Subdivision::Move Subdivision::next_move(const Vec3& proxy) noexcept {
    // Where a method that counts its steps leaves the solver no time, hard planes may not hold in
    // what it gives.
    if (budget_.work_left <= 0 && solution_.status == SolveStatus::capped &&
        budget_.evaluations > 1 && !stepping_.seeks_balance()) {
        result_.flags |= kEvaluationCap;
        return {Move::Kind::none, proxy};
    }
    if (one_surface_leads())
        return {Move::Kind::slide,
                stepping_.seeks_balance() ? pull() : stepping_.share(proxy, pull())};
    if (keeps_its_place()) {
        if (stepping_.seeks_balance() && unspent_m() > kRestTolerances * stepping_.tolerance_m())
            result_.flags |= kStalled; // it rests, but not where forces balance
        stepping_.arrive();
        return {Move::Kind::none, proxy};
    }
    if (frame_.looks && budget_.evaluations == 1 && stepping_.steps_left() > 0)
        return {Move::Kind::look, proxy};
    return {Move::Kind::chord, candidate(proxy)};
}

/// The surface of the first plane, which leads where one does.
LoopSurface& Subdivision::leader() noexcept { return surfaces_[contacts_[0].surface]; }

/// Whether one surface alone holds the proxy, and can lead it.
bool Subdivision::one_surface_leads() noexcept {
    const bool others_hold = primitives_.planes().size() != contacts_.size() ||
                             primitives_.has_tethers() || !contacts_.are_of_one_surface();
    return !others_hold && !friction_.rubs(contacts_[0].surface) && leader().sliding() &&
           !needs_.layers;
}

/// Whether the proxy is where it has to be. Then it keeps its bits: while the probe is held, the
/// proxy does not change.
bool Subdivision::keeps_its_place() noexcept {
    const bool first = budget_.evaluations == 1;
    if (result_.residual_m < (friction_.holds() ? kStuck : Stepping::kNoMovement_m)) return true;
    if (first && calming_.rests(solution_.proxy)) return true;
    if (!first || (primitives_.is_free() && !layers_press_)) return false;
    return unspent_m() < stepping_.tolerance_m();
}

/// What is left of the way, m. Springs and dampers shorten every step: in the coupling's own, a
/// viscous creep is not taken for rest.
double Subdivision::unspent_m() const noexcept {
    return resistance_n_per_m() / frame_.stiffness * result_.residual_m;
}

/// What a step of the proxy meets: the coupling, springs, and the dampers of layers in this period.
double Subdivision::resistance_n_per_m() const noexcept {
    double sum = primitives_.total_stiffness(frame_.stiffness);
    for (const Layer& layer : layers_)
        if (layer.force_n > 0.0) sum += layer.softness.damping / frame_.period_s;
    return sum;
}

Vec3 Subdivision::candidate(const Vec3& proxy) noexcept {
    if (const std::optional<Vec3> nearer = restored(proxy)) return *nearer;
    // A share follows the planes. If that does not move the proxy, take a step with curvature.
    if (stepping_.seeks_balance() || path_.tries_in_vain() >= kTriesOfOneWay)
        return curved_candidate(proxy);
    if (stepping_.steps_left() == 0) return solution_.proxy;
    return stepping_.share(proxy, solution_.proxy); // (9)
}

/// Where to lift the proxy if it is so deep in the bands that no other way can be certified. In one
/// band: along the slope, nearer to the level. In several: along all planes at once, because the
/// way out of one band may lead deeper into another.
std::optional<Vec3> Subdivision::restored(const Vec3& proxy) noexcept {
    // Planes and curvature cannot lead on where the exact slopes differ too much from them. Then
    // lift the proxy out of all bands first, at whatever depth it is. Where no energy is left for
    // that, follow the slopes.
    const int tries = path_.tries_in_vain();
    if (tries == tries_before_lift(stepping_.seeks_balance()))
        if (const auto out = out_of_bands(proxy, contacts_, surfaces_, frame_)) return out;
    if (tries >= kTriesBeforeSlopes)
        return along_slopes(proxy, pull(), contacts_, surfaces_, frame_.stiffness);
    const bool only_try =
        !stepping_.seeks_balance() && stepping_.steps_left() == 0 && budget_.evaluations == 1;
    std::optional<Vec3> out_of_one;
    int deep = 0;
    for (LoopSurface& surface : surfaces_) {
        // The only try goes where the solution leads, if that leaves this surface.
        if (only_try && !surface.pushes_back()) continue;
        // Where only a part may be restored, the planes' way comes first, if there is another try.
        if (surface.is_rationed() && !path_.stands_still() && !only_try) continue;
        const std::optional<Vec3> nearer = surface.restore(proxy, frame_);
        if (nearer && ++deep == 1) out_of_one = nearer;
    }
    if (deep <= 1) return out_of_one;
    const std::optional<Vec3> out_of_all = out_of_bands(proxy, contacts_, surfaces_, frame_);
    return out_of_all ? out_of_all : out_of_one;
}

Vec3 Subdivision::curved_candidate(const Vec3& proxy) noexcept {
    if (primitives_.is_free() && !layers_press_) return solution_.proxy;
    const double stiffness = primitives_.total_stiffness(frame_.stiffness);
    double damping = stepping_.damp();
    if (shortened_m_ > 0.0) damping = 1.0; // it ends where the forces along it balance
    if (layers_press_ && budget_.evaluations > kEvaluationsToLengthen)
        damping = std::max(damping, share_on(path_.corners(), solution_.proxy - proxy));
    // A step that is corrected for the surfaces that push may lead into a surface that does not.
    // Then try the step of the planes alone: it stays in front of all of them. With layers, solve()
    // has corrected it.
    const bool as_solved =
        layers_press_ || (stepping_.seeks_balance() && path_.tries_in_vain() >= kTriesOfOneWay);
    const Vec3 step =
        as_solved ? (layers_press_ ? damping : 1.0) * (solution_.proxy - proxy)
                  : curvature_step(primitives_, contacts_, solution_, proxy, stiffness, damping);
    return proxy + trusted(step, surfaces_);
}

// ---- how it gets there -------------------------------------------------------------------------

Vec3 Subdivision::follow(const Move& move, const Vec3& proxy) noexcept {
    if (move.kind == Move::Kind::chord) return carry(proxy, move.to);
    return move.kind == Move::Kind::slide ? slide_along(proxy, move.to) : proxy;
}

/// Follows the chord as far as the certificates hold. A surface that yields in this sub-step has no
/// say.
Vec3 Subdivision::carry(const Vec3& from, const Vec3& to) noexcept {
    if (!is_a_place(to)) {
        result_.flags |= kForceNotFinite;
        return record_move(from);
    }
    // Shares of the chord. A surface that is not felt yet stops it at the exact place of contact,
    // and offers its plane at the next gathering. A surface that is felt already blocks it.
    double stopped_at = 1.0;
    double blocked_at = 1.0;
    bool bends = false; // it was stopped by an edge of the mesh that it follows, no obstacle
    FieldSurface* blocking = nullptr;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (surfaces_[i].yields()) {
            result_.open |= bit_of(i, true); // its certificate is lifted for this chord
            continue;
        }
        const Chord chord = surfaces_[i].contact().carry(from, to);
        if (chord.fraction < 1.0 && observer_) note_stop(surfaces_[i], chord, from, to);
        if (!chord.engaged) {
            if (chord.fraction < stopped_at) bends = chord.bends;
            stopped_at = std::min(stopped_at, chord.fraction);
        } else if (chord.fraction < blocked_at) {
            blocked_at = chord.fraction;
            blocking = surfaces_[i].contact().of_field();
        }
    }
    if (stopped_at >= 1.0 && blocked_at >= 1.0) return record_move(to);
    const Vec3 chord = to - from;
    if (stopped_at < blocked_at) {
        if (bends) ++budget_.bends;
        return record_move(from + stopped_at * chord);
    }

    double share = 0.5;
    while (share >= blocked_at && share > kShortestShare)
        share *= 0.5;
    if (share < blocked_at) return record_move(from + share * chord);
    const std::optional<Vec3> reached =
        blocking ? blocking->obstructed(from, to, blocked_at) : std::nullopt;
    return record_move(reached.value_or(from));
}

/// Remembers for the observer what stops a move: the shortest share, and of equals what blocks it.
void Subdivision::note_stop(const LoopSurface& surface, const Chord& chord, const Vec3& from,
                            const Vec3& to) noexcept {
    using By = SubStep::Stop::By;
    const bool nearer =
        chord.fraction < stop_.share || (chord.fraction == stop_.share && chord.engaged);
    if (!nearer) return;
    By by = chord.engaged ? By::certificate : By::contact;
    if (chord.bends) by = By::edge;
    if (chord.leashed) by = By::leash;
    stop_ = {by, static_cast<std::size_t>(&surface - surfaces_.data()), chord.fraction,
             from + chord.fraction * (to - from)};
}

/// Lets the leading surface lead the proxy towards `pull`, as far as the certificates of the other
/// surfaces hold. `pull` is the probe, shifted by the forces, or this sub-step's share of the way.
Vec3 Subdivision::slide_along(Vec3 proxy, const Vec3& pull) noexcept {
    // Each share gets one more leg, so that kMostLegs counts only the corners between.
    if (!stepping_.seeks_balance()) ++budget_.legs_left;
    if (!is_a_place(pull)) {
        result_.flags |= kForceNotFinite | kStalled;
        return proxy;
    }
    for (; budget_.legs_left > 0; --budget_.legs_left) {
        const SlideLeg leg = leader().sliding()->slide(proxy, pull);
        if (leg.end == SlideLeg::End::rests) {
            if (!is_held_anew()) stepping_.arrive();
            return proxy;
        }
        if (leg.end == SlideLeg::End::stuck) {
            result_.flags |= kStalled;
            return proxy;
        }
        Chord chord;
        for (const LoopSurface& other : surfaces_) {
            if (&other == &leader()) continue;
            const Chord theirs = other.contact().carry(proxy, leg.corner);
            if (theirs.fraction < 1.0 && observer_) note_stop(other, theirs, proxy, leg.corner);
            if (theirs.fraction < chord.fraction) chord = theirs;
        }
        if (chord.fraction < 1.0) {
            if (chord.bends) ++budget_.bends;
            return record_move(proxy + chord.fraction * (leg.corner - proxy));
        }
        proxy = record_move(leg.corner);
        // The last leg of a frame is asked for in vain: it ends the frame as any other would.
        if (leg.settles && budget_.legs_left > 1 && !needs_.everything) {
            --budget_.legs_left;
            stepping_.arrive();
            return proxy;
        }
    }
    // No legs are left. A method with shares goes on with its next share; else the frame ends here.
    if (stepping_.seeks_balance() || stepping_.steps_left() == 0) result_.flags |= kEvaluationCap;
    return proxy;
}

/// Whether the leading surface holds the proxy with other planes than it offered, all of which let
/// it go: in a frame's first evaluation a corner offers the facets that the last frame's pull was
/// behind. Then they are gathered, if an evaluation is left.
bool Subdivision::is_held_anew() const noexcept {
    return budget_.evaluations == 1 && stepping_.steps_left() > 0 &&
           result_.residual_m > stepping_.tolerance_m() &&
           std::all_of(
               solution_.planes.begin(), solution_.planes.end(),
               [](const PlaneOutcome& plane) { return plane.state == MultiplierState::released; });
}

/// Whether the frame is over without another evaluation. It is if the leading surface held the
/// proxy and still holds it, cannot yield or open, and no effect can pull elsewhere.
bool Subdivision::rests_firmly(const Vec3& proxy) noexcept {
    return stepping_.has_converged() && effects_.empty() &&
           solution_.planes[0].state == MultiplierState::active &&
           glm::length(pull() - proxy) > stepping_.tolerance_m() &&
           std::isinf(contacts_[0].plane.strength_n) && !leader().contact().membrane();
}

Vec3 Subdivision::record_move(const Vec3& proxy) noexcept {
    path_.record_move(proxy);
    if (path_.tries_in_vain() > kTriesBeforeSlopes) result_.flags |= kStalled;
    return proxy;
}

// ---- where the frame ends ----------------------------------------------------------------------

/// Where the frame ends. If the forces do not balance yet, it ends on the level, and no farther
/// away than is_astray() allows. If it began inside what effects never let the proxy leave, it ends
/// there too, as far as the surfaces let it go back.
Vec3 Subdivision::final_proxy(Vec3 proxy) noexcept {
    // A frame of one evaluation has no second try: if it did not move, it is stalled.
    if (path_.sub_steps() == 0 && path_.stands_still()) result_.flags |= kStalled;
    if (stepping_.is_unfinished() && !primitives_.is_free()) {
        if (is_astray(proxy)) proxy = settled(proxy, frame_.start);
        for (LoopSurface& surface : surfaces_)
            if (const std::optional<Vec3> level = surface.settle(proxy))
                proxy = settled(proxy, *level);
    }
    const Vec3 inside = within(proxy);
    if (inside == proxy) return proxy;
    proxy = settled(proxy, inside);
    return is_inside(proxy) ? proxy : taken_back(proxy);
}

/// Back on the frame's own way to where that led out: a surface may be in the way to any nearer
/// place, and here it has let the proxy pass. It may not again where that way led out of its band.
/// A frame that began outside ends where it is.
Vec3 Subdivision::taken_back(Vec3 proxy) noexcept {
    const std::span<const Vec3> way = path_.corners(); // room is kept, so they stay where they are
    std::size_t left = way.size() - 1;
    while (left > 0 && !is_inside(way[left]))
        --left;
    if (!is_inside(way[left])) return proxy;
    const Vec3 out = way[left + 1] - way[left];
    double inside = 0.0, outside = 1.0; // shares of that piece
    for (int i = 0; i < kExitHalvings; ++i) {
        const double middle = 0.5 * (inside + outside);
        (is_inside(way[left] + middle * out) ? inside : outside) = middle;
    }
    for (std::size_t i = way.size() - 2; i > left; --i)
        proxy = settled(proxy, way[i]);
    return settled(proxy, way[left] + inside * out);
}

/// As far on a last chord as the certificates hold.
Vec3 Subdivision::settled(const Vec3& proxy, const Vec3& to) noexcept {
    const Vec3 end = carry(proxy, to);
    if (observer_) tell({Move::Kind::settle, to}, proxy, end);
    return end;
}

/// Whether the proxy is farther from the pull than any balance can be: than the frame's start, plus
/// what may lift it from there.
bool Subdivision::is_astray(const Vec3& proxy) const noexcept {
    return glm::length(proxy - pull()) > glm::length(frame_.start - pull()) + most_lift_m();
}

/// What may lift the proxy: the longest force and all that yields, over the coupling, and one that
/// never yields, by what the start is from it. Two modes of one vector field that never slip hold
/// the proxy twice. Their lines and planes may meet far away, so of two or more nothing is known.
double Subdivision::most_lift_m() const noexcept {
    double yields_n = 0.0, hard_m = 0.0;
    int hard = 0;
    const auto count = [&](double strength_n, double away_m) {
        if (std::isfinite(strength_n)) {
            yields_n += strength_n;
        } else if (away_m > 0.0) {
            hard_m = away_m;
            ++hard;
        }
    };
    for (const PlanePrimitive& plane : primitives_.planes())
        count(plane.strength_n, glm::dot(plane.normal, plane.anchor - frame_.start));
    for (const LinePrimitive& line : primitives_.lines()) {
        const Vec3 away = frame_.start - line.anchor;
        count(line.strength_n, glm::length(away - glm::dot(away, line.axis) * line.axis));
    }
    for (const PointPrimitive& point : primitives_.points())
        count(point.strength_n, glm::length(frame_.start - point.anchor));
    const double force_n = std::max(frame_.force_limit_n, yields_n);
    return force_n / frame_.stiffness + (hard == 1 ? hard_m : 0.0);
}

/// Where a frame may end for what the effects never let the proxy leave.
Vec3 Subdivision::within(Vec3 wanted) const noexcept {
    for (const LoopEffect& effect : effects_)
        wanted = effect.within(wanted);
    return wanted;
}

bool Subdivision::is_inside(const Vec3& proxy) const noexcept { return within(proxy) == proxy; }

} // namespace palpate
