// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/internal/scene_loop.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/loop/device_safety.h>
#include <palpate/engine/loop/internal/frame_arithmetic.h>
#include <palpate/engine/loop/internal/surface_identity.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/internal/plan_warnings.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/scene/validation.h>
#include <palpate/geometry/range.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/stepping/stepping_settings.h>

namespace palpate::internal {
namespace {

// Beyond this no scene reaches, and Embree's float32 would overflow.
constexpr double kProbeRange = SurfaceScene::kQueryRange;

SteppingSettings stepping(const LoopDescription& loop) {
    SteppingSettings settings;
    settings.method = loop.method;
    settings.sub_steps = loop.sub_steps;
    settings.budget_us = budget_of(loop);
    // The smallest numbers there are would come to 0 m.
    settings.tolerance_m = std::max(1e-6 * loop.tolerance_um, std::numeric_limits<double>::min());
    settings.evaluation_cap = loop.evaluation_cap;
    return settings;
}

template <class Owners>
auto pointers(const Owners& owners) {
    std::vector<typename Owners::value_type::element_type*> result;
    result.reserve(owners.size());
    for (const auto& owner : owners)
        result.push_back(owner.get());
    return result;
}

/// What is sampled less than twice a period is another tone. A scene refuses it at its own rate.
void check_tones(const std::vector<FeltEffect>& effects, double rate_hz) {
    for (const FeltEffect& felt : effects)
        if (const double tone_hz = felt.effect->highest_tone_hz(); !(2.0 * tone_hz < rate_hz))
            throw std::invalid_argument(
                fmt::format("{}: its tone of {} Hz is not below half of the loop's rate_hz = {}; "
                            "lower it, or raise the rate",
                            felt.name, tone_hz, rate_hz));
}

/// The scene, once all that the loop is made of has been checked.
std::shared_ptr<const Scene> checked(std::shared_ptr<const Scene> scene,
                                     const LoopDescription& loop, const DeviceProperties& device,
                                     const CustomEffects& custom) {
    validate(loop);
    validate(device);
    for (std::size_t i = 0; i < custom.size(); ++i)
        if (!custom[i])
            throw std::invalid_argument("custom[" + std::to_string(i) +
                                        "] is null; give an effect, or leave it out");
    check_soft_in_loop(*required("scene", scene), loop.method, custom);
    return scene;
}

bool in_range(const Vec3& p) noexcept {
    return is_finite(p) && squared_length(p) < kProbeRange * kProbeRange;
}

} // namespace

SceneLoop::SceneLoop(std::shared_ptr<const Scene> scene, Clock& clock, const LoopDescription& loop,
                     const DeviceProperties& device, const CustomEffects& custom)
    : scene_(checked(std::move(scene), loop, device, custom)), loop_(loop), clock_(clock),
      felt_(scene_->make_parts()), custom_(custom), effects_(pointers(felt_.effects)),
      coupling_(safe_coupling(scene_->description().coupling, loop.rate_hz, device).coupling),
      safety_(
          safety_settings(scene_->description().limits, loop.rate_hz, coupling_.stiffness, device)),
      has_motors_(device.force_n > 0.0),
      estimates_velocity_(device.force_n > 0.0 &&
                          device.velocity_source == VelocitySource::positions),
      velocity_estimator_({.step_m = device.position_step_m, .period_s = 1.0 / loop.rate_hz}),
      period_s_(1.0 / loop.rate_hz), statuses_(*scene_), identities_(surface_identities(*scene_)),
      surfaces_after_(felt_.contacts.size()) {
    const std::vector<Effect*> customs = pointers(custom_);
    effects_.insert(effects_.begin() + static_cast<std::ptrdiff_t>(effects_before_limits()),
                    customs.begin(), customs.end());
    check_tones(named_effects(), loop.rate_hz);
    effects_after_.resize(effects_.size());
    subdivision_ = std::make_unique<Subdivision>(stepping(loop), pointers(felt_.contacts), effects_,
                                                 clock_, std::move(felt_.finish));
    has_softness_ = subdivision_->has_softness();
    gains_ = gains_of_effects();
}

void SceneLoop::go_on_from(SceneLoop& before) noexcept {
    const FrameArithmetic arithmetic;
    constexpr std::size_t kNew = Subdivision::Heritage::kNew;
    for (std::size_t i = 0; i < identities_.size(); ++i) {
        const auto& theirs = before.identities_;
        const auto found =
            std::find_if(theirs.begin(), theirs.end(), [&](const SurfaceIdentity& their) {
                return identities_[i].goes_on_from(their);
            });
        surfaces_after_[i] =
            found == theirs.end() ? kNew : static_cast<std::size_t>(found - theirs.begin());
    }
    const std::size_t first = effects_before_limits(), theirs = before.effects_before_limits();
    for (std::size_t i = 0; i < effects_.size(); ++i) {
        const bool custom = i >= first && i < first + custom_.size();
        effects_after_[i] = custom ? theirs + (i - first) : kNew;
    }
    subdivision_->observe(before.subdivision_->observer());
    safety_ = before.safety_;
    velocity_estimator_ = before.velocity_estimator_;
    frames_ = before.frames_;
    counted_ = queries();
    started_ = before.started_;
    silent_ = before.silent_;
    trial_ = before.trial_;
    Vec3 proxy = before.proxy_;
    const std::uint32_t found =
        subdivision_->go_on_from(*before.subdivision_, {surfaces_after_, effects_after_}, proxy);
    flags_of_adoption_ = before.flags_of_adoption_ | kSceneAdopted;
    if (started_) flags_of_adoption_ |= found; // else the trial that begins says it for itself
    // What keeps a front of its own goes on from there, and its tip stays where it was.
    proxy_ = subdivision_->keeps_front() ? before.proxy_ : proxy;
    unbroken_ = false;
}

void SceneLoop::take_gains_of_custom(const SceneLoop& of) noexcept {
    const std::size_t first = gains_.size() - custom_.size();
    const std::size_t theirs = of.gains_.size() - custom_.size();
    for (std::size_t i = 0; i < custom_.size(); ++i)
        gains_[first + i]->set(of.gains_[theirs + i]->wanted());
}

std::vector<GainRamp*> SceneLoop::gains_of_effects() const {
    const std::vector<EffectDescription>& effects = scene_->description().effects;
    std::vector<GainRamp*> gains(effects.size());
    for (const PlannedEffect& planned : scene_->plan().effects) {
        const EffectDescription& effect = effects[planned.effect];
        const std::optional<SurfacePart> part = traits_of(effect).part;
        if (!planned.on || !part) continue;
        for (std::size_t i = 0; i < scene_->surfaces().size(); ++i)
            if (scene_->surfaces()[i].name == surface_of(effect))
                gains[planned.effect] = &subdivision_->gain(i, *part);
    }
    const std::size_t before = effects_before_limits();
    for (std::size_t i = 0; i < scene_->effect_order().size(); ++i)
        gains[scene_->effect_order()[i]] = &subdivision_->gain(i < before ? i : i + custom_.size());
    for (std::size_t i = 0; i < custom_.size(); ++i)
        gains.push_back(&subdivision_->gain(before + i));
    return gains;
}

/// Of the scene's effects in their order: limits come last, as they go by what all others draw.
std::size_t SceneLoop::effects_before_limits() const {
    const std::vector<std::size_t>& order = scene_->effect_order();
    const auto is_limit = [&](std::size_t effect) {
        return traits_of(scene_->description().effects[effect]).turn == EffectTurn::limits;
    };
    return static_cast<std::size_t>(std::find_if(order.begin(), order.end(), is_limit) -
                                    order.begin());
}

/// Whether it is a workspace without which the proxy could come to what the plan left out.
bool SceneLoop::keeps_from_surfaces(std::size_t effect) const noexcept {
    const std::vector<EffectDescription>& effects = scene_->description().effects;
    return scene_->plan().relies_on_workspace && effect < effects.size() &&
           traits_of(effects[effect]).turn == EffectTurn::limits;
}

bool SceneLoop::set_gain(std::size_t effect, double gain) noexcept {
    const FrameArithmetic arithmetic;
    if (effect >= gains_.size() || !gains_[effect] || !GainRamp::in_range(gain)) return false;
    if (gain < 1.0 && keeps_from_surfaces(effect)) return false;
    gains_[effect]->set(gain);
    return true;
}

bool SceneLoop::set_pose(std::size_t surface, const RigidPose& pose) noexcept {
    const FrameArithmetic arithmetic;
    MovingSurface* body = body_of(surface);
    const double length = glm::length(pose.orientation);
    if (!body || !in_range(pose.position) || !(length > 0.0) || !std::isfinite(length))
        return false;
    body->set_pose({pose.position, pose.orientation / length});
    return true;
}

RigidPose SceneLoop::pose(std::size_t surface) const noexcept {
    const MovingSurface* body = body_of(surface);
    return body ? body->pose() : RigidPose{};
}

MovingSurface* SceneLoop::body_of(std::size_t surface) const noexcept {
    const bool known = surface < felt_.contacts.size();
    return known ? subdivision_->surface(surface).moving() : nullptr;
}

Wrench SceneLoop::wrench(std::size_t surface) const noexcept {
    const FrameArithmetic arithmetic;
    Wrench wrench;
    if (!moved_) return wrench;
    TouchList touches;
    subdivision_->find_touches(touches);
    const Vec3 origin = pose(surface).position;
    for (const Touch& touch : touches) {
        if (touch.surface != surface) continue;
        wrench.force -= touch.force;
        wrench.torque -= glm::cross(touch.point - origin, touch.force);
    }
    return wrench;
}

std::vector<FeltEffect> SceneLoop::named_effects() const {
    std::vector<FeltEffect> effects;
    const std::vector<std::size_t>& order = scene_->effect_order();
    const std::size_t before = effects_before_limits(), custom_count = custom_.size();
    for (std::size_t i = 0; i < effects_.size(); ++i) {
        const bool custom = i >= before && i < before + custom_count;
        const std::size_t number = custom ? i - before : order[i < before ? i : i - custom_count];
        effects.push_back(
            {custom ? "custom effect " + std::to_string(number + 1) : effect_name(*scene_, number),
             effects_[i]});
    }
    return effects;
}

std::vector<std::string> SceneLoop::warnings() const {
    std::vector<std::string> lines = warnings_of(*scene_, named_effects(), safety_.force_n());
    // Where the scene itself is of that method, scene_warnings() has said so.
    const std::string& uncertified = scene_->plan().uncertified;
    const bool is_ours = loop_.method == SteppingMethod::adaptive &&
                         scene_->description().loop.method != SteppingMethod::adaptive;
    if (is_ours && !uncertified.empty()) lines.push_back(uncertified);
    return lines;
}

FrameReport SceneLoop::frame(const DeviceState& device, std::span<const std::uint32_t> steps_left,
                             double began_us) noexcept {
    const FrameArithmetic arithmetic;

    FrameReport report;
    report.frame = frames_++;
    report.trial = device.trial;
    report.time_s = device.time_s;
    report.probe = device.position;
    report.flags = std::exchange(flags_of_adoption_, 0);
    computed_ = moved_ = false;

    if (!in_range(device.position)) {
        report.flags |= kProbeNotFinite;
        report.force = release(report.flags);
    } else if (device.freshness == Freshness::stale) {
        report.flags |= kDeviceStale;
        report.force = release(report.flags);
    } else {
        const Vec3 probe_velocity = velocity(device);
        const Vec3 wanted = wanted_force(device, probe_velocity, steps_left, report);
        if (has_motors_)
            safety_.expect(subdivision_->unasked_force_n(safety_.force_n()),
                           subdivision_->is_active());
        report.force = report.flags & kForceNotFinite
                           ? safety_.fade(report.flags)
                           : safety_.send(wanted, device.position, probe_velocity, report.flags);
    }
    report.proxy = proxy_;
    if (has_softness_) report_pressed(report);

    const QueryCount before = std::exchange(counted_, queries());
    const QueryCount made = counted_ - before;
    report.field_samples = static_cast<std::uint32_t>(made.field_samples);
    report.root_queries = static_cast<std::uint32_t>(made.roots);
    report.surface_queries = static_cast<std::uint32_t>(made.surface_queries);
    report.estimate_us = subdivision_->estimate_us();
    report.spent_us = clock_.now_us() - began_us;
    return report;
}

Vec3 SceneLoop::release() noexcept {
    const FrameArithmetic arithmetic;
    std::uint32_t flags = 0;
    return release(flags);
}

Vec3 SceneLoop::release(std::uint32_t& flags) noexcept {
    silent_ = true;
    velocity_estimator_.restart();
    return safety_.fade(flags);
}

Vec3 SceneLoop::velocity(const DeviceState& device) noexcept {
    if (!estimates_velocity_) return device.velocity;
    if (started_ && device.trial != trial_) velocity_estimator_.restart(); // elsewhere, at any time
    return velocity_estimator_.update(device.time_s, device.position);
}

Vec3 SceneLoop::wanted_force(const DeviceState& device, const Vec3& velocity,
                             std::span<const std::uint32_t> steps_left,
                             FrameReport& report) noexcept {
    const Vec3 start = proxy_;
    // Over a trial's beginning, silence or another scene the proxy has no velocity: no damping.
    const bool goes_on = unbroken_ && device.trial == trial_ && !silent_;
    move_proxy(device, steps_left, report);
    unbroken_ = moved_;
    const Vec3 proxy_velocity = goes_on ? (proxy_ - start) / period_s_ : velocity;
    const Vec3 force =
        coupling_force(coupling_, device.position, proxy_, velocity, proxy_velocity); // (3)
    return subdivision_->with_device_forces(force);
}

void SceneLoop::move_proxy(const DeviceState& device, std::span<const std::uint32_t> steps_left,
                           FrameReport& report) noexcept {
    if (!started_ || device.trial != trial_) {
        started_ = true;
        trial_ = device.trial;
        proxy_ = device.position;
        report.flags &= ~std::uint32_t{kInsideAtStart}; // where an adopted scene found the proxy
        report.flags |= subdivision_->restart(proxy_);
    }
    const FrameContext context{device.position,     proxy_,
                               coupling_.stiffness, period_s_,
                               safety_.force_n(),   std::exchange(silent_, false)};
    const Vec3 held = subdivision_->front(proxy_); // where it is, if this frame leads nowhere
    const SubdivisionResult result = subdivision_->advance(context, steps_left);
    computed_ = true;
    moved_ = in_range(result.proxy);
    if (moved_) {
        proxy_ = result.proxy;
    } else { // held, and felt from there as at a trial's beginning
        proxy_ = held;
        report.flags |= kForceNotFinite | subdivision_->restart(proxy_);
    }
    report.sub_steps = result.sub_steps;
    report.evaluations = result.evaluations;
    report.contacts = result.contacts;
    report.residual_m = result.residual_m;
    report.surfaces_felt = result.felt;
    report.surfaces_open = result.open;
    report.surfaces_guarded = result.guarded;
    report.work = result.work;
    report.flags |= result.flags;
}

/// Of a soft surface: how it is pressed, also where the proxy is held. Apart, so that frames of
/// hard surfaces do not pay for it.
[[gnu::noinline]] void SceneLoop::report_pressed(FrameReport& report) const noexcept {
    const Subdivision::Pressed& pressed = subdivision_->pressed();
    report.indentation_m = pressed.indentation_m;
    report.stiffness_n_per_m = pressed.slope_n_per_m;
    report.front = pressed.front;
    report.pressed_surface = pressed.surface;
}

QueryCount SceneLoop::queries() const noexcept {
    QueryCount total;
    for (const auto& contact : felt_.contacts)
        total += contact->queries();
    for (const Effect* effect : effects_)
        total += effect->queries();
    return total += subdivision_->queries();
}

LoopMake SceneLoop::make() const {
    return {scene_,
            loop_,
            coupling_,
            safety_.settings(),
            velocity_estimator_.settings(),
            has_motors_,
            estimates_velocity_};
}

LoopState SceneLoop::save() const {
    return LoopState(std::make_shared<const LoopStateParts>(
        LoopStateParts{make(), subdivision_->save_state(), felt_.fields.save_state(), safety_,
                       velocity_estimator_, frames_, queries() - counted_, started_, silent_,
                       unbroken_, trial_, proxy_, flags_of_adoption_}));
}

void SceneLoop::restore(const LoopState& state) {
    const FrameArithmetic arithmetic;
    if (!state.parts()) throw std::invalid_argument("restore: the state was moved elsewhere");
    const LoopStateParts& from = *state.parts();
    require_same_make(from.make, make());
    subdivision_->restore_state(from.subdivision);
    felt_.fields.restore_state(from.fields);
    safety_ = from.safety;
    velocity_estimator_ = from.velocity_estimator;
    frames_ = from.frames;
    counted_ = queries() - from.uncounted; // counters go on: a report tells differences
    started_ = from.started;
    silent_ = from.silent;
    unbroken_ = from.unbroken;
    trial_ = from.trial;
    proxy_ = from.proxy;
    flags_of_adoption_ = from.flags_of_adoption;
    computed_ = moved_ = false;
}

std::span<const Touch> SceneLoop::touches() noexcept {
    const FrameArithmetic arithmetic;
    touches_.clear();
    if (moved_) subdivision_->find_touches(touches_);
    return {touches_.begin(), touches_.size()};
}

std::span<const SurfaceStatus> SceneLoop::surface_states() noexcept {
    const FrameArithmetic arithmetic;
    if (!started_) return {};
    return statuses_.of(*subdivision_, proxy_);
}

} // namespace palpate::internal
