// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate::test {

/// Every way in which i, j, k can run along the patient's axes: 6 orders times 8 choices of signs.
/// Columns are directions; half of them are left-handed.
inline std::vector<Mat3> axis_orders() {
    std::vector<Mat3> result;
    std::array<int, 3> axis{0, 1, 2};
    do {
        for (int flips = 0; flips < 8; ++flips) {
            Mat3 directions(0.0);
            for (int index = 0; index < 3; ++index)
                directions[index][axis[static_cast<std::size_t>(index)]] =
                    (flips >> index & 1) != 0 ? -1.0 : 1.0;
            result.push_back(directions);
        }
    } while (std::next_permutation(axis.begin(), axis.end()));
    return result;
}

/// The rotation by a quaternion (a, b, c, d) of small whole numbers, exactly but for one division.
inline Mat3 quaternion_rotation(double a, double b, double c, double d) {
    const double norm = a * a + b * b + c * c + d * d;
    return (1.0 / norm) *
           Mat3(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c),
                2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b),
                2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c);
}

} // namespace palpate::test
