// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/principal_direction.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {
namespace {

/// Turns m so that its element p, q becomes 0, and the columns of v with it (a Jacobi rotation).
void annihilate(Mat3& m, Mat3& v, int p, int q) noexcept {
    if (m[q][p] == 0.0) return;
    const double theta = 0.5 * (m[q][q] - m[p][p]) / m[q][p];
    const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0));
    const double c = 1.0 / std::hypot(t, 1.0);
    const double s = t * c;
    Mat3 turn(1.0);
    turn[p][p] = c;
    turn[q][q] = c;
    turn[q][p] = s;
    turn[p][q] = -s;
    m = glm::transpose(turn) * m * turn;
    v = v * turn;
}

} // namespace

Vec3 principal_direction(const SymmetricTensor& t) noexcept {
    // In units of the largest element: products then neither overflow nor vanish.
    double largest = 0.0;
    for (const double element : t) {
        if (!std::isfinite(element)) return Vec3(0.0);
        largest = std::max(largest, std::abs(element));
    }
    if (largest == 0.0) return {1.0, 0.0, 0.0};
    Mat3 m(t[0], t[1], t[2], t[1], t[3], t[4], t[2], t[4], t[5]);
    m /= largest;
    Mat3 v(1.0);
    constexpr int kSweeps = 8; // convergence is quadratic: five reach rounding
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        annihilate(m, v, 0, 1);
        annihilate(m, v, 0, 2);
        annihilate(m, v, 1, 2);
    }
    int best = 0;
    for (int i = 1; i < 3; ++i)
        if (m[i][i] > m[best][best]) best = i;
    return glm::normalize(v[best]);
}

double frobenius_norm(const SymmetricTensor& t) noexcept {
    return std::sqrt(t[0] * t[0] + t[3] * t[3] + t[5] * t[5] +
                     2.0 * (t[1] * t[1] + t[2] * t[2] + t[4] * t[4]));
}

double fractional_anisotropy(const SymmetricTensor& t) noexcept {
    const double norm = frobenius_norm(t);
    if (!(norm > 0.0)) return 0.0;
    const double mean = (t[0] + t[3] + t[5]) / 3.0;
    const double deviator =
        frobenius_norm({t[0] - mean, t[1], t[2], t[3] - mean, t[4], t[5] - mean});
    return std::min(1.0, std::sqrt(1.5) * deviator / norm);
}

} // namespace palpate::internal
