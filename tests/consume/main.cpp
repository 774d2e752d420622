// SPDX-License-Identifier: Apache-2.0
// Uses the installed library as an embedding simulator would: a field, a sample, a strength over
// its value.
#include <cmath>
#include <cstdio>

#include <palpate/version.h>
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

    std::printf("palpate %s: value %.17g m (expected %.17g), strength %g N\n", palpate::kVersion,
                sample.value, expected_m, strength(0.005));
    return value_right && strength_right ? 0 : 1;
}
