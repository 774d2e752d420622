// SPDX-License-Identifier: Apache-2.0
// An effect of one's own: a pulse that runs through the tissue, felt beside what the scene has. A
// still hand is held into it, and what it feels is compared with the law; then it is switched off
// while the loop runs.
#include <algorithm>
#include <any>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <numbers>
#include <vector>

#include <palpate/palpate.h>

using palpate::Vec3;

/// A wave that runs along x and pushes across it, along z:
///   d = A sin(2 pi (f t - x0 / w))
/// in N, with x0 the proxy at the frame's start and t counted in frames, so that a run repeats.
class Wave final : public palpate::Effect {
public:
    static constexpr double kAmplitude_n = 0.5;
    static constexpr double kFrequency_hz = 2.0;
    static constexpr double kWavelength_m = 0.1;

    static double force_n(double time_s, double x_m) {
        return kAmplitude_n *
               std::sin(2.0 * std::numbers::pi * (kFrequency_hz * time_s - x_m / kWavelength_m));
    }

    void restart(const Vec3&) noexcept override { time_s_ = 0.0; }
    void begin(const palpate::FrameContext& frame) noexcept override {
        felt_n_ = {0.0, 0.0, force_n(time_s_, frame.start.x)};
        time_s_ += frame.period_s;
    }
    void gather(const Vec3&, palpate::PrimitiveSet& primitives) noexcept override {
        primitives.add_force(felt_n_);
    }
    // It pushes a hand that did nothing: a device with motors has to know by how much.
    double unasked_force_n() const noexcept override { return kAmplitude_n; }
    // And the push moves while the hand holds still: it is not to be calmed as a proxy is that goes
    // to and fro for want of a balance.
    bool is_active() const noexcept override { return true; }
    std::size_t most_primitives() const noexcept override { return 0; } // a force needs no room
    palpate::QueryCount queries() const noexcept override { return {}; }
    // Its time moves from frame to frame, so it is a part of HapticLoop::save() and restore().
    std::any save_state() const override { return time_s_; }
    void restore_state(const std::any& state) override { time_s_ = std::any_cast<double>(state); }

private:
    double time_s_ = 0.0;
    Vec3 felt_n_{0.0};
};

/// A ball to touch, and a wave in the air round it; N, m.
constexpr const char* kScene = R"(
[volume.ball]
analytic = "solid_sphere"
radius_mm = 30
[surface.ball]
volume = "ball"
iso_value = 0
[[effect]]
type = "surface"
surface = "ball"
)";
constexpr std::size_t kWave = 1; // the custom effects' numbers follow the scene's

int main() {
    const auto scene =
        std::make_shared<const palpate::Scene>(palpate::parse_scene(kScene, "ball.toml"));
    std::vector<std::unique_ptr<palpate::Effect>> own;
    own.push_back(std::make_unique<Wave>());
    palpate::SteadyClock clock;
    palpate::HapticLoop loop(scene, clock, std::move(own));

    palpate::DeviceState hand;
    hand.position = {0.05, 0.0, 0.0};
    double worst_n = 0.0;
    for (int frame = 0; frame < 1000; ++frame) {
        const double law_n = Wave::force_n(frame / 1000.0, hand.position.x);
        worst_n = std::max(worst_n, std::abs(loop.frame(hand).force.z - law_n));
    }
    std::printf("a wave of %g N: off its law by at most %.2g N in 1000 frames\n",
                Wave::kAmplitude_n, worst_n);

    loop.set_gain(kWave, 0.0);               // from any thread
    for (int frame = 0; frame < 60; ++frame) // 50 ms
        loop.frame(hand);
    const double left_n = glm::length(loop.frame(hand).force);
    std::printf("switched off: %g N\n", left_n);

    // The coupling's spring: 500 N/m times positions of 0.05 m, to 1e-17 m each; t sums to 1e-13 s.
    const bool as_it_should = worst_n < 1e-11 && left_n == 0.0;
    return as_it_should ? 0 : 1;
}
