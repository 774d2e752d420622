// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/subdivision.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include <palpate/geometry/range.h>
#include <palpate/haptics/curvature_step.h>
#include <palpate/haptics/frame_flags.h>

namespace palpate {
namespace {

// A movement below this is rounding: the proxy keeps its bits (numerics 5, case 17).
constexpr double kNoMovement = 1e-13; // m
// A movement below this is rounding where friction holds (composition.md 2.2, step 2).
constexpr double kStuck = 1e-10; // m
// Within this many tolerances the residual is trusted to go on falling as it did; further out, data
// have kinks.
constexpr double kNearTolerances = 5.0;
// Damping of tangential steps while the residual does not fall (contact.md 1.2, step 5).
constexpr double kResidualMustFallTo = 0.9;
constexpr double kStrongestDamping = 1.0 / 16.0;
// Of a surface that yields only the normal is trusted, not where its level is: for longer steps.
constexpr double kYieldingTrust = 4.0;
// Edges that a frame goes over beyond its cap: as many as a stroke of 5 m/s crosses on two meshes
// of 330 000 facets.
constexpr int kMostBends = 64;

/// One part of the finish of each surface.
template <class Part>
std::vector<Part> of_each(Part SurfaceFinish::*part, std::span<const SurfaceFinish> finish,
                          std::size_t surfaces) {
    std::vector<Part> parts(surfaces);
    for (std::size_t i = 0; i < std::min(surfaces, finish.size()); ++i)
        parts[i] = finish[i].*part;
    return parts;
}

/// A contact's plane across the exact slope of its field at the proxy, where that is known: the
/// continuous gradient, across which planes are felt, may lead the wrong way within a cell.
PlanePrimitive across_slope(const ContactPlane& contact, const Vec3& proxy) noexcept {
    PlanePrimitive plane = contact.plane;
    const double slope = glm::length(contact.slope);
    if (!(slope > 0.0)) return plane;
    plane.normal = -contact.slope / slope;
    plane.anchor = proxy - (contact.level_gap / slope) * plane.normal;
    return plane;
}

} // namespace

Subdivision::Subdivision(const SteppingSettings& settings, std::vector<SurfaceContact*> surfaces,
                         std::vector<Effect*> effects, Clock& clock,
                         std::vector<SurfaceFinish> finish)
    : settings_(settings), surfaces_(std::move(surfaces)), effects_(std::move(effects)),
      clock_(clock), estimator_(settings.budget_us),
      friction_(of_each(&SurfaceFinish::friction, finish, surfaces_.size())),
      magnets_(of_each(&SurfaceFinish::magnet, finish, surfaces_.size())), banks_(surfaces_.size()),
      settling_(settings.tolerance_m), surface_gains_(surfaces_.size()),
      friction_gains_(surfaces_.size()), magnet_gains_(surfaces_.size()),
      texture_gains_(surfaces_.size()), effect_gains_(effects_.size()),
      first_contact_(surfaces_.size() + 1, 0), sunk_m_(surfaces_.size(), 0.0) {
    for (const StrengthOverField& over :
         of_each(&SurfaceFinish::strength, finish, surfaces_.size()))
        strengths_.push_back(LocalStrength::holding(0.0, over));
    const auto in_range = [](int n) { return n >= 1 && n <= kMostEvaluations; };
    if (!in_range(settings.sub_steps) || !in_range(settings.evaluation_cap))
        throw std::invalid_argument(
            "subdivision: sub_steps = " + std::to_string(settings.sub_steps) +
            " or evaluation_cap = " + std::to_string(settings.evaluation_cap) +
            " is out of range; give integers in [1, 4096]");
    require("subdivision: tolerance_m", settings.tolerance_m, kPositive);
    // Every membrane that opens and every surface that begins to slide begins the frame anew.
    const std::size_t evaluations = kMostEvaluations + kMostBends + 2 * surfaces_.size() + 1;
    path_.reserve(2 * evaluations + kMostLegs);
    steps_left_.reserve(evaluations);
}

QueryCount Subdivision::queries() const noexcept {
    QueryCount count;
    count.field_samples = magnets_.samples();
    for (const LocalStrength& strength : strengths_)
        count.field_samples += strength.samples();
    return count;
}

double Subdivision::estimate_us() const noexcept {
    return settings_.method == SteppingMethod::paper ? estimator_.estimate_us() : 0.0;
}

std::uint32_t Subdivision::restart(const Vec3& proxy) noexcept {
    std::uint32_t flags = 0;
    for (SurfaceContact* surface : surfaces_)
        if (surface->restart(proxy)) flags |= kInsideAtStart;
    for (LevelBank& bank : banks_)
        bank.clear();
    for (LocalStrength& strength : strengths_)
        strength.restart();
    friction_.restart();
    magnets_.restart();
    settling_.restart();
    primitives_.clear();
    for (Effect* effect : effects_)
        effect->restart(proxy);
    for (std::vector<GainRamp>* gains :
         {&surface_gains_, &friction_gains_, &magnet_gains_, &texture_gains_, &effect_gains_})
        for (GainRamp& gain : *gains)
            gain.jump();
    path_.clear();
    return flags;
}

SubdivisionResult Subdivision::advance(const FrameContext& frame) noexcept {
    frame_ = frame;
    replayed_ = {};
    return run();
}

SubdivisionResult Subdivision::advance(const FrameContext& frame,
                                       std::span<const std::uint32_t> steps_left) noexcept {
    frame_ = frame;
    replayed_ = steps_left;
    return run();
}

SubdivisionResult Subdivision::run() noexcept {
    SubdivisionResult result;
    Vec3 proxy = frame_.start;
    path_.clear();
    path_.push_back(proxy);
    steps_left_.clear();
    begins_ = true;
    bends_ = 0;
    legs_left_ = kMostLegs;
    work_left_ = all_work();
    if (settings_.method == SteppingMethod::paper) began_us_ = last_us_ = clock_.now_us();
    begin(result);
    note_open(result);

    do
        proxy = relaxed(proxy, result);
    while (membrane_opens(result) || breaks_away(result));
    // A frame of one evaluation has no second one to find that out in.
    if (result.sub_steps == 0 && unmoved_ > 0) result.flags |= kStalled;
    proxy = settled(proxy, result);
    if (const Vec3 inside = within(proxy); inside != proxy) proxy = carried(proxy, inside, result);
    commit(proxy, result);
    return result;
}

/// Whether frames may contradict each other under a held probe. Surfaces alone do not, where each
/// frame is solved to its end.
bool Subdivision::may_bend() const noexcept {
    return settings_.method != SteppingMethod::adaptive || !effects_.empty() ||
           std::any_of(strengths_.begin(), strengths_.end(),
                       [](const LocalStrength& strength) { return strength.depends_on_place(); });
}

/// Gains take their step; what is on anchors what depends on the path.
void Subdivision::begin(SubdivisionResult& result) noexcept {
    bool all_one = true;
    bool any_moves = false; // then a held probe is drawn elsewhere in each frame
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        GainRamp& gain = surface_gains_[i];
        const bool moves = gain.advance(frame_.period_s);
        any_moves = any_moves || moves;
        if (moves || strengths_[i].depends_on_place()) {
            Gain now = gain.gain(frame_.force_limit_n);
            if (strengths_[i].depends_on_place()) now.place_n = strengths_[i].at(frame_);
            surfaces_[i]->set_gain(now);
        }
        GainRamp& friction_gain = friction_gains_[i];
        if (friction_gain.advance(frame_.period_s)) {
            friction_.set_gain(i, friction_gain.value());
            any_moves = true;
        }
        GainRamp& magnet_gain = magnet_gains_[i];
        if (magnet_gain.advance(frame_.period_s)) {
            magnets_.set_gain(i, magnet_gain.value());
            any_moves = true;
        }
        GainRamp& texture_gain = texture_gains_[i];
        if (texture_gain.advance(frame_.period_s)) {
            surfaces_[i]->set_texture_gain(texture_gain.value());
            any_moves = true;
        }
        all_one = all_one && gain.value() == 1.0 && friction_gain.value() == 1.0 &&
                  magnet_gain.value() == 1.0 && texture_gain.value() == 1.0;
    }
    for (std::size_t i = 0; i < effects_.size(); ++i) {
        const bool was_on = is_on(i);
        any_moves = effect_gains_[i].advance(frame_.period_s) || any_moves;
        all_one = all_one && effect_gains_[i].value() == 1.0;
        if (is_on(i) && !was_on) effects_[i]->restart(frame_.start);
    }
    if (any_moves) settling_.restart();
    // What pushes unasked and moves by itself, as a pulse or a beating vessel, is felt as it is: a
    // proxy that goes with it is not to be calmed.
    bool is_driven = false;
    for (std::size_t i = 0; i < effects_.size(); ++i)
        is_driven = is_driven ||
                    (is_on(i) && effects_[i]->is_active() && effects_[i]->unasked_force_n() > 0.0);
    if (is_driven) settling_.restart();
    settling_n_per_m_ = !is_driven && may_bend() ? settling_.begin(frame_) : 0.0;
    frame_.held = settling_.held();
    frame_.looks = frame_.held && settings_.method == SteppingMethod::adaptive && !effects_.empty();
    frame_.rests = settling_.stopped();
    if (settling_n_per_m_ > 0.0) result.flags |= kCalmed;
    for (std::size_t i = 0; i < effects_.size(); ++i)
        if (is_on(i)) effects_[i]->begin(frame_);
    friction_.begin();
    magnets_.begin(frame_);
    if (!all_one) result.flags |= kLiveGain;
}

/// Sub-step by sub-step to where the forces balance, or as far as the frame allows.
Vec3 Subdivision::relaxed(Vec3 proxy, SubdivisionResult& result) noexcept {
    damping_ = 1.0;
    last_residual_m_ = std::numeric_limits<double>::infinity();
    converged_ = false;
    unmoved_ = 0;
    for (;;) {
        gather(proxy);                                                   // (6)
        solve(proxy, result);                                            // (7)
        const std::uint32_t steps_left = steps_still_affordable(result); // (8), (10)
        if (SurfaceContact* surface = leading_surface()) {
            const Vec3 reached = led(*surface, proxy, steps_left, result); // (9)
            const bool moved = reached != proxy;
            proxy = reached;
            if (result.flags & (kStalled | kEvaluationCap)) break;
            if (steps_left > 0 && rests_firmly(*surface, proxy)) {
                result.residual_m = 0.0; // nothing is left of the way
                break;
            }
            // Where another surface stopped it at once, that one has planes the next time.
            const bool at_rest = converged_ && !moved;
            if (steps_left > 0 && !(at_rest && settings_.method == SteppingMethod::adaptive))
                continue;
            if (settings_.method == SteppingMethod::adaptive && !converged_)
                result.flags |= kEvaluationCap;
            break;
        }
        if (keeps_its_place(result)) {
            converged_ = true;
            break;
        }
        if (frame_.looks && result.evaluations == 1 && steps_left > 0) continue;
        const Vec3 wanted = candidate(proxy, steps_left, result.residual_m); // (9)
        proxy = carried(proxy, wanted, result);
        const bool arrived = primitives_.is_free() && proxy == solution_.proxy;
        if (arrived || (result.flags & kStalled)) break;
        if (proxy != wanted) converged_ = false; // a step cut short was not the last
        if (steps_left > 0 || (!converged_ && evaluations_left(result) > 0)) continue;
        if (settings_.method == SteppingMethod::adaptive && !converged_)
            result.flags |= kEvaluationCap;
        break;
    }
    return proxy;
}

/// Whether the balance presses a membrane above its strength: it opens, and the frame goes on
/// without it.
bool Subdivision::membrane_opens(SubdivisionResult& result) noexcept {
    if (result.flags & (kStalled | kEvaluationCap)) return false;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const double strength_n = surfaces_[i]->opens_above_n();
        if (std::isinf(strength_n) || surfaces_[i]->state() == SurfaceState::inside) continue;
        Vec3 pressing_n{0.0};
        for (std::size_t c = first_contact_[i]; c < first_contact_[i + 1]; ++c)
            pressing_n += solution_.planes[c].multiplier_n * contacts_[c].plane.normal;
        if (!(glm::length(pressing_n) >= strength_n)) continue;
        surfaces_[i]->open();
        note_open(result);
        return true;
    }
    return false;
}

/// Whether what friction held has begun to slide: the frame goes on with less of it.
bool Subdivision::breaks_away(const SubdivisionResult& result) noexcept {
    return !(result.flags & (kStalled | kEvaluationCap)) && friction_.breaks_away();
}

void Subdivision::note_open(SubdivisionResult& result) const noexcept {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const SurfaceState state = surfaces_[i]->state();
        result.open |= bit_of(i, state == SurfaceState::inside || state == SurfaceState::yielded);
    }
}

void Subdivision::gather(const Vec3& proxy) noexcept {
    magnets_.find(proxy, pull(), surfaces_);
    contacts_.clear();
    primitives_.clear();
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        first_contact_[i] = contacts_.size();
        surfaces_[i]->offer(proxy, contacts_);
    }
    first_contact_.back() = contacts_.size();
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (begins_) sunk_m_[i] = depth_not_to_restore(i, proxy);
        for (std::size_t c = first_contact_[i]; sunk_m_[i] > 0.0 && c < first_contact_[i + 1]; ++c)
            contacts_.sink(c, sunk_m_[i]);
    }
    begins_ = false;
    magnets_.gather(contacts_);
    for (std::size_t i = 0; i < contacts_.size(); ++i)
        primitives_.add(contacts_[i].plane);
    if (settling_n_per_m_ > 0.0) primitives_.add_spring(frame_.start, settling_n_per_m_);
    for (std::size_t i = 0; i < effects_.size(); ++i) {
        if (!is_on(i)) continue;
        primitives_.set_gain(effect_gains_[i].gain(frame_.force_limit_n));
        effects_[i]->gather(proxy, primitives_);
    }
    primitives_.set_gain({});
    friction_.gather(proxy, contacts_, first_contact_, primitives_);
}

/// How much of its depth below a surface's level the proxy has to keep in this frame, m: to lift it
/// that far would give the hand more than its drift has taken.
double Subdivision::depth_not_to_restore(std::size_t surface, const Vec3& proxy) noexcept {
    const std::size_t first = first_contact_[surface];
    if (first == first_contact_[surface + 1]) {
        banks_[surface].clear();
        return 0.0;
    }
    double depth_m = -std::numeric_limits<double>::infinity();
    Vec3 normal{0.0};
    for (std::size_t c = first; c < first_contact_[surface + 1]; ++c) {
        const PlanePrimitive& plane = contacts_[c].plane;
        const double depth_of_plane_m = glm::dot(plane.normal, plane.anchor - proxy);
        if (depth_of_plane_m <= depth_m) continue;
        depth_m = depth_of_plane_m;
        normal = plane.normal;
    }
    const double lift_m =
        banks_[surface].lift(depth_m, normal, proxy - frame_.probe, frame_.stiffness);
    return std::max(0.0, depth_m - lift_m);
}

void Subdivision::solve(const Vec3& proxy, SubdivisionResult& result) noexcept {
    work_left_ -= kWorkOfEvaluation;
    solution_ = friction_.solve(primitives_, frame_.probe, frame_.stiffness, work_left_);
    if (!is_a_place(solution_.proxy)) {
        solution_.proxy = proxy;
        result.flags |= kForceNotFinite;
    }
    for (std::size_t i = 0; i < effects_.size(); ++i)
        if (is_on(i)) effects_[i]->solved(solution_.proxy);
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
        surfaces_[i]->keep_active(solution_, first_contact_[i]);
    result.residual_m = glm::length(solution_.proxy - proxy);
    ++result.evaluations;
    if (solution_.status == SolveStatus::capped) result.flags |= kSolverCap;
    if (contacts_.overflowed() || primitives_.overflowed()) result.flags |= kPrimitivesFull;
    if (!primitives_.all_finite()) result.flags |= kForceNotFinite;
}

/// N_steps of eq. (8): how many more evaluations this frame has, after the one just made.
std::uint32_t Subdivision::steps_still_affordable(const SubdivisionResult& result) noexcept {
    const int made = static_cast<int>(result.evaluations);
    int left = 0;
    switch (settings_.method) {
    case SteppingMethod::single:
        break;
    case SteppingMethod::fixed:
        left = settings_.sub_steps - made;
        break;
    case SteppingMethod::adaptive: {
        // Newton steps square what is left, so to expect the last ratio once more is to expect too
        // much. Flat planes are met at once, but the next may be other ones: there nothing is
        // expected.
        const double ratio = std::min(1.0, result.residual_m / last_residual_m_);
        const bool near = std::isfinite(last_residual_m_) &&
                          result.residual_m < kNearTolerances * settings_.tolerance_m;
        const double expected_m = near ? ratio * result.residual_m : result.residual_m;
        converged_ = expected_m < (all_flat() ? kNoMovement : settings_.tolerance_m);
        left = converged_ ? 0 : evaluations_left(result);
        break;
    }
    case SteppingMethod::paper: {
        if (!replayed_.empty()) {
            const std::size_t index = result.evaluations - 1;
            left = index < replayed_.size() ? static_cast<int>(replayed_[index]) : 0;
            break;
        }
        const double now_us = clock_.now_us(); // t_n
        estimator_.observe(now_us - last_us_); // (10)
        last_us_ = now_us;
        const double affordable =
            (settings_.budget_us - (now_us - began_us_)) / estimator_.estimate_us();
        left = static_cast<int>(std::clamp(std::floor(affordable), 0.0, 1.0 * kMostEvaluations));
        break;
    }
    }
    const int bounded = std::clamp(left, 0, std::max(0, kMostEvaluations - made));
    steps_left_.push_back(static_cast<std::uint32_t>(bounded));
    return static_cast<std::uint32_t>(bounded);
}

/// Whether there are planes, and all of them facets.
bool Subdivision::all_flat() const noexcept {
    for (std::size_t i = 0; i < contacts_.size(); ++i)
        if (contacts_[i].slope != Vec3{0.0}) return false;
    return contacts_.size() > 0;
}

/// Of a frame, by the evaluations that its method may make.
int Subdivision::all_work() const noexcept {
    int evaluations = 1;
    switch (settings_.method) {
    case SteppingMethod::single:
        break;
    case SteppingMethod::fixed:
        evaluations = settings_.sub_steps;
        break;
    case SteppingMethod::adaptive:
        evaluations = settings_.evaluation_cap;
        break;
    case SteppingMethod::paper:
        evaluations = kMostEvaluations;
        break;
    }
    return kWorkOfSolvers + 3 * kWorkOfEvaluation * evaluations;
}

/// Of an adaptive frame; none otherwise.
int Subdivision::evaluations_left(const SubdivisionResult& result) const noexcept {
    if (settings_.method != SteppingMethod::adaptive || work_left_ <= 0) return 0;
    return settings_.evaluation_cap + std::min(bends_, kMostBends) -
           static_cast<int>(result.evaluations);
}

/// Whether the proxy is where it has to be: then it keeps its bits, so that a held probe means a
/// held proxy.
bool Subdivision::keeps_its_place(const SubdivisionResult& result) noexcept {
    if (result.residual_m < (friction_.holds() ? kStuck : kNoMovement)) return true;
    if (result.evaluations == 1 && settling_.rests(solution_.proxy)) return true;
    // Springs shorten every step: in the coupling's own, a viscous creep is not taken for rest.
    const double unspent_m =
        primitives_.total_stiffness(frame_.stiffness) / frame_.stiffness * result.residual_m;
    return settings_.method == SteppingMethod::adaptive && result.evaluations == 1 &&
           !primitives_.is_free() && unspent_m < settings_.tolerance_m;
}

Vec3 Subdivision::candidate(const Vec3& proxy, std::uint32_t steps_left,
                            double residual_m) noexcept {
    const bool only_one = settings_.method != SteppingMethod::adaptive && steps_left == 0 &&
                          steps_left_.size() == 1; // evaluation of the frame
    if (const std::optional<Vec3> nearer = restored(proxy, only_one)) return *nearer;
    if (settings_.method == SteppingMethod::adaptive) return curved_candidate(proxy, residual_m);
    if (steps_left == 0) return solution_.proxy;
    return proxy + (solution_.proxy - proxy) / (steps_left + 1.0); // eq. (9)
}

/// Where the proxy may be lifted to, if it is so deep in the bands of certificates that no other
/// way can be certified: nearer to one level along its slope; out of several bands at once along
/// all planes, as the way out of one may lead deeper into another.
std::optional<Vec3> Subdivision::restored(const Vec3& proxy, bool only_try) const noexcept {
    std::optional<Vec3> out_of_one;
    int deep = 0;
    double energy_j = 0.0; // that the drift into all of them has taken
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (any_state(i, MultiplierState::saturated)) continue;
        // Where only a part may be restored, the planes' way comes first, if there is another try.
        if (sunk_m_[i] > 0.0 && unmoved_ == 0 && !only_try) continue;
        const std::optional<Vec3> nearer = surfaces_[i]->restore(proxy);
        if (!nearer) continue;
        const double share =
            sunk_m_[i] > 0.0 ? lift_share(banks_[i].energy_j(), proxy, *nearer) : 1.0;
        const Vec3 lift = share * (*nearer - proxy);
        if (share < 1.0 && !(glm::length(lift) > kStuck)) continue;
        if (++deep == 1) out_of_one = share < 1.0 ? proxy + lift : *nearer;
        energy_j += banks_[i].energy_j();
    }
    if (deep <= 1) return out_of_one;
    PrimitiveSet planes;
    for (std::size_t c = 0; c < first_contact_.back(); ++c)
        planes.add(across_slope(contacts_[c], proxy));
    const Vec3 out = solve_proxy(planes, proxy, frame_.stiffness).proxy;
    const Vec3 lift = lift_share(energy_j, proxy, out) * (out - proxy);
    return glm::length(lift) > kStuck ? std::optional(proxy + lift) : out_of_one;
}

/// How much of the way from a proxy to a point farther from the probe leaves the coupling no more
/// energy than it had at the frame's start, but for what drift has taken, J.
double Subdivision::lift_share(double drifted_j, const Vec3& proxy, const Vec3& to) const noexcept {
    const Vec3 ahead = proxy - frame_.probe, way = to - proxy;
    const double free_m2 = squared_length(frame_.start - frame_.probe) +
                           2.0 * drifted_j / frame_.stiffness - squared_length(ahead);
    const double length_m2 = squared_length(way), along_m2 = glm::dot(ahead, way);
    if (!(free_m2 > 0.0) || !(length_m2 > 0.0)) return 0.0;
    const double root = std::sqrt(along_m2 * along_m2 + length_m2 * free_m2);
    return std::clamp((root - along_m2) / length_m2, 0.0, 1.0);
}

Vec3 Subdivision::curved_candidate(const Vec3& proxy, double residual_m) noexcept {
    if (primitives_.is_free()) return solution_.proxy;
    damping_ = residual_m > kResidualMustFallTo * last_residual_m_
                   ? std::max(0.5 * damping_, kStrongestDamping)
                   : std::min(2.0 * damping_, 1.0);
    last_residual_m_ = residual_m;
    const double stiffness = primitives_.total_stiffness(frame_.stiffness);
    // Bent by the surfaces that push, a step may lead into one that does not; twice in vain, the
    // planes' own way, which keeps in front of all, is tried.
    Vec3 step = unmoved_ >= kTriesToMove - 1
                    ? solution_.proxy - proxy
                    : curvature_step(primitives_, contacts_, solution_, proxy, stiffness, damping_);

    double trust_m = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (first_contact_[i] == first_contact_[i + 1] && !magnets_.holds(i)) continue;
        const bool yields = any_state(i, MultiplierState::saturated);
        trust_m = std::min(trust_m, (yields ? kYieldingTrust : 1.0) * surfaces_[i]->trust_m());
    }
    const double length = glm::length(step);
    if (length > trust_m) step *= trust_m / length;
    return proxy + step;
}

/// Where a frame may end for what the effects never let the proxy leave.
Vec3 Subdivision::within(Vec3 wanted) const noexcept {
    for (std::size_t i = 0; i < effects_.size(); ++i)
        if (is_on(i)) wanted = effects_[i]->within(wanted);
    return wanted;
}

void Subdivision::commit(const Vec3& proxy, SubdivisionResult& result) noexcept {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const bool yielded = any_state(i, MultiplierState::saturated);
        const bool felt = yielded || any_state(i, MultiplierState::active);
        result.felt |= bit_of(i, felt);
        surfaces_[i]->commit(proxy, yielded, felt);
        banks_[i].end(proxy - frame_.probe);
        if (yielded) banks_[i].level_moved();
        result.guarded |= bit_of(i, surfaces_[i]->guarded());
    }
    note_open(result);
    friction_.commit();
    settling_.end(proxy, (primitives_.total_stiffness(frame_.stiffness) - settling_n_per_m_) /
                             frame_.stiffness);
    for (std::size_t i = 0; i < effects_.size(); ++i)
        if (is_on(i)) effects_[i]->commit({proxy, result.felt});
    for (std::size_t i = 0; i < primitives_.planes().size(); ++i)
        if (solution_.planes[i].state != MultiplierState::released) ++result.contacts;
    const std::size_t lines = primitives_.lines().size() - friction_.lines();
    for (std::size_t i = 0; i < lines; ++i)
        if (squared_length(solution_.lines[i].force_n) > 0.0) ++result.contacts;
    for (std::size_t i = 0; i < primitives_.points().size(); ++i)
        if (squared_length(solution_.points[i].force_n) > 0.0) ++result.contacts;
    result.proxy = proxy;
    result.work = static_cast<std::uint32_t>(all_work() - work_left_);
}

Vec3 Subdivision::with_device_forces(Vec3 force_n) const noexcept {
    for (std::size_t i = 0; i < effects_.size(); ++i)
        if (is_on(i)) force_n += effect_gains_[i].value() * effects_[i]->device_force_n();
    return force_n;
}

double Subdivision::unasked_force_n(double most_n) const noexcept {
    double sum_n = 0.0;
    for (std::size_t i = 0; i < effects_.size(); ++i) {
        const double own_n = effect_gains_[i].value() * effects_[i]->unasked_force_n();
        if (own_n > 0.0) sum_n += std::min(own_n, most_n); // what is no number is none
    }
    return sum_n;
}

bool Subdivision::is_active() const noexcept {
    for (std::size_t i = 0; i < effects_.size(); ++i)
        if (is_on(i) && effects_[i]->is_active()) return true;
    return magnets_.any_is_on();
}

bool Subdivision::any_state(std::size_t surface, MultiplierState state) const noexcept {
    for (std::size_t i = first_contact_[surface]; i < first_contact_[surface + 1]; ++i)
        if (solution_.planes[i].state == state) return true;
    return false;
}

} // namespace palpate
