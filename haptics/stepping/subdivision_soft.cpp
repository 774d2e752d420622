// SPDX-License-Identifier: Apache-2.0
// Soft surfaces: one that is alone, in closed form; others as layers that push the proxy, which is
// their tip (docs/palpation.md).
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <palpate/haptics/contact/curvature_step.h>
#include <palpate/haptics/solver/internal/mixed_primitives.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

// Nearer to its front than this, a tip has no direction to it.
constexpr double kNoDirection_m = 1e-12;
// A front that is cut short goes on so often, for one place of the tip.
constexpr int kMostFollows = 8;
// At this eigenvalue of 1 + d h the tip is in the middle of what the front is on, which may be
// anywhere around it: how it turns is rounding. Near to that a step needs it the more.
constexpr double kFocus = 1e-6;
// A front is taken to go no more than twice as far as the probe. Where a rough surface bends more
// than that, it goes by jumps, from dent to dent: followed to the letter, the force along the
// surface was several times the force into it, for a frame.
constexpr double kLeastFollow = 0.5;
// Flags of a front that a frame has: from any of its evaluations, and from the last.
constexpr std::uint32_t kOnceInAFrame = kLiveGain | kForceNotFinite;
constexpr std::uint32_t kAtItsEnd = kEvaluationCap | kStalled | kSolverCap | kCalmed;
// A front that gives way leaves its tissue the strength, but for rounding.
constexpr double kRounding = 1e-9;
// Squared sine of the angle between two planes; below, they are one plane.
constexpr double kNoEdge = 1e-6;
// Within one piece of a law the force is off its slope by less than this share, by rounding.
constexpr double kBent = 1e-9;
// Where the forces along a step balance, to this share of its length, and after so many steps.
constexpr double kBalanced = 1e-12;
constexpr int kBalanceSteps = 40;

/// By how much more a law's force falls than its slope tells, where the tip comes `nearer_m` nearer
/// to its front, N.
double bend_n(const PressLaw& law, double indentation_m, double nearer_m) noexcept {
    const PressLaw::Tissue here = law.tissue(indentation_m);
    const double there_n = law.tissue(indentation_m - nearer_m).force_n;
    const double bend = here.force_n - there_n - here.slope_n_per_m * nearer_m;
    return std::abs(bend) > kBent * std::max(here.force_n, std::abs(there_n)) ? bend : 0.0;
}

/// Throws std::invalid_argument where the i-th surface, a soft one that is not alone, has what
/// would have to act on its front.
void require_can_be_layer(std::size_t i, SurfaceContact& contact, const SurfaceFinish& finish,
                          SteppingMethod method) {
    const auto refuse = [i](const char* what, const char* remedy) {
        throw std::invalid_argument("surface " + std::to_string(i) +
                                    " is soft, and not all that is felt: then " + what + "; " +
                                    remedy);
    };
    if (finish.friction.static_mu > 0.0) refuse("it cannot rub", "leave friction on it out");
    if (!finish.magnet.none() || finish.magnet.over.field)
        refuse("it cannot draw", "leave the magnet out");
    if (std::isfinite(finish.strength_n) || finish.strength.field)
        refuse("it cannot yield", "leave strength_n out, or let its Softness end flat");
    if (finish.stiffness) refuse("it cannot be stiffer over lumps", "leave their map out");
    if (contact.moving()) refuse("it cannot move", "let it stand still");
    if (method != SteppingMethod::adaptive)
        refuse("the method cannot be another than adaptive", "take SteppingMethod::adaptive");
}

} // namespace

// ---- a soft surface that is alone ---------------------------------------------------------------

/// The frame is one of the front: it goes on from there.
void Subdivision::begin_pressing() noexcept {
    surfaces_.front().follow_coupling(frame_);
    frame_.start = pressed_.front;
}

/// What the frame of a front comes to for the tip. For a front y that is held, coupling and tissue
/// are two springs in series, and what is left to minimise rises with |a' - y| whatever the
/// tissue's law. So the front is where a hard surface would hold the proxy, with every certificate,
/// and force and tip follow:
///   delta = |a' - y|,  n = (y - a') / delta,  x = a' + (F_h(delta) / k) n    (docs/palpation.md)
Vec3 Subdivision::tip_of(const Vec3& front) noexcept {
    LoopSurface& surface = surfaces_.front();
    if (!is_a_place(front)) return front;
    pressed_ = {0.0, 0.0, front};
    softened_ = 1.0;
    aside_n_ = Vec3{0.0};
    if (!surface.is_soft()) return front;
    const Vec3 drawn_to = frame_.probe + primitives_.force() / frame_.stiffness;
    const Vec3 behind = front - drawn_to;
    const double press_m = glm::length(behind);
    StiffnessMap::Sample beneath;
    if (surface.has_stiffness_map()) beneath = surface.beneath(front);
    // After silence the way to here took more than a period: the tissue's damper says nothing.
    const double lasts_s =
        frame_.after_silence ? std::numeric_limits<double>::infinity() : frame_.period_s;
    const LoopSurface::Press press = surface.press(press_m, lasts_s, beneath.ratio);
    if (!(press_m > Stepping::kNoMovement_m)) return front; // free
    softened_ = press.force_n / (frame_.stiffness * press_m);
    pressed_.indentation_m = (1.0 - softened_) * press_m;
    pressed_.slope_n_per_m = press.slope_n_per_m;
    if (!(press.force_n > 0.0)) surface.let_go();
    if (surface.has_stiffness_map() && press.energy_j > 0.0)
        aside_n_ = -press.energy_j * along_front(beneath.gradient, behind / press_m, press_m);
    return drawn_to + softened_ * behind + aside_n_ / frame_.stiffness;
}

/// What a front that is held where this frame left it makes of a gradient: (dy / da')^T times that.
/// Along one plane of curvature h the front follows by (1 + delta h)^-1 of the probe's way, along
/// an edge, which is taken as straight, by all of it, and at a corner by none. `n`: from the probe
/// to the front, `press_m` away.
Vec3 Subdivision::along_front(const Vec3& gradient, const Vec3& n, double press_m) const noexcept {
    std::array<std::size_t, 2> holding{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        if (solution_.planes[i].state == MultiplierState::released) continue;
        if (count == holding.size()) return Vec3{0.0};
        holding[count++] = i;
    }
    if (count == 2) {
        const Vec3 edge =
            glm::cross(contacts_[holding[0]].plane.normal, contacts_[holding[1]].plane.normal);
        const double length2 = squared_length(edge);
        if (length2 > kNoEdge) return glm::dot(edge, gradient) / length2 * edge;
    }
    const Mat3 basis = internal::across_of(n);
    const Vec3 &t = basis[0], &b = basis[1];
    const double gt = glm::dot(t, gradient), gb = glm::dot(b, gradient);
    const Mat3 bends = press_m * (count == 0 ? Mat3(0.0) : contacts_[holding[0]].depth_hessian);
    const double m00 = 1.0 + glm::dot(t, bends * t), m11 = 1.0 + glm::dot(b, bends * b);
    const double m01 = 0.5 * (glm::dot(t, bends * b) + glm::dot(b, bends * t));
    // Both eigenvalues of M are kept from 0, and the rest is M^-1 of the gradient.
    const double mean = 0.5 * (m00 + m11), half = 0.5 * (m00 - m11);
    // Of three numbers: that of two is the C library's, with another last bit on other processors.
    const double apart = std::hypot(half, m01, 0.0);
    const double most = 1.0 / std::max(mean + apart, kLeastFollow);
    const double least = 1.0 / std::max(mean - apart, kLeastFollow);
    const double alike = 0.5 * (most + least);
    const double differ = apart > 0.0 ? 0.5 * (most - least) / apart : 0.0;
    return (alike * gt + differ * (half * gt + m01 * gb)) * t +
           (alike * gb + differ * (m01 * gt - half * gb)) * b;
}

// ---- several surfaces, or effects that hold the tip ---------------------------------------------

/// Takes the soft surfaces out, unless one is alone and nothing holds its tip.
void Subdivision::make_layers(const SteppingSettings& settings,
                              const std::vector<SurfaceContact*>& contacts,
                              const std::vector<SurfaceFinish>& finish, Clock& clock,
                              const std::vector<Effect*>& effects) {
    const bool only_pushed = std::all_of(
        effects.begin(), effects.end(), [](const Effect* effect) { return effect->only_pushes(); });
    const bool has_magnet = std::any_of(finish.begin(), finish.end(), [](const SurfaceFinish& of) {
        return !of.magnet.none() || of.magnet.over.field;
    });
    if (contacts.size() == 1 && only_pushed && !has_magnet) return;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        if (finish[i].softness.none()) continue;
        require_can_be_layer(i, *contacts[i], finish[i], settings.method);
        finish[i].softness.check("softness");
        SurfaceFinish hard = finish[i];
        hard.softness = {};
        Layer layer;
        layer.surface = i;
        if (layers_.size() == kMostLayers)
            throw std::invalid_argument(
                "more than " + std::to_string(kMostLayers) +
                " surfaces are soft, and not all that is felt; make some of them hard");
        layer.softness = finish[i].softness;
        layer.front = std::make_unique<Subdivision>(
            settings, std::vector{contacts[i]}, std::vector<Effect*>{}, clock, std::vector{hard});
        layers_.push_back(std::move(layer));
    }
    for (Layer& layer : layers_)
        layer.front->surfaces_.front().yield_as(&layer.law);
}

/// The forces of soft surfaces on the tip, and by how much they fall with its step. To the solver
/// they are constant: how they fall is curvature (curvature_step()).
void Subdivision::press_layers(const Vec3& tip) noexcept {
    if (budget_.evaluations == 0) {
        for (Layer& layer : layers_) {
            layer.pushed_before = layer.pushes;
            layer.gave_way = false;
            layer.flags = 0;
        }
    }
    layers_press_ = false;
    tissue_ = Mat3(0.0);
    for (Layer& layer : layers_) {
        press(layer, tip);
        if (!(layer.force_n > 0.0)) continue;
        layers_press_ = true;
        primitives_.add_force(layer.force_n * layer.normal);
        tissue_ += turning_of(layer);
    }
}

/// Whether in this frame a tissue comes back to a tip that is in its dent. What is asked of a tip
/// at rest must not be what that first touch asks.
bool Subdivision::reaches_held_tip(const Layer& layer) const noexcept {
    const double tolerance_m = stepping_.tolerance_m();
    const double dent_m = glm::distance(layer.y, frame_.start);
    if (layer.pushes || !(dent_m > tolerance_m) || !(layer.tissue_m - dent_m > tolerance_m))
        return false;
    const PressLaw::Balance next =
        layer.law.damped(0.0, layer.tissue_m, layer.softness.damping, frame_.period_s);
    return next.tissue_m - dent_m <= tolerance_m;
}

/// However fast a layer is pressed, it holds no more than its strength: where it would after the
/// step that all forces lead to, its front gives way, and the force stays. Before that step it may
/// be far more.
void Subdivision::hold_at_strength(const Vec3& tip) noexcept {
    const double stiffness = primitives_.total_stiffness(frame_.stiffness);
    for (Layer& layer : layers_) {
        layer.at_strength = false;
        if (!(layer.force_n > 0.0)) continue;
        const double most_n = layer.front->surfaces_.front().strength_n(frame_.force_limit_n);
        const double step_m =
            glm::dot(pull() - tip, layer.normal) / (1.0 + layer.slope_n_per_m / stiffness);
        layer.at_strength = layer.force_n - layer.slope_n_per_m * step_m > most_n &&
                            layer.force_n >= (1.0 - kRounding) * most_n;
        if (!layer.at_strength) continue;
        primitives_.add_force((most_n - layer.force_n) * layer.normal);
        tissue_ -= turning_of(layer);
        layer.force_n = most_n;
        layer.slope_n_per_m = 0.0;
        tissue_ += turning_of(layer);
    }
}

/// Corrects the step to what the solver found by how these forces fall with it, and where their
/// laws bend on the way.
void Subdivision::correct_for_layers(const Vec3& tip) noexcept {
    shortened_m_ = 0.0;
    const Vec3 full = solution_.proxy - tip;
    Vec3 step = full;
    if (layers_press_) {
        const double stiffness = primitives_.total_stiffness(frame_.stiffness);
        step = curvature_step(primitives_, contacts_, solution_, tip, stiffness, 1.0,
                              tissue_ / stiffness);
        solution_.proxy = tip + step;
    }
    const double share = share_to_balance(full, step);
    if (share == 1.0) return;
    shortened_m_ = glm::length(step); // what is left may be as long
    solution_.proxy = tip + share * step;
}

/// How much of a step to make: all of it, unless the forces along it balance before, as a law has
/// other slopes on the way. A steep piece may be so short for the tip that steps leap over it, to
/// and fro. `full`: what the solver asked for. Layers that give way go by their slope.
double Subdivision::share_to_balance(const Vec3& full, const Vec3& step) const noexcept {
    const auto bends_j = [&](double share) {
        double sum_j = 0.0;
        for (const Layer& layer : layers_) {
            const bool follows_law = layer.indentation_m > kNoDirection_m && !layer.gave_way &&
                                     !layer.at_strength &&
                                     (layer.force_n > 0.0 || layer.softness.damping == 0.0);
            if (!follows_law) continue;
            const double along_m = glm::dot(layer.normal, step);
            sum_j += bend_n(layer.law, layer.indentation_m, share * along_m) * along_m;
        }
        return sum_j;
    };
    const double bends_at_end_j = bends_j(1.0);
    if (bends_at_end_j == 0.0) return 1.0;
    const double stiffness = primitives_.total_stiffness(frame_.stiffness);
    double begin_j = -stiffness * glm::dot(step, full);
    // What holds acts at the end of the way: on the way there it does not brake.
    for (std::size_t i = 0; i < solution_.planes.size(); ++i)
        if (solution_.planes[i].state == MultiplierState::active)
            begin_j +=
                solution_.planes[i].multiplier_n * glm::dot(primitives_.planes()[i].normal, step);
    for (const TetherOutcome& line : solution_.lines)
        if (line.state == TetherState::held) begin_j += glm::dot(line.force_n, step);
    for (const TetherOutcome& point : solution_.points)
        if (point.state == TetherState::held) begin_j += glm::dot(point.force_n, step);
    const double rise_j = glm::dot(step, stiffness * step + tissue_ * step);
    if (!(begin_j < 0.0) || !(begin_j + rise_j + bends_at_end_j > 0.0)) return 1.0;
    // The sum is of straight pieces: Illinois' rule finds its zero in few steps.
    double low = 0.0, high = 1.0, at_low_j = begin_j, at_high_j = begin_j + rise_j + bends_at_end_j;
    int side = 0; // the end that moved last
    for (int i = 0; i < kBalanceSteps && high - low > kBalanced; ++i) {
        const double share = low + (high - low) * (at_low_j / (at_low_j - at_high_j));
        if (!(share > low) || !(share < high)) break;
        const double at_j = begin_j + share * rise_j + bends_j(share);
        const bool beyond = at_j > 0.0;
        (beyond ? high : low) = share;
        (beyond ? at_high_j : at_low_j) = at_j;
        if (side == (beyond ? 1 : -1)) (beyond ? at_low_j : at_high_j) *= 0.5;
        side = beyond ? 1 : -1;
    }
    return low;
}

/// Lets a front follow the tip, and finds what presses there.
void Subdivision::press(Layer& layer, const Vec3& tip) noexcept {
    if (layer.law.coupling() != frame_.stiffness)
        layer.law = PressLaw(layer.softness, frame_.stiffness);
    FrameContext follows = frame_;
    follows.probe = tip;
    // Gains go on once a frame.
    follows.period_s = budget_.evaluations == 0 ? frame_.period_s : 0.0;
    for (int i = 0; i < kMostFollows; ++i) {
        follows.start = layer.y;
        const SubdivisionResult front = layer.front->advance(follows);
        budget_.work_left -= static_cast<int>(front.work);
        layer.flags = (layer.flags & kOnceInAFrame) | front.flags;
        layer.gave_way |= layer.front->surfaces_.front().yields();
        if (is_a_place(front.proxy)) layer.y = front.proxy;
        follows.period_s = 0.0;
        if (!(front.flags & kEvaluationCap)) break;
    }
    const Vec3 way = layer.y - tip;
    layer.indentation_m = glm::length(way);
    layer.force_n = layer.slope_n_per_m = 0.0;
    if (!(layer.indentation_m > kNoDirection_m)) return;
    layer.normal = way / layer.indentation_m;
    const PressLaw::Tissue tissue = layer.law.tissue(layer.indentation_m);
    const double viscous = frame_.after_silence ? 0.0 : layer.softness.damping / frame_.period_s;
    double force_n = tissue.force_n;
    layer.slope_n_per_m = tissue.slope_n_per_m;
    if (viscous > 0.0 && !layer.gave_way) { // of a front's own way the damper feels nothing
        force_n += viscous * (layer.indentation_m - layer.tissue_m);
        layer.slope_n_per_m += viscous;
    }
    if (!(force_n > 0.0)) return; // the tip leaves faster than the tissue comes back
    layer.force_n = force_n;
}

/// By how much the force on the tip falls with its step, N/m: F' n n^T + F H. H says how the front
/// turns as it follows: it is bound across the planes that hold it, and along one plane of
/// curvature h it follows by 1 / (1 + d h) of the way.
Mat3 Subdivision::turning_of(const Layer& layer) const noexcept {
    const Vec3& n = layer.normal;
    const double d = layer.indentation_m;
    const Mat3 along = layer.slope_n_per_m * glm::outerProduct(n, n);
    const Subdivision& front = *layer.front;
    std::size_t holding = 0, last = 0;
    for (std::size_t i = 0; i < front.contacts_.size(); ++i) {
        if (front.solution_.planes[i].state == MultiplierState::released) continue;
        ++holding;
        last = i;
    }
    if (holding != 1) return along; // an edge or a corner: taken as flat
    const Mat3 basis = internal::across_of(n);
    const Vec3 &t = basis[0], &b = basis[1];
    const Mat3& hessian = front.contacts_[last].depth_hessian;
    const double h00 = glm::dot(t, hessian * t), h11 = glm::dot(b, hessian * b);
    const double h01 = 0.5 * (glm::dot(t, hessian * b) + glm::dot(b, hessian * t));
    const double m00 = 1.0 + d * h00, m11 = 1.0 + d * h11, m01 = d * h01;
    const double det = m00 * m11 - m01 * m01;
    if (!(m00 > kFocus) || !(det > kFocus * m00)) return along;
    // h (1 + d h)^-1; the two commute.
    const double c00 = (h00 * m11 - h01 * m01) / det, c01 = (h01 * m00 - h00 * m01) / det;
    const double c11 = (h11 * m00 - h01 * m01) / det;
    const Mat3 turns = c00 * glm::outerProduct(t, t) + c11 * glm::outerProduct(b, b) +
                       c01 * (glm::outerProduct(t, b) + glm::outerProduct(b, t));
    return along + layer.force_n * turns;
}

void Subdivision::commit_layers(const Vec3& tip) noexcept {
    pressed_ = {0.0, 0.0, tip};
    // In silence it has come back for nobody knows how long.
    const double lasts_s =
        frame_.after_silence ? std::numeric_limits<double>::infinity() : frame_.period_s;
    for (Layer& layer : layers_) {
        const bool pushes = layer.force_n > 0.0;
        layer.pushes = pushes;
        if (!pushes) layer.front->surfaces_.front().let_go();
        result_.flags |= layer.flags & (kOnceInAFrame | kAtItsEnd);
        if (pushes) {
            layer.touched_at = tip;
            layer.touched_normal = layer.normal;
        }
        result_.felt |= bit_of(layer.surface, pushes);
        result_.contacts += pushes ? 1 : 0;
        if (layer.front->result_.open & 1U) result_.open |= bit_of(layer.surface, true);
        if (layer.front->result_.guarded & 1U) result_.guarded |= bit_of(layer.surface, true);
        layer.tissue_m =
            pushes
                ? layer.indentation_m
                : layer.law.damped(0.0, layer.tissue_m, layer.softness.damping, lasts_s).tissue_m;
        if (!(layer.indentation_m > pressed_.indentation_m)) continue; // a dent, too
        const double slope = layer.law.tissue(layer.indentation_m).slope_n_per_m;
        const double felt = slope > 0.0 ? 1.0 / (1.0 / slope + 1.0 / frame_.stiffness) : 0.0;
        pressed_ = {layer.indentation_m, felt, layer.y, static_cast<std::uint32_t>(layer.surface)};
    }
}

Touch Subdivision::touch_of(const Layer& layer) const noexcept {
    Touch touch;
    touch.surface = static_cast<std::uint32_t>(layer.surface);
    touch.point = layer.y;
    touch.normal = layer.normal;
    if (!layer.pushes) {
        touch.phase = Touch::Phase::ended;
        touch.point = layer.touched_at;
        touch.normal = layer.touched_normal;
        return touch;
    }
    touch.phase = layer.pushed_before ? Touch::Phase::goes_on : Touch::Phase::began;
    touch.force = layer.force_n * layer.normal;
    return touch;
}

} // namespace palpate
