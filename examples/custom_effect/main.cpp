// SPDX-License-Identifier: Apache-2.0
// An effect of one's own: a pulse that runs through the tissue, felt beside what the scene has. A
// still hand is held into it, and what it feels is compared with the law; then it is switched off
// while the loop runs.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <vector>

#include <palpate/palpate.h>

#include "wave.h"

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
