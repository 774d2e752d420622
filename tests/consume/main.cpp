// SPDX-License-Identifier: Apache-2.0
// Uses the installed library as an embedding simulator would: a loop over a ball made in code, a
// field, a sample, a strength over its value.
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

#include <palpate/palpate.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/transfer_function.h>

int main() {
    const double radius_m = 0.05;
    const auto field = palpate::make_solid_sphere(radius_m);
    const auto sampler = field->make_sampler();
    const palpate::FieldSample sample = sampler->sample({0.03, 0.0, 0.04 - 0.01});
    // radius - |x| with |x| = 0.03 * sqrt(2): a handful of roundings of numbers below 0.1, 1e-17
    // each.
    const double expected_m = radius_m - 0.03 * std::sqrt(2.0);
    const bool value_right = sample.valid && std::abs(sample.value - expected_m) < 1e-15;

    palpate::TransferFunction strength;
    strength.nodes[0] = {0.0, 1.0};
    strength.nodes[1] = {0.01, 3.0};
    strength.count = 2;
    const bool strength_right = strength(0.005) == 2.0;

    // Pressed 2 mm into a hard ball: 500 N/m * 2 mm, along x.
    palpate::SceneDescription ball;
    ball.volumes["ball"].analytic = "solid_sphere";
    ball.volumes["ball"].parameters["radius_mm"] = 30.0;
    ball.surfaces["ball"].volume = "ball";
    ball.effects.push_back(palpate::effects::Surface{.surface = "ball"});
    palpate::SteadyClock clock;
    palpate::HapticLoop loop(std::make_shared<const palpate::Scene>(ball), clock);
    palpate::FrameReport report;
    for (int frame = 0; frame <= 40; ++frame) {
        palpate::DeviceState hand;
        hand.time_s = 1e-3 * frame;
        hand.position = {0.032 - 1e-4 * frame, 0.0, 0.0};
        report = loop.frame(hand);
    }
    const bool force_right = std::abs(report.force.x - 1.0) < 1e-3;

    // The run time alone reads no files, and says who does.
    bool refusal_right = false;
    ball.volumes["ball"] = {};
    ball.volumes["ball"].file = "ball.nrrd";
    try {
        const palpate::Scene scene(ball);
    } catch (const std::runtime_error& error) {
        refusal_right = std::string(error.what()).find("link palpate::files") != std::string::npos;
        std::printf("%s\n", error.what());
    }

    std::printf("palpate %s: value %.17g m (expected %.17g), strength %g N\n", palpate::kVersion,
                sample.value, expected_m, strength(0.005));
    std::printf("force %.6f N (expected 1)\n", report.force.x);
    return value_right && strength_right && force_right && refusal_right ? 0 : 1;
}
