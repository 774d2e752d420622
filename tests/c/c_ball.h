// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>

#include "tests/c/c_data.h"
#include "tests/support/made_labels.h"
#include "tests/support/memory_scenes.h"

/// A ball as functions of a C program, and one of two labels.
namespace palpate::test {

inline LabelVolume two_halves() {
    return made_labels({24, 24, 24}, {Mat3(1e-3), Vec3(-11.5e-3)}, 2, [](const Vec3& index) {
        if (glm::length(index - 11.5) > 9.0) return 0;
        return index.x < 12.0 ? 1 : 2;
    });
}

/// Depth below a ball's surface, m, and counts what Palpate does with it.
struct Ball {
    double radius_m = kBall_m;
    double scale = 1.0;                  // of the gradient
    std::atomic<bool> has_failed{false}; // gives NaN from then on
    std::atomic<bool> has_ended{false};  // has no value from then on
    std::atomic<int> calls{0};
    std::atomic<int> releases{0};
};

extern "C" inline int32_t sample_ball(const double* p, double* value, double* gradient,
                                      void* user) {
    auto& ball = *static_cast<Ball*>(user);
    ++ball.calls;
    if (ball.has_ended) return 0;
    const double r = std::hypot(p[0], p[1], p[2]);
    *value = ball.has_failed ? std::numeric_limits<double>::quiet_NaN() : ball.radius_m - r;
    for (int i = 0; i < 3; ++i)
        gradient[i] = r > 0.0 ? -ball.scale * p[i] / r : 0.0;
    return 1;
}

extern "C" inline void release_ball(void* user) { ++static_cast<Ball*>(user)->releases; }

inline palpate_scalar_field field_of(Ball& ball) {
    auto field = sized<palpate_scalar_field>();
    field.sample = sample_ball;
    field.user = &ball;
    field.release = release_ball;
    for (int i = 0; i < 3; ++i) {
        field.lower_m[i] = -1.2 * kBall_m;
        field.upper_m[i] = 1.2 * kBall_m;
    }
    field.steepest_per_m = 1.0;
    field.feature_size_m = kBall_m;
    return field;
}

extern "C" inline int32_t sample_up(const double* p, double* value, void* user) {
    auto& ball = *static_cast<Ball*>(user);
    ++ball.calls;
    value[0] = value[1] = 0.0;
    value[2] = ball.has_failed ? std::numeric_limits<double>::quiet_NaN() : 1.0;
    return p[0] > -1.0 ? 1 : 0;
}

inline palpate_vector_field vector_field_of(Ball& ball) {
    const palpate_scalar_field like = field_of(ball);
    auto field = sized<palpate_vector_field>();
    field.sample = sample_up;
    field.user = &ball;
    field.release = release_ball;
    std::copy_n(like.lower_m, 3, field.lower_m);
    std::copy_n(like.upper_m, 3, field.upper_m);
    field.feature_size_m = 1e-2;
    return field;
}

} // namespace palpate::test
