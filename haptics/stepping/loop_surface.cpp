// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/loop_surface.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// Of a surface that yields only the normal is trusted, not where its level is: for longer steps.
constexpr double kYieldingTrust = 4.0;
// A lift below this is rounding.
constexpr double kNoLift_m = 1e-10;

/// Throws where a map of stiffness is of a surface that it cannot be of: the energy that it makes
/// is of a front that follows the probe, and of a place that stands still.
void require_can_have_map(const SurfaceFinish& finish, bool moves) {
    const auto refuse = [](const std::string& what) {
        throw std::invalid_argument("stiffness: a map of a surface that " + what +
                                    "; leave one of both out");
    };
    if (finish.softness.none()) refuse("is hard");
    if (std::isfinite(finish.strength_n) || finish.strength.field) refuse("yields");
    if (finish.friction.static_mu > 0.0) refuse("rubs");
    if (moves) refuse("moves");
}

/// A gain with which a surface has a strength in N, whatever its own.
Gain holding(double strength_n, Gain gain) {
    gain.force_limit_n = std::numeric_limits<double>::infinity();
    gain.strength_here_n = gain.off() ? 0.0 : strength_n / gain.value;
    return gain;
}

} // namespace

LoopSurface::LoopSurface(SurfaceContact& contact, const SurfaceFinish& finish)
    : contact_(&contact), moving_(contact.moving()),
      strength_(LocalStrength::holding(0.0, finish.strength)), magnet_(finish.magnet),
      has_magnet_(!finish.magnet.none() || finish.magnet.over.field != nullptr) {
    require("strength_n", finish.strength_n, kPositiveOrInfinite);
    finish.softness.check("softness");
    if (finish.stiffness) require_can_have_map(finish, moving_ != nullptr);
    if (finish.softness.none()) return;
    soft_ = std::make_unique<Soft>();
    soft_->softness = finish.softness;
    soft_->stiffness = finish.stiffness;
    soft_->own_strength_n = finish.strength_n;
}

LoopSurface::State LoopSurface::save_state() const {
    State state{&typeid(*contact_),
                contact_->save_state(),
                strength_.save_state(),
                magnet_.save_state(),
                bank_,
                tissue_m(),
                {},
                pushes_back_,
                yields_,
                began_inside_,
                touched_at_,
                touched_normal_,
                let_go_};
    for (std::size_t part = 0; part < kSurfaceParts; ++part)
        state.gains[part] = gains_[part].save_state();
    return state;
}

void LoopSurface::restore_state(const State& state) {
    contact_->restore_state(state.contact);
    strength_.restore_state(state.strength);
    magnet_.restore_state(state.magnet);
    bank_ = state.bank;
    if (soft_) {
        soft_->tissue_m = state.tissue_m;
        soft_->law = {}; // and the contact's strength, at the next frame
    }
    for (std::size_t part = 0; part < kSurfaceParts; ++part)
        gains_[part].restore_state(state.gains[part]);
    as_set_ = all_gains_are_one();
    pushes_back_ = state.pushes_back;
    yields_ = state.yields;
    began_inside_ = state.began_inside;
    touched_at_ = state.touched_at;
    touched_normal_ = state.touched_normal;
    let_go_ = state.let_go;
}

bool LoopSurface::go_on_from(const LoopSurface& before, const Vec3& proxy,
                             double tissue_m) noexcept {
    if (before.moving_) before.moving_->begin_motion(); // what was set last is where it goes
    const bool inside = restart(proxy, before.moving_ ? &before.moving_->pose() : nullptr);
    // A surface that was off counted as inside. If the proxy is in front of its level now, it
    // begins anew, a body at its pose. Only a mesh remembers its side.
    const bool begins_anew = before.is_off() && !inside && contact_->of_field();
    if (begins_anew && !moving_) return inside;
    if (!contact_->go_on_from(*before.contact_)) return moving_ ? restart(proxy) : inside;
    if (begins_anew) {
        moving_->restart_at(moving_->pose(), proxy);
        return inside;
    }
    bank_ = before.bank_;
    if (soft_) soft_->tissue_m = tissue_m;
    pushes_back_ = before.pushes_back_;
    yields_ = before.yields_;
    began_inside_ = before.began_inside_;
    touched_at_ = before.touched_at_;
    touched_normal_ = before.touched_normal_;
    let_go_ = before.let_go_;
    return before.is_off() ? inside : contact_->state() == SurfaceState::inside && !is_off();
}

bool LoopSurface::restart(const Vec3& proxy, const RigidPose* body) noexcept {
    bank_.clear();
    if (soft_) soft_->tissue_m = 0.0;
    strength_.restart();
    magnet_.restart();
    for (GainRamp& gain : gains_)
        gain.jump();
    // The place is judged with these gains: a texture as high as it is now, and what is off is not
    // there.
    if (FieldSurface* field = contact_->of_field())
        field->set_texture_gain(gain_value(SurfacePart::texture));
    const bool is_inside =
        moving_ && body ? moving_->restart_at(*body, proxy) : contact_->restart(proxy);
    began_inside_ = is_inside && !is_off();
    return began_inside_;
}

bool LoopSurface::gains_move() const noexcept {
    return std::any_of(gains_.begin(), gains_.end(),
                       [](const GainRamp& gain) { return gain.moves(); });
}

bool LoopSurface::follow_gains(const FrameContext& frame) noexcept {
    if (!strength_.depends_on_place() && !gains_move()) return false;
    unsigned moved = 0; // a bit for each part
    for (std::size_t part = 0; part < kSurfaceParts; ++part)
        moved |= static_cast<unsigned>(gains_[part].advance(frame.period_s)) << part;
    if (moved != 0) as_set_ = all_gains_are_one();
    const auto has_moved = [&](SurfacePart part) {
        return (moved >> static_cast<unsigned>(part) & 1U) != 0;
    };
    if (has_moved(SurfacePart::strength) || strength_.depends_on_place()) set_strength(frame);
    if (has_moved(SurfacePart::magnet))
        magnet_.set_gain(gain(SurfacePart::magnet).gain(frame.force_limit_n));
    FieldSurface* field = has_moved(SurfacePart::texture) ? contact_->of_field() : nullptr;
    if (field) field->set_texture_gain(gain_value(SurfacePart::texture));
    return moved != 0;
}

/// As strong as its gain and its place make it.
void LoopSurface::set_strength(const FrameContext& frame) noexcept {
    Gain now = gain(SurfacePart::strength).gain(frame.force_limit_n);
    if (now.off())
        strength_.restart(); // it asks for nothing, and begins anew
    else if (strength_.depends_on_place())
        now.strength_here_n = strength_.at(seen(frame));
    if (is_soft()) {
        const double felt_n = now.strength_n(soft_->own_strength_n);
        const double hard_n = soft_->law.strength_of_hard_n(felt_n);
        soft_->yields_at_m = hard_n / soft_->law.coupling();
        now = holding(hard_n, now);
    } else if (tissue_) {
        const double felt_n = now.strength_n(std::numeric_limits<double>::infinity());
        now = holding(frame.stiffness * tissue_->indentation_m(felt_n), now);
    }
    contact_->set_gain(now);
}

/// As its strength by place sees it: a force finds something else elsewhere the sooner, the softer
/// what it has to move.
FrameContext LoopSurface::seen(const FrameContext& frame) const noexcept {
    FrameContext seen = moving_ ? in_body(frame) : frame;
    if (is_soft()) seen.stiffness = soft_->law.softest();
    seen.gain = gain_value(SurfacePart::strength);
    return seen;
}

/// With the proxy as the surface's own body sees it: fields that it depends on move along with it.
FrameContext LoopSurface::in_body(const FrameContext& frame) const noexcept {
    FrameContext seen = frame;
    seen.start = moving_->to_body(frame.start);
    return seen;
}

bool LoopSurface::all_gains_are_one() const noexcept {
    return std::all_of(gains_.begin(), gains_.end(),
                       [](const GainRamp& gain) { return gain.value() == 1.0; });
}

void LoopSurface::follow_coupling(const FrameContext& frame) noexcept {
    if (soft_->law.coupling() == frame.stiffness) return;
    soft_->law = PressLaw(soft_->softness, frame.stiffness);
    if (!strength_.depends_on_place()) set_strength(frame); // else each frame does
}

LoopSurface::Press LoopSurface::press(double press_m, double period_s, double ratio) noexcept {
    if (soft_->stiffness) return press_over_lumps(press_m, period_s, ratio);
    const PressLaw& law = soft_->law;
    const bool has_damper = soft_->softness.damping > 0.0;
    const double force_n = has_damper ? damped_n(law, press_m, period_s) : law.force_n(press_m);
    return {force_n, law.slope(press_m), 0.0};
}

/// The force of a law with the damper beside it. However fast it is pressed, it holds no more than
/// its strength. A front that gives way goes towards the tip: of that way the damper feels nothing.
double LoopSurface::damped_n(const PressLaw& law, double press_m, double period_s) noexcept {
    const PressLaw::Balance balance =
        law.damped(press_m, soft_->tissue_m, soft_->softness.damping, period_s);
    const double force_n =
        yields_ ? law.force_n(press_m) : std::min(balance.force_n, law.force_n(soft_->yields_at_m));
    soft_->tissue_m =
        force_n == balance.force_n ? balance.tissue_m : press_m - force_n / law.coupling();
    return force_n;
}

/// The same where what lies beneath makes its law `ratio` times as stiff.
LoopSurface::Press LoopSurface::press_over_lumps(double press_m, double period_s,
                                                 double ratio) noexcept {
    const double within = soft_->law.ratio_within(ratio);
    const PressLaw law = soft_->law.scaled(within);
    Press press{law.force_n(press_m), law.slope(press_m), 0.0};
    double at_rest_m = press_m; // where the tissue's spring would be with no damper beside it
    if (const double damping = soft_->softness.damping; damping > 0.0) {
        const double before_m = soft_->tissue_m;
        press.force_n = damped_n(law, press_m, period_s);
        const double viscous_n = yields_ ? 0.0 : damping / period_s * (soft_->tissue_m - before_m);
        at_rest_m = soft_->tissue_m + std::max(0.0, press.force_n - viscous_n) / law.coupling();
    }
    // Where the coupling is as stiff as the ratio could make it, the ratio changes nothing.
    if (within == ratio && press.force_n > 0.0) press.energy_j = soft_->law.energy_j(at_rest_m);
    return press;
}

void LoopSurface::offer(const Vec3& proxy, const Vec3& pull, ContactSet& contacts) noexcept {
    first_ = contacts.size();
    if (has_magnet_)
        magnet_.offer(proxy, pull, *contact_, contacts);
    else
        contact_->offer(proxy, contacts);
    last_ = contacts.size();
}

std::optional<SlidingSurface::Face> LoopSurface::offer_face(const Vec3& proxy,
                                                            bool begins) noexcept {
    SlidingSurface* sliding = contact_->sliding();
    if (!sliding || (!begins && is_rationed())) return std::nullopt;
    const std::optional<SlidingSurface::Face> face = sliding->offer_face(proxy);
    if (!face) return std::nullopt;
    if (begins) {
        if (!bank_.is_level(glm::dot(face->normal, face->anchor - proxy))) return std::nullopt;
        sunk_m_ = 0.0;
    }
    first_ = 0;
    last_ = 1;
    return face;
}

void LoopSurface::ration_restoring(const FrameContext& frame, const ContactSet& contacts) noexcept {
    sunk_m_ = 0.0;
    if (!is_touched()) {
        bank_.clear();
        return;
    }
    const Vec3& proxy = frame.start;
    double depth_m = -std::numeric_limits<double>::infinity();
    Vec3 normal{0.0};
    for (std::size_t c = first_; c < last_; ++c) {
        const PlanePrimitive& plane = contacts[c].plane;
        const double depth_of_plane_m = glm::dot(plane.normal, plane.anchor - proxy);
        if (depth_of_plane_m <= depth_m) continue;
        depth_m = depth_of_plane_m;
        normal = plane.normal;
    }
    if (bank_.is_level(depth_m)) return;
    const double lift_m = bank_.lift(depth_m, normal, proxy - frame.probe, frame.stiffness);
    sunk_m_ = std::max(0.0, depth_m - lift_m);
}

void LoopSurface::sink(ContactSet& contacts) const noexcept {
    for (std::size_t c = first_; is_rationed() && c < last_; ++c)
        contacts.sink(c, sunk_m_);
}

void LoopSurface::take(const ProxySolution& solution) noexcept {
    pushes_back_ = yields_ = let_go_ = false;
    for (std::size_t c = first_; c < last_; ++c) {
        const MultiplierState state = solution.planes[c].state;
        pushes_back_ = pushes_back_ || state != MultiplierState::released;
        yields_ = yields_ || state == MultiplierState::saturated;
    }
    contact_->keep_active(solution, first_);
}

Vec3 LoopSurface::strongest_normal(const ProxySolution& solution,
                                   const ContactSet& contacts) const noexcept {
    std::size_t strongest = first_;
    for (std::size_t c = first_ + 1; c < last_; ++c)
        if (solution.planes[c].multiplier_n > solution.planes[strongest].multiplier_n)
            strongest = c;
    return contacts[strongest].plane.normal;
}

void LoopSurface::commit(const Vec3& proxy, const FrameContext& frame) noexcept {
    contact_->commit(proxy, yields_, pushes_back_);
    if (began_inside_) began_inside_ = contact_->state() == SurfaceState::inside;
    bank_.end(proxy - frame.probe);
    if (yields_) bank_.level_moved();
}

bool LoopSurface::is_open() const noexcept {
    const SurfaceState state = contact_->state();
    return state == SurfaceState::inside || state == SurfaceState::yielded;
}

bool LoopSurface::open_if_pressed(const ProxySolution& solution,
                                  const ContactSet& contacts) noexcept {
    Membrane* membrane = contact_->membrane();
    if (!membrane || contact_->state() == SurfaceState::inside) return false;
    Vec3 pressing_n{0.0};
    for (std::size_t c = first_; c < last_; ++c)
        pressing_n += solution.planes[c].multiplier_n * contacts[c].plane.normal;
    if (!(glm::length(pressing_n) >= membrane->opens_above_n())) return false;
    membrane->open();
    return true;
}

double LoopSurface::trust_m() const noexcept {
    if (!is_touched() && !magnet_.holds()) return std::numeric_limits<double>::infinity();
    return (yields_ ? kYieldingTrust : 1.0) * contact_->trust_m();
}

std::optional<Vec3> LoopSurface::restore(const Vec3& proxy, const FrameContext& frame) noexcept {
    FieldSurface* field = contact_->of_field();
    if (yields_ || !field) return std::nullopt;
    const std::optional<Vec3> nearer = field->restore(proxy);
    if (!nearer || !is_rationed()) return nearer;
    return lifted(proxy, *nearer, bank_.energy_j(), frame);
}

std::optional<Vec3> LoopSurface::settle(const Vec3& proxy) noexcept {
    FieldSurface* field = contact_->of_field();
    if (yields_ || !pushes_back_ || is_rationed() || !field) return std::nullopt;
    return field->settle(proxy);
}

std::optional<Vec3> lifted(const Vec3& proxy, const Vec3& to, double drifted_j,
                           const FrameContext& frame) noexcept {
    const Vec3 ahead = proxy - frame.probe, way = to - proxy;
    const double free_m2 = squared_length(frame.start - frame.probe) +
                           2.0 * drifted_j / frame.stiffness - squared_length(ahead);
    const double length_m2 = squared_length(way), along_m2 = glm::dot(ahead, way);
    // The lift ends at most where it has used up what is free. Towards the probe it gives.
    const double root_m4 = along_m2 * along_m2 + length_m2 * free_m2;
    if (!(root_m4 >= 0.0) || !(length_m2 > 0.0)) return std::nullopt;
    const double root = std::sqrt(root_m4);
    const Vec3 lift = std::clamp((root - along_m2) / length_m2, 0.0, 1.0) * way;
    return glm::length(lift) > kNoLift_m ? std::optional(proxy + lift) : std::nullopt;
}

} // namespace palpate
