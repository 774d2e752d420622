// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/internal/principal_axis.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate::internal {
namespace {

// Convergence is quadratic: five sweeps reach rounding from anywhere.
constexpr int kSweeps = 8;
// Of a tensor of unit length: to turn by less than this changes nothing, and could overflow.
constexpr double kNegligible = 1e-30;

// std::hypot() of three numbers: that of two is the C library's, with another last bit on other
// processors.

/// Turns m so that its element p, q becomes 0, and the columns of v with it.
void annihilate(Mat3& m, Mat3& v, int p, int q) noexcept {
    if (std::abs(m[q][p]) < kNegligible) return;
    const double theta = 0.5 * (m[q][q] - m[p][p]) / m[q][p];
    const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0, 0.0));
    const double c = 1.0 / std::hypot(t, 1.0, 0.0);
    Mat3 turn(1.0);
    turn[p][p] = c;
    turn[q][q] = c;
    turn[q][p] = t * c;
    turn[p][q] = -t * c;
    m = glm::transpose(turn) * m * turn;
    v = v * turn;
}

double norm(const Mat3& m) noexcept {
    return std::hypot(glm::length(m[0]), glm::length(m[1]), glm::length(m[2]));
}

} // namespace

PrincipalAxis principal_axis(const Mat3& tensor) noexcept {
    const double scale = norm(tensor); // products of scaled elements neither overflow nor vanish
    if (!(scale > 0.0) || !std::isfinite(scale)) return {};
    Mat3 m = tensor / scale;
    Mat3 v(1.0);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        annihilate(m, v, 0, 1);
        annihilate(m, v, 0, 2);
        annihilate(m, v, 1, 2);
    }
    std::array<int, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return m[a][a] > m[b][b]; });
    const int first = order[0];
    const int next = order[1];
    return {glm::normalize(v[first]), scale * m[first][first], scale * m[next][next]};
}

double anisotropy(const Mat3& tensor) noexcept {
    const double length = norm(tensor);
    if (!(length > 0.0)) return 0.0;
    const double mean = (tensor[0][0] + tensor[1][1] + tensor[2][2]) / 3.0;
    return std::min(1.0, std::sqrt(1.5) * norm(tensor - mean * Mat3(1.0)) / length);
}

} // namespace palpate::internal
