// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <palpate/haptics/contact/no_contact.h>
#include <palpate/haptics/solver/internal/one_plane.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

// A surface that yields is drawn with its strength, but for rounding.
constexpr double kRounding = 1e-9;

// Room for the evaluations of one frame. Each membrane that opens, and each surface whose friction
// begins to slip, starts one more approach.
std::size_t room_for_evaluations(std::size_t surfaces) {
    return Stepping::kMostEvaluations + Stepping::kMostBends + 2 * surfaces + 1;
}

std::vector<FrictionCoefficients> frictions(std::span<const SurfaceFinish> finish,
                                            std::size_t surfaces) {
    std::vector<FrictionCoefficients> frictions(surfaces);
    for (std::size_t i = 0; i < std::min(surfaces, finish.size()); ++i)
        frictions[i] = finish[i].friction;
    return frictions;
}

} // namespace

Subdivision::Subdivision(const SteppingSettings& settings, std::vector<SurfaceContact*> surfaces,
                         const std::vector<Effect*>& effects, Clock& clock,
                         std::vector<SurfaceFinish> finish)
    : stepping_(settings, clock), friction_(frictions(finish, surfaces.size())),
      calming_(settings.tolerance_m),
      path_(2 * (room_for_evaluations(surfaces.size()) + kMostLegs)) { // there, and back
    work_of_a_frame_ = kWorkOfSolvers + 3 * kWorkOfEvaluation * stepping_.most_evaluations();
    finish.resize(std::max(finish.size(), surfaces.size()));
    make_layers(settings, surfaces, finish, clock, effects);
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        if (layer_of(i)) { // felt by its layer
            stand_ins_.push_back(std::make_unique<NoContact>());
            surfaces[i] = stand_ins_.back().get();
            finish[i] = {};
        }
        surfaces_.emplace_back(*surfaces[i], finish[i]);
        needs_.bodies = needs_.bodies || surfaces_.back().moving();
        needs_.magnets = needs_.magnets || surfaces_.back().has_magnet();
        needs_.softness = needs_.softness || surfaces_.back().has_softness() || layer_of(i);
    }
    needs_.layers = !layers_.empty();
    needs_.alone = needs_.softness && !needs_.layers;
    needs_.starts = needs_.bodies || needs_.alone;
    for (Effect* effect : effects)
        effects_.emplace_back(*effect);
    needs_.calming = frames_may_contradict() || surfaces_.size() > 1 || !friction_.none();
    needs_.one_alone = surfaces_.size() == 1 &&
                       (surfaces_.front().contact().of_field() || surfaces_.front().has_softness());
    needs_.others = needs_.layers || !effects_.empty();
    needs_.nothing = surfaces_.empty() && effects_.empty();
    needs_.only_slides = surfaces_.size() == 1 && effects_.empty() && friction_.none() &&
                         !needs_.magnets && !needs_.bodies && surfaces_.front().contact().sliding();
    steps_left_.reserve(room_for_evaluations(surfaces.size()));
}

void Subdivision::compute_everything() noexcept {
    for (Layer& layer : layers_)
        layer.front->compute_everything();
    needs_.everything = needs_.magnets = needs_.calming = true;
    needs_.nothing = needs_.only_slides = false;
}

SubdivisionResult Subdivision::advance(const FrameContext& frame,
                                       std::span<const std::uint32_t> steps_left) noexcept {
    frame_ = frame;
    return run(steps_left);
}

/// One frame: section 4.1 of the paper. Numbers in brackets are its equations. A step of the paper
/// is an evaluation and the move after it. An approach is a whole search for the balance of forces:
/// the paper has one, here a second follows where something gave way. `replayed` has the N_steps of
/// an earlier run; if it is empty, the clock decides.
SubdivisionResult Subdivision::run(std::span<const std::uint32_t> replayed) noexcept {
    begin(replayed); // t_0; bodies move, and with them the proxy; effects note where it starts
    if (needs_.nothing && is_a_place(frame_.probe) && !observer_) return run_free();
    Vec3 proxy = frame_.start;
    Vec3 before = proxy;
    Move move;
    do { // one approach to the balance of forces
        begin_approach();
        do { // one evaluation and its sub-step
            before = proxy;
            if (!solve_on_facet(proxy)) { // one facet alone: both in closed form
                gather(proxy);            // (6) the primitives at the proxy
                solve(proxy);             // (7) the candidate, where their forces balance
            }
            count_steps_left();          // (8), (10) how many evaluations may follow
            move = next_move(proxy);     // (9) a share of the way; adaptive: a Newton step
            proxy = follow(move, proxy); // as far as every certificate holds
            if (observer_) tell(move, before, proxy);
        } while (goes_on(move, before, proxy));
    } while (open_a_membrane() || let_friction_slip()); // something gave way: less holds the proxy
    led_ = move.kind == Move::Kind::slide;
    return commit(final_proxy(proxy));
}

/// The same where nothing can be felt: what draws the proxy is the probe, and nothing is in its
/// way.
SubdivisionResult Subdivision::run_free() noexcept {
    const Vec3 target = pull();
    Vec3 proxy = frame_.start;
    begin_approach();
    do {
        budget_.work_left -= kWorkOfEvaluation;
        ++budget_.evaluations;
        result_.residual_m = glm::length(target - proxy);
        steps_left_.push_back(stepping_.count_steps_left({result_.residual_m, false}, budget_));
        if (result_.residual_m < Stepping::kNoMovement_m) break;
        const bool whole = stepping_.seeks_balance() || stepping_.steps_left() == 0 ||
                           path_.tries_in_vain() >= kTriesOfOneWay; // shorter shares are rounding
        proxy = record_move(whole ? target : stepping_.share(proxy, target));
    } while (proxy != target && !has_given_up() && stepping_.goes_on(budget_));
    if (path_.sub_steps() == 0 && path_.stands_still()) result_.flags |= kStalled;
    return end_frame(proxy);
}

// ---- a frame's beginning -----------------------------------------------------------------------

void Subdivision::begin(std::span<const std::uint32_t> replayed) noexcept {
    result_ = {};
    steps_left_.clear();
    shortened_m_ = 0.0;
    budget_ = {0, work_of_a_frame_, kMostLegs, 0};
    stepping_.begin_frame(replayed); // t_0
    if (needs_.starts) {
        if (needs_.alone) begin_pressing();
        if (needs_.bodies) frame_.start = follow_bodies(frame_.start);
    }
    path_.begin(frame_.start);
    follow_gains();
    if (needs_.calming || (needs_.one_alone && calming_.follow_probe(frame_.probe)))
        begin_calming();
    for (LoopEffect& effect : effects_)
        effect.begin(frame_);
    friction_.begin();
    for (LoopSurface& surface : surfaces_)
        surface.begin(frame_);
    note_open();
}

/// Takes measures against a proxy that goes to and fro by itself.
void Subdivision::begin_calming() noexcept {
    if (is_driven()) {
        calming_.restart();
    } else if (frames_may_contradict()) {
        calming_.begin(frame_);
    } else if (surfaces_.size() > 1 || (surfaces_.size() == 1 && friction_.rubs(0))) {
        // These are calmed under a held probe alone, where a frame does not come to its end.
        calming_.begin(frame_);
        if (!calming_.held()) {
            calming_.restart();
            calming_.begin(frame_);
        }
    } else if (needs_.one_alone) {
        if (calming_.follow_probe(frame_.probe)) calming_.begin(frame_);
    }
    frame_.held = calming_.held();
    frame_.looks = frame_.held && stepping_.seeks_balance() && !effects_.empty();
    frame_.rests = calming_.stopped();
    if (calming_.spring_n_per_m() > 0.0) result_.flags |= kCalmed;
}

void Subdivision::follow_gains() noexcept {
    bool any_moves = false; // then a held probe is drawn elsewhere in each frame
    bool all_as_set = true;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        LoopSurface& surface = surfaces_[i];
        if (surface.follow_gains(frame_)) {
            any_moves = true;
            friction_.set_gain(i, surface.gain_value(SurfacePart::friction));
        }
        all_as_set = all_as_set && surface.is_as_set();
    }
    for (LoopEffect& effect : effects_) {
        any_moves = effect.follow_gain(frame_) || any_moves;
        all_as_set = all_as_set && effect.is_as_set();
    }
    for (const Layer& layer : layers_) { // they take their steps as they are pressed
        any_moves = any_moves || layer.front->surfaces_.front().gains_move();
        if (reaches_held_tip(layer)) calming_.stir();
    }
    if (any_moves) calming_.restart();
    if (!all_as_set) result_.flags |= kLiveGain;
}

/// Whether an effect pushes and moves by itself, as a pulse or a beating vessel does. A proxy that
/// moves with such an effect must not be calmed.
bool Subdivision::is_driven() const noexcept {
    return std::any_of(effects_.begin(), effects_.end(), [](const LoopEffect& effect) {
        return effect.is_active() && effect.unasked_force_n() > 0.0;
    });
}

/// Whether the balances of two frames may differ though the probe is held. With surfaces alone, and
/// each frame solved to its end, they do not differ. With nothing, the proxy is the probe.
bool Subdivision::frames_may_contradict() const noexcept {
    if (surfaces_.empty() && effects_.empty() && !needs_.everything) return false;
    return !stepping_.seeks_balance() || !effects_.empty() ||
           std::any_of(surfaces_.begin(), surfaces_.end(),
                       [](const LoopSurface& surface) { return surface.depends_on_place(); });
}

// ---- one evaluation ----------------------------------------------------------------------------

/// Starts the way to the balance of forces. Also called again when something has given way.
void Subdivision::begin_approach() noexcept {
    stepping_.begin_approach();
    path_.look_anew();
}

void Subdivision::gather(const Vec3& proxy) noexcept {
    const Vec3 pulled_to = needs_.magnets ? pull() : Vec3{0.0}; // of the evaluation before
    contacts_.clear();
    primitives_.clear();
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        LoopSurface& surface = surfaces_[i];
        contacts_.begin(i);
        surface.offer(proxy, pulled_to, contacts_);
        if (budget_.evaluations == 0) surface.ration_restoring(frame_, contacts_);
        surface.sink(contacts_);
    }
    if (needs_.magnets) {
        contacts_.begin(ContactSet::kNoSurface);
        for (const LoopSurface& surface : surfaces_)
            surface.offer_magnet(contacts_);
    }
    for (std::size_t i = 0; i < contacts_.size(); ++i)
        primitives_.add(contacts_[i].plane);
    if (calming_.spring_n_per_m() > 0.0)
        primitives_.add_spring(frame_.start, calming_.spring_n_per_m());
    if (needs_.others) {
        if (needs_.layers) press_layers(proxy); // effects that hold look where all others draw
        for (LoopEffect& effect : effects_)
            effect.gather(proxy, frame_, primitives_);
        primitives_.set_gain({});
        if (needs_.layers) hold_at_strength(proxy); // once all that draws the tip is known
    }
    friction_.gather(proxy, contacts_, primitives_);
}

/// gather() and solve() for a proxy within a facet of the only surface, a hard one: most
/// evaluations on a mesh are of this kind. False where it is not so; then they are to be called.
bool Subdivision::solve_on_facet(const Vec3& proxy) noexcept {
    if (!needs_.only_slides || calming_.spring_n_per_m() > 0.0 || !is_a_place(frame_.probe))
        return false;
    LoopSurface& surface = surfaces_.front();
    const auto face = surface.offer_face(proxy, budget_.evaluations == 0);
    if (!face) return false;
    contacts_.set_hard_plane(face->anchor, face->normal);
    primitives_.set_hard_plane(face->anchor, face->normal);
    const Vec3 target = pull();
    solution_.restart(primitives_, target);
    solution_.work = 1;
    internal::add_one_plane(primitives_.planes().front(), target, frame_.stiffness, solution_);
    if (!is_a_place(solution_.proxy)) return false;
    surface.take_face(solution_.planes[0].state != MultiplierState::released);
    evaluated(proxy, budget_.work_left - kWorkOfEvaluation - solution_.work);
    return true;
}

void Subdivision::solve(const Vec3& proxy) noexcept {
    int work_left = budget_.work_left - kWorkOfEvaluation;
    friction_.solve(primitives_, frame_.probe, frame_.stiffness, work_left, solution_);
    if (!is_a_place(solution_.proxy)) {
        solution_.proxy = proxy;
        result_.flags |= kForceNotFinite;
    }
    if (needs_.layers) correct_for_layers(proxy);
    for (LoopEffect& effect : effects_)
        effect.solved(solution_.proxy);
    for (LoopSurface& surface : surfaces_)
        surface.take(solution_);
    evaluated(proxy, work_left);
    if (solution_.status == SolveStatus::capped) result_.flags |= kSolverCap;
    if (contacts_.overflowed() || primitives_.overflowed()) result_.flags |= kPrimitivesFull;
    if (!primitives_.all_finite()) result_.flags |= kForceNotFinite;
}

/// An evaluation at `proxy` has its solution, which has left so much of the frame's work.
void Subdivision::evaluated(const Vec3& proxy, int work_left) noexcept {
    budget_.work_left = work_left;
    ++budget_.evaluations;
    result_.residual_m = std::max(glm::length(solution_.proxy - proxy), shortened_m_);
}

void Subdivision::count_steps_left() noexcept {
    const EvaluationOutcome outcome{result_.residual_m, contacts_.facets_only() && !layers_press_};
    steps_left_.push_back(stepping_.count_steps_left(outcome, budget_));
}

void Subdivision::tell(const Move& move, const Vec3& from, const Vec3& to) noexcept {
    const std::span<const Vec3> corners = path_.corners();
    std::size_t begin = corners.size() - 1;
    while (begin > 0 && corners[begin] != from)
        --begin;
    FixedVector<SubStep::Leash, PrimitiveSet::kCapacity> leashes;
    for (std::size_t i = 0; i < surfaces_.size() && !leashes.full(); ++i)
        if (const std::optional<Leash> leash = surfaces_[i].contact().leash())
            leashes.push_back({i, leash->guard, leash->length_m, leash->offered});
    FixedVector<SubStep::Friction, PrimitiveSet::kCapacity> rubbing;
    for (std::size_t c = 0; c < contacts_.size(); ++c)
        if (const std::optional<std::size_t> line = friction_.line_at(c))
            rubbing.push_back({c, *line, friction_.coefficient(contacts_[c].surface)});
    observer_->sub_step(
        {move.kind, from, solution_.proxy, move.to, to, stop_, frame_.probe, frame_.stiffness,
         corners.subspan(begin), std::span(leashes.begin(), leashes.size()),
         std::span(rubbing.begin(), rubbing.size()), contacts_, primitives_, solution_});
    stop_ = {};
}

/// Whether another evaluation follows the one that moved the proxy from `before` to `proxy`: in the
/// paper, while N_steps is not zero; its last move goes all the way to the candidate (candidate()).
/// Sets the flag kEvaluationCap if the frame has to end unfinished.
bool Subdivision::goes_on(const Move& move, const Vec3& before, const Vec3& proxy) noexcept {
    if (move.kind == Move::Kind::none || has_given_up()) return false;
    if (move.kind == Move::Kind::look) return true;
    bool more = false;
    if (move.kind == Move::Kind::slide) {
        if (stepping_.steps_left() > 0 && rests_firmly(proxy)) {
            result_.residual_m = 0.0; // nothing is left of the way
            return false;
        }
        // Where another surface stopped it at once, that one has planes the next time.
        more = stepping_.steps_left() > 0 && (proxy != before || !stepping_.has_converged());
        // What it came to with the last evaluation may give way: nobody has asked.
        if (!more && proxy != before && may_give_way(proxy)) stepping_.cut_short();
    } else {
        if (primitives_.is_free() && proxy == solution_.proxy && !needs_.layers) return false;
        if (proxy != move.to) stepping_.cut_short(); // it was not the last
        more = stepping_.goes_on(budget_);
    }
    const bool is_spent = budget_.work_left <= 0;
    if (more ? is_spent : stepping_.is_unfinished()) result_.flags |= kEvaluationCap;
    return more && !is_spent;
}

/// Whether the leading surface yields where the proxy is now, by what draws it there.
bool Subdivision::may_give_way(const Vec3& proxy) const noexcept {
    const double drawn_n =
        primitives_.total_stiffness(frame_.stiffness) * glm::length(pull() - proxy);
    return drawn_n > (1.0 + kRounding) * contacts_[0].plane.strength_n;
}

bool Subdivision::has_given_up() const noexcept {
    return (result_.flags & (kStalled | kEvaluationCap)) != 0;
}

// ---- a frame's end -----------------------------------------------------------------------------

/// Whether the balance presses a membrane above its strength: it opens, and the frame goes on
/// without it.
bool Subdivision::open_a_membrane() noexcept {
    if (has_given_up()) return false;
    for (LoopSurface& surface : surfaces_) {
        if (!surface.open_if_pressed(solution_, contacts_)) continue;
        note_open();
        return true;
    }
    return false;
}

/// Whether what friction held has begun to slide: the frame goes on with less of it. What is to
/// stay does not begin to.
bool Subdivision::let_friction_slip() noexcept {
    return !has_given_up() && !calming_.has_come_back_too_often() && friction_.breaks_away();
}

void Subdivision::note_open() noexcept {
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
        result_.open |= bit_of(i, surfaces_[i].is_open());
}

SubdivisionResult Subdivision::commit(const Vec3& proxy) noexcept {
    const Vec3 end = needs_.alone ? tip_of(proxy) : proxy; // says whether the tip is let go
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        LoopSurface& surface = surfaces_[i];
        result_.felt |= bit_of(i, surface.is_felt());
        if (surface.is_felt()) note_touch(surface, proxy);
        surface.commit(proxy, frame_);
        result_.guarded |= bit_of(i, surface.contact().guarded());
    }
    note_open();
    if (needs_.layers) commit_layers(proxy);
    friction_.commit();
    if (calming_.begun())
        // Only under a held probe is it asked how far the frame has walked.
        calming_.end(proxy, stepping_.seeks_balance() || !calming_.held() ? 0.0 : path_.length_m(),
                     (resistance_n_per_m() - calming_.spring_n_per_m()) / frame_.stiffness);
    for (LoopEffect& effect : effects_)
        effect.commit({proxy, result_.felt});
    for (const PlaneOutcome& plane : solution_.planes)
        if (plane.state != MultiplierState::released) ++result_.contacts;
    const std::size_t lines = primitives_.lines().size() - friction_.lines();
    for (std::size_t i = 0; i < lines; ++i)
        if (squared_length(solution_.lines[i].force_n) > 0.0) ++result_.contacts;
    for (const TetherOutcome& point : solution_.points)
        if (squared_length(point.force_n) > 0.0) ++result_.contacts;
    if (needs_.alone && !surfaces_.front().is_felt()) result_.contacts = 0;
    return end_frame(end);
}

SubdivisionResult Subdivision::end_frame(const Vec3& proxy) noexcept {
    result_.proxy = proxy;
    result_.evaluations = budget_.evaluations;
    result_.sub_steps = path_.sub_steps();
    result_.work = static_cast<std::uint32_t>(work_of_a_frame_ - budget_.work_left);
    return result_;
}

// ---- what the loop asks besides ----------------------------------------------------------------

QueryCount Subdivision::queries() const noexcept {
    QueryCount count;
    for (const LoopSurface& surface : surfaces_)
        count.field_samples += surface.samples();
    return count;
}

Vec3 Subdivision::with_device_forces(Vec3 force_n) const noexcept {
    for (const LoopEffect& effect : effects_)
        effect.add_device_force(force_n);
    return force_n;
}

double Subdivision::unasked_force_n(double most_n) const noexcept {
    double sum_n = 0.0;
    for (const LoopEffect& effect : effects_) {
        const double own_n = effect.unasked_force_n();
        if (own_n > 0.0) sum_n += std::min(own_n, most_n); // what is no number is none
    }
    return sum_n;
}

bool Subdivision::is_active() const noexcept {
    return std::any_of(effects_.begin(), effects_.end(),
                       [](const LoopEffect& effect) { return effect.is_active(); }) ||
           std::any_of(surfaces_.begin(), surfaces_.end(), [](const LoopSurface& surface) {
               return surface.has_magnet_on() || surface.moving();
           });
}

} // namespace palpate
