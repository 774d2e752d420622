// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/haptic_loop.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include <palpate/engine/loop/device_safety.h>
#include <palpate/engine/loop/internal/loop_state_parts.h>
#include <palpate/engine/loop/internal/surface_statuses.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/internal/plan_warnings.h>
#include <palpate/engine/scene/loop_parts.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/validation.h>
#include <palpate/geometry/range.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/hand/velocity_estimator.h>
#include <palpate/haptics/stepping/stepping_settings.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate {
namespace {

// Beyond this no scene reaches, and Embree's float32 would overflow.
constexpr double kProbeRange = SurfaceScene::kQueryRange;

/// Denormal numbers cost hundreds of cycles each: flushed to zero within a frame, the caller's mode
/// restored after it.
class FlushDenormals {
public:
#if defined(__x86_64__)
    FlushDenormals() noexcept : saved_(_mm_getcsr()) {
        _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero);
    }
    ~FlushDenormals() { _mm_setcsr(saved_); }

private:
    static constexpr unsigned kFlushToZero = 0x8000;
    static constexpr unsigned kDenormalsAreZero = 0x0040;
    unsigned saved_;
#else
    FlushDenormals() noexcept {}
#endif
};

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

template <class T>
std::vector<T*> pointers(const std::vector<std::unique_ptr<T>>& owners) {
    std::vector<T*> result;
    result.reserve(owners.size());
    for (const std::unique_ptr<T>& owner : owners)
        result.push_back(owner.get());
    return result;
}

/// The scene, once all that the loop is made of has been checked.
std::shared_ptr<const Scene> checked(std::shared_ptr<const Scene> scene,
                                     const LoopDescription& loop, const DeviceProperties& device,
                                     const std::vector<std::unique_ptr<Effect>>& custom) {
    validate(loop);
    validate(device);
    for (std::size_t i = 0; i < custom.size(); ++i)
        if (!custom[i])
            throw std::invalid_argument("custom[" + std::to_string(i) +
                                        "] is null; give an effect, or leave it out");
    return required("scene", std::move(scene));
}

bool in_range(const Vec3& p) noexcept {
    return is_finite(p) && squared_length(p) < kProbeRange * kProbeRange;
}

} // namespace

class HapticLoop::Parts {
public:
    Parts(std::shared_ptr<const Scene> scene, Clock& clock, const LoopDescription& loop,
          const DeviceProperties& device, std::vector<std::unique_ptr<Effect>> custom);

    FrameReport frame(const DeviceState& device,
                      std::span<const std::uint32_t> steps_left) noexcept;
    Vec3 release() noexcept;
    std::vector<std::string> warnings() const;
    bool set_gain(std::size_t effect, double gain) noexcept;
    LoopState save() const;
    void restore(const LoopState& state);

    const VirtualCoupling& coupling() const noexcept { return coupling_; }
    const Subdivision& subdivision() const noexcept { return *subdivision_; }
    std::span<const Touch> touches() noexcept;
    std::span<const SurfaceStatus> surface_states() noexcept;
    std::size_t effect_count() const noexcept { return gains_.size(); }

private:
    std::size_t effects_before_limits() const;
    bool keeps_from_surfaces(std::size_t effect) const noexcept;
    std::vector<GainRamp*> gains_of_effects(std::size_t custom_count) const;
    void move_proxy(const DeviceState& device, std::span<const std::uint32_t> steps_left,
                    FrameReport& report) noexcept;
    Vec3 release(std::uint32_t& flags) noexcept;
    Vec3 wanted_force(const DeviceState& device, const Vec3& velocity,
                      std::span<const std::uint32_t> steps_left, FrameReport& report) noexcept;
    Vec3 velocity(const DeviceState& device) noexcept;
    QueryCount queries() const noexcept;
    internal::LoopMake make() const;

    std::shared_ptr<const Scene> scene_;
    LoopDescription loop_;
    Clock& clock_;
    LoopParts felt_;
    std::unique_ptr<Subdivision> subdivision_;
    std::vector<GainRamp*> gains_; // of each effect of the scene, then of the custom ones; null:
                                   // the plan left it out
    VirtualCoupling coupling_;
    SafetyChain safety_;
    bool has_motors_;
    bool estimates_velocity_;
    VelocityEstimator velocity_estimator_;
    double period_s_;

    std::uint64_t frames_ = 0;
    QueryCount counted_; // up to the last frame's end
    bool started_ = false;
    bool silent_ = false; // since the last frame that the device had a place for
    std::uint32_t trial_ = 0;
    Vec3 proxy_{0.0};

    bool moved_ = false; // in the last frame: subdivision_ has its touches
    TouchList touches_;  // as they were asked for last
    internal::SurfaceStatuses statuses_;
};

HapticLoop::Parts::Parts(std::shared_ptr<const Scene> scene, Clock& clock,
                         const LoopDescription& loop, const DeviceProperties& device,
                         std::vector<std::unique_ptr<Effect>> custom)
    : scene_(checked(std::move(scene), loop, device, custom)), loop_(loop), clock_(clock),
      felt_(scene_->make_parts()),
      coupling_(safe_coupling(scene_->description().coupling, loop.rate_hz, device).coupling),
      safety_(
          safety_settings(scene_->description().limits, loop.rate_hz, coupling_.stiffness, device)),
      has_motors_(device.force_n > 0.0),
      estimates_velocity_(device.force_n > 0.0 &&
                          device.velocity_source == VelocitySource::positions),
      velocity_estimator_({device.position_step_m}), period_s_(1.0 / loop.rate_hz),
      statuses_(*scene_) {
    const std::size_t custom_count = custom.size();
    felt_.effects.insert(
        felt_.effects.begin() + static_cast<std::ptrdiff_t>(effects_before_limits()),
        std::make_move_iterator(custom.begin()), std::make_move_iterator(custom.end()));
    subdivision_ =
        std::make_unique<Subdivision>(stepping(loop), pointers(felt_.contacts),
                                      pointers(felt_.effects), clock_, std::move(felt_.finish));
    gains_ = gains_of_effects(custom_count);
}

std::vector<GainRamp*> HapticLoop::Parts::gains_of_effects(std::size_t custom_count) const {
    const std::vector<EffectDescription>& effects = scene_->description().effects;
    std::vector<GainRamp*> gains(effects.size());
    for (const PlannedEffect& planned : scene_->plan().effects) {
        const EffectDescription& effect = effects[planned.effect];
        const std::optional<SurfacePart> part = internal::traits_of(effect).part;
        if (!planned.on || !part) continue;
        for (std::size_t i = 0; i < scene_->surfaces().size(); ++i)
            if (scene_->surfaces()[i].name == surface_of(effect))
                gains[planned.effect] = &subdivision_->gain(i, *part);
    }
    const std::size_t before = effects_before_limits();
    for (std::size_t i = 0; i < scene_->effect_order().size(); ++i)
        gains[scene_->effect_order()[i]] = &subdivision_->gain(i < before ? i : i + custom_count);
    for (std::size_t i = 0; i < custom_count; ++i)
        gains.push_back(&subdivision_->gain(before + i));
    return gains;
}

/// Of the scene's effects in their order: limits come last, as they go by what all others draw.
std::size_t HapticLoop::Parts::effects_before_limits() const {
    const std::vector<std::size_t>& order = scene_->effect_order();
    const auto is_limit = [&](std::size_t effect) {
        return internal::traits_of(scene_->description().effects[effect]).turn ==
               internal::EffectTurn::limits;
    };
    return static_cast<std::size_t>(std::find_if(order.begin(), order.end(), is_limit) -
                                    order.begin());
}

/// Whether it is a workspace without which the proxy could come to what the plan left out.
bool HapticLoop::Parts::keeps_from_surfaces(std::size_t effect) const noexcept {
    const std::vector<EffectDescription>& effects = scene_->description().effects;
    return scene_->plan().relies_on_workspace && effect < effects.size() &&
           internal::traits_of(effects[effect]).turn == internal::EffectTurn::limits;
}

bool HapticLoop::Parts::set_gain(std::size_t effect, double gain) noexcept {
    if (effect >= gains_.size() || !gains_[effect] || !GainRamp::in_range(gain)) return false;
    if (gain < 1.0 && keeps_from_surfaces(effect)) return false;
    gains_[effect]->set(gain);
    return true;
}

std::vector<std::string> HapticLoop::Parts::warnings() const {
    std::vector<internal::FeltEffect> effects;
    const std::vector<std::size_t>& order = scene_->effect_order();
    const std::size_t scene_count = order.size(), before = effects_before_limits();
    const std::size_t custom_count = felt_.effects.size() - scene_count;
    for (std::size_t i = 0; i < felt_.effects.size(); ++i) {
        const bool custom = i >= before && i < before + custom_count;
        const std::size_t number = custom ? i - before : order[i < before ? i : i - custom_count];
        effects.push_back({custom ? "custom effect " + std::to_string(number + 1)
                                  : internal::effect_name(*scene_, number),
                           felt_.effects[i].get()});
    }
    return internal::warnings_of(*scene_, effects);
}

FrameReport HapticLoop::Parts::frame(const DeviceState& device,
                                     std::span<const std::uint32_t> steps_left) noexcept {
    const FlushDenormals flush_denormals;
    const double began_us = clock_.now_us();

    FrameReport report;
    report.frame = frames_++;
    report.trial = device.trial;
    report.time_s = device.time_s;
    report.probe = device.position;
    moved_ = false;

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

    const QueryCount before = std::exchange(counted_, queries());
    const QueryCount made = counted_ - before;
    report.field_samples = static_cast<std::uint32_t>(made.field_samples);
    report.root_queries = static_cast<std::uint32_t>(made.roots);
    report.surface_queries = static_cast<std::uint32_t>(made.surface_queries);
    report.estimate_us = subdivision_->estimate_us();
    report.spent_us = clock_.now_us() - began_us;
    return report;
}

Vec3 HapticLoop::Parts::release() noexcept {
    std::uint32_t flags = 0;
    return release(flags);
}

Vec3 HapticLoop::Parts::release(std::uint32_t& flags) noexcept {
    silent_ = true;
    velocity_estimator_.restart();
    return safety_.fade(flags);
}

Vec3 HapticLoop::Parts::velocity(const DeviceState& device) noexcept {
    return estimates_velocity_ ? velocity_estimator_.update(device.time_s, device.position)
                               : device.velocity;
}

Vec3 HapticLoop::Parts::wanted_force(const DeviceState& device, const Vec3& velocity,
                                     std::span<const std::uint32_t> steps_left,
                                     FrameReport& report) noexcept {
    const Vec3 start = started_ && device.trial == trial_ ? proxy_ : device.position;
    move_proxy(device, steps_left, report);
    const Vec3 proxy_velocity = (proxy_ - start) / period_s_;
    const Vec3 force =
        coupling_force(coupling_, device.position, proxy_, velocity, proxy_velocity); // (3)
    return subdivision_->with_device_forces(force);
}

void HapticLoop::Parts::move_proxy(const DeviceState& device,
                                   std::span<const std::uint32_t> steps_left,
                                   FrameReport& report) noexcept {
    if (!started_ || device.trial != trial_) {
        started_ = true;
        trial_ = device.trial;
        proxy_ = device.position;
        report.flags |= subdivision_->restart(proxy_);
    }
    const FrameContext context{device.position,     proxy_,
                               coupling_.stiffness, period_s_,
                               safety_.force_n(),   std::exchange(silent_, false)};
    const SubdivisionResult result = steps_left.empty()
                                         ? subdivision_->advance(context)
                                         : subdivision_->advance(context, steps_left);
    moved_ = in_range(result.proxy);
    if (moved_) {
        proxy_ = result.proxy;
    } else { // held, and felt from there as at a trial's beginning
        report.flags |= kForceNotFinite | subdivision_->restart(proxy_);
    }
    report.sub_steps = result.sub_steps;
    report.evaluations = result.evaluations;
    report.contacts = result.contacts;
    report.residual_m = result.residual_m;
    report.surfaces_felt = result.felt;
    report.surfaces_open = result.open;
    report.surfaces_guarded = result.guarded;
    report.flags |= result.flags;
}

QueryCount HapticLoop::Parts::queries() const noexcept {
    QueryCount total;
    for (const auto& contact : felt_.contacts)
        total += contact->queries();
    for (const auto& effect : felt_.effects)
        total += effect->queries();
    return total += subdivision_->queries();
}

internal::LoopMake HapticLoop::Parts::make() const {
    return {scene_,
            loop_,
            coupling_,
            safety_.settings(),
            velocity_estimator_.settings(),
            has_motors_,
            estimates_velocity_};
}

LoopState HapticLoop::Parts::save() const {
    return LoopState(std::make_shared<const internal::LoopStateParts>(internal::LoopStateParts{
        make(), subdivision_->save_state(), felt_.fields.save_state(), safety_, velocity_estimator_,
        frames_, queries() - counted_, started_, silent_, trial_, proxy_}));
}

void HapticLoop::Parts::restore(const LoopState& state) {
    if (!state.parts()) throw std::invalid_argument("restore: the state was moved elsewhere");
    const internal::LoopStateParts& from = *state.parts();
    internal::require_same_make(from.make, make());
    subdivision_->restore_state(from.subdivision);
    felt_.fields.restore_state(from.fields);
    safety_ = from.safety;
    velocity_estimator_ = from.velocity_estimator;
    frames_ = from.frames;
    counted_ = queries() - from.uncounted; // counters go on: a report tells differences
    started_ = from.started;
    silent_ = from.silent;
    trial_ = from.trial;
    proxy_ = from.proxy;
    moved_ = false;
}

std::span<const Touch> HapticLoop::Parts::touches() noexcept {
    touches_.clear();
    if (moved_) subdivision_->find_touches(touches_);
    return {touches_.begin(), touches_.size()};
}

std::span<const SurfaceStatus> HapticLoop::Parts::surface_states() noexcept {
    if (!started_) return {};
    return statuses_.of(*subdivision_, proxy_);
}

// ---- the loop: its parts, asked from outside ---------------------------------------------------

HapticLoop::HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
                       std::vector<std::unique_ptr<Effect>> custom)
    : HapticLoop(scene, clock, required("scene", scene)->description().loop, std::move(custom)) {}

HapticLoop::HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
                       const LoopDescription& loop, std::vector<std::unique_ptr<Effect>> custom)
    : HapticLoop(std::move(scene), clock, loop, DeviceProperties{}, std::move(custom)) {}

HapticLoop::HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
                       const LoopDescription& loop, const DeviceProperties& device,
                       std::vector<std::unique_ptr<Effect>> custom)
    : parts_(std::make_unique<Parts>(std::move(scene), clock, loop, device, std::move(custom))) {}

HapticLoop::~HapticLoop() = default;

FrameReport HapticLoop::frame(const DeviceState& device) noexcept {
    return parts_->frame(device, {});
}

FrameReport HapticLoop::frame(const DeviceState& device,
                              std::span<const std::uint32_t> steps_left) noexcept {
    return parts_->frame(device, steps_left);
}

Vec3 HapticLoop::release() noexcept { return parts_->release(); }

LoopState HapticLoop::save() const { return parts_->save(); }

void HapticLoop::restore(const LoopState& state) { parts_->restore(state); }

std::vector<std::string> HapticLoop::warnings() const { return parts_->warnings(); }

const VirtualCoupling& HapticLoop::coupling() const noexcept { return parts_->coupling(); }

std::span<const Vec3> HapticLoop::path() const noexcept { return parts_->subdivision().path(); }

std::span<const std::uint32_t> HapticLoop::steps_left() const noexcept {
    return parts_->subdivision().steps_left();
}

std::span<const Touch> HapticLoop::touches() const noexcept { return parts_->touches(); }

std::span<const SurfaceStatus> HapticLoop::surface_states() const noexcept {
    return parts_->surface_states();
}

std::size_t HapticLoop::effect_count() const noexcept { return parts_->effect_count(); }

bool HapticLoop::set_gain(std::size_t effect, double gain) noexcept {
    return parts_->set_gain(effect, gain);
}

} // namespace palpate
