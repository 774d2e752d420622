// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/haptic_loop.h>

#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/loop/internal/handover.h>
#include <palpate/engine/loop/internal/scene_loop.h>
#include <palpate/geometry/range.h>

namespace palpate {
using internal::CustomEffects;
using internal::SceneLoop;

namespace {

/// What belongs to the hand and its device does not change with the scene.
void require_same_hand(const internal::LoopMake& scene, const internal::LoopMake& loop) {
    const auto require_same = [](const char* name, double of_scene, double of_loop) {
        if (of_scene != of_loop)
            throw std::invalid_argument(fmt::format(
                "adopt: {} is {} in the scene and {} in the loop; give the scene the loop's, or "
                "make another loop",
                name, of_scene, of_loop));
    };
    require_same("coupling.stiffness", scene.coupling.stiffness, loop.coupling.stiffness);
    require_same("coupling.damping", scene.coupling.damping, loop.coupling.damping);
    require_same("limits.force_n", scene.safety.force_n, loop.safety.force_n);
    require_same("limits.slew_n_per_s", scene.safety.slew_n_per_s, loop.safety.slew_n_per_s);
}

} // namespace

class HapticLoop::Loops {
public:
    Loops(std::shared_ptr<const Scene> scene, Clock& clock, const LoopDescription& loop,
          const DeviceProperties& device, CustomEffects custom)
        : clock_(clock), loop_(loop), device_(device), custom_(std::move(custom)),
          scenes_(make_loop(std::move(scene))), coupling_(scenes_.running().coupling()),
          make_(scenes_.running().make()) {
        make_.scene.reset(); // scenes come and go
    }

    void adopt(std::shared_ptr<const Scene> scene) {
        std::unique_ptr<SceneLoop> next = make_loop(std::move(scene));
        scenes_.with_newest([&](const SceneLoop& newest) {
            next->take_gains_of_custom(newest);
            return 0;
        });
        require_same_hand(next->make(), make_);
        scenes_.hand_in(std::move(next));
    }
    FrameReport frame(const DeviceState& device,
                      std::span<const std::uint32_t> steps_left) noexcept {
        const double began_us = clock_.now_us(); // to take over a scene is a part of the frame
        return next_frames().frame(device, steps_left, began_us);
    }
    /// With what was adopted since the last frame.
    SceneLoop& next_frames() noexcept {
        scenes_.advance([](SceneLoop& next, SceneLoop& before) { next.go_on_from(before); });
        return scenes_.running();
    }
    /// Of the last frame.
    SceneLoop& last_frames() const noexcept { return scenes_.running(); }
    template <class Use>
    auto with_newest(const Use& use) const noexcept {
        return scenes_.with_newest(use);
    }
    const VirtualCoupling& coupling() const noexcept { return coupling_; }

private:
    std::unique_ptr<SceneLoop> make_loop(std::shared_ptr<const Scene> scene) const {
        return std::make_unique<SceneLoop>(std::move(scene), clock_, loop_, device_, custom_);
    }

    Clock& clock_;
    LoopDescription loop_;
    DeviceProperties device_;
    CustomEffects custom_; // of every scene
    internal::Handover<SceneLoop> scenes_;
    VirtualCoupling coupling_;
    internal::LoopMake make_; // without a scene
};

HapticLoop::HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
                       std::vector<std::unique_ptr<Effect>> custom)
    : HapticLoop(scene, clock, required("scene", scene)->description().loop, std::move(custom)) {}

HapticLoop::HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
                       const LoopDescription& loop, std::vector<std::unique_ptr<Effect>> custom)
    : HapticLoop(std::move(scene), clock, loop, DeviceProperties{}, std::move(custom)) {}

HapticLoop::HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
                       const LoopDescription& loop, const DeviceProperties& device,
                       std::vector<std::unique_ptr<Effect>> custom)
    : loops_(std::make_unique<Loops>(std::move(scene), clock, loop, device,
                                     CustomEffects(std::make_move_iterator(custom.begin()),
                                                   std::make_move_iterator(custom.end())))) {}

HapticLoop::~HapticLoop() = default;

FrameReport HapticLoop::frame(const DeviceState& device) noexcept {
    return loops_->frame(device, {});
}

FrameReport HapticLoop::frame(const DeviceState& device,
                              std::span<const std::uint32_t> steps_left) noexcept {
    return loops_->frame(device, steps_left);
}

Vec3 HapticLoop::release() noexcept { return loops_->last_frames().release(); }

void HapticLoop::adopt(std::shared_ptr<const Scene> scene) { loops_->adopt(std::move(scene)); }

LoopState HapticLoop::save() const { return loops_->next_frames().save(); }

void HapticLoop::restore(const LoopState& state) { loops_->next_frames().restore(state); }

std::vector<std::string> HapticLoop::warnings() const { return loops_->next_frames().warnings(); }

void HapticLoop::observe(SubStepObserver* observer) noexcept {
    loops_->next_frames().observe(observer);
}

const VirtualCoupling& HapticLoop::coupling() const noexcept { return loops_->coupling(); }

std::span<const Vec3> HapticLoop::path() const noexcept {
    return loops_->last_frames().path();
}

std::span<const std::uint32_t> HapticLoop::steps_left() const noexcept {
    return loops_->last_frames().steps_left();
}

std::span<const Touch> HapticLoop::touches() const noexcept {
    return loops_->last_frames().touches();
}

std::span<const SurfaceStatus> HapticLoop::surface_states() const noexcept {
    return loops_->last_frames().surface_states();
}

std::size_t HapticLoop::effect_count() const noexcept {
    return loops_->with_newest([](const SceneLoop& parts) { return parts.effect_count(); });
}

bool HapticLoop::set_gain(std::size_t effect, double gain) noexcept {
    return loops_->with_newest([&](SceneLoop& parts) { return parts.set_gain(effect, gain); });
}

bool HapticLoop::set_pose(std::size_t surface, const RigidPose& pose) noexcept {
    return loops_->with_newest([&](SceneLoop& parts) { return parts.set_pose(surface, pose); });
}

RigidPose HapticLoop::pose(std::size_t surface) const noexcept {
    return loops_->last_frames().pose(surface);
}

Wrench HapticLoop::wrench(std::size_t surface) const noexcept {
    return loops_->last_frames().wrench(surface);
}

} // namespace palpate
