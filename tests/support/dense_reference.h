// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>

#include <palpate/volume/scalar_field.h>
#include <palpate/volume/voxel_volume.h>

/// Brute-force twins of field queries: slow, plain, sharing no code with the library.
namespace palpate::test {

/// A grid field as its definition says: weights of the eight corners, each with central differences
/// of its own, in long double, the voxels as they came. NaN, infinite and missing voxels are
/// background.
class DenseReference {
public:
    DenseReference(const VoxelVolume& volume, float background)
        : volume_(volume), background_(background) {}

    /// Node index of a scene point, by Cramer's rule.
    std::array<long double, 3> index_of(const Vec3& point) const {
        std::array<std::array<long double, 3>, 4> c; // three columns and the right-hand side
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                c[static_cast<std::size_t>(column)][static_cast<std::size_t>(row)] =
                    volume_.index_to_scene.linear[column][row];
            c[3][static_cast<std::size_t>(row)] =
                static_cast<long double>(point[row]) - volume_.index_to_scene.offset[row];
        }
        const long double all = determinant(c[0], c[1], c[2]);
        return {determinant(c[3], c[1], c[2]) / all, determinant(c[0], c[3], c[2]) / all,
                determinant(c[0], c[1], c[3]) / all};
    }

    float node(int i, int j, int k) const {
        if (i < 0 || j < 0 || k < 0 || i >= volume_.size[0] || j >= volume_.size[1] ||
            k >= volume_.size[2])
            return background_;
        const float value = volume_.at(i, j, k);
        return std::isfinite(value) ? value : background_;
    }

    double value(const Vec3& point) const { return sample(point).value; }

    FieldSample sample(const Vec3& point) const {
        const std::array<long double, 3> x = index_of(point);
        int base[3];
        long double f[3];
        for (std::size_t a = 0; a < 3; ++a) {
            const long double floor = std::floor(x[a]);
            base[a] = static_cast<int>(floor);
            f[a] = x[a] - floor;
        }
        long double at[4] = {},
                    by[4][3] = {}; // value and central differences, and their derivatives by index
        for (int corner = 0; corner < 8; ++corner) {
            const int bit[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
            const int i = base[0] + bit[0], j = base[1] + bit[1], k = base[2] + bit[2];
            const long double quantity[4] = {node(i, j, k),
                                             half(node(i + 1, j, k), node(i - 1, j, k)),
                                             half(node(i, j + 1, k), node(i, j - 1, k)),
                                             half(node(i, j, k + 1), node(i, j, k - 1))};
            long double weight[3], change[3];
            for (int a = 0; a < 3; ++a) {
                weight[a] = bit[a] != 0 ? f[a] : 1 - f[a];
                change[a] = bit[a] != 0 ? 1 : -1;
            }
            for (int q = 0; q < 4; ++q) {
                at[q] += quantity[q] * weight[0] * weight[1] * weight[2];
                by[q][0] += quantity[q] * change[0] * weight[1] * weight[2];
                by[q][1] += quantity[q] * weight[0] * change[1] * weight[2];
                by[q][2] += quantity[q] * weight[0] * weight[1] * change[2];
            }
        }
        FieldSample s;
        s.valid = true;
        s.value = static_cast<double>(at[0]);
        for (int row = 0; row < 3; ++row)
            for (int a = 0; a < 3; ++a) {
                const long double a_row =
                    index_derivative(a, row); // of index a by scene axis `row`
                s.slope[row] += static_cast<double>(by[0][a] * a_row);
                s.gradient[row] += static_cast<double>(at[1 + a] * a_row);
                for (int column = 0; column < 3; ++column)
                    for (int b = 0; b < 3; ++b)
                        s.hessian[column][row] +=
                            static_cast<double>(by[1 + a][b] * a_row * index_derivative(b, column));
            }
        return s;
    }

private:
    using Column = std::array<long double, 3>;

    static long double half(float above, float below) {
        return (static_cast<long double>(above) - static_cast<long double>(below)) / 2;
    }
    static long double determinant(const Column& a, const Column& b, const Column& c) {
        return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) +
               c[0] * (a[1] * b[2] - a[2] * b[1]);
    }
    long double index_derivative(int index_axis, int scene_axis) const {
        Vec3 step(0.0);
        step[scene_axis] = 1.0;
        const auto moved = index_of(volume_.index_to_scene.offset + step);
        return moved[static_cast<std::size_t>(index_axis)];
    }

    const VoxelVolume& volume_;
    float background_;
};

/// Where one of `count` points spread evenly on a segment is the first with value >= level.
template <typename Value>
std::optional<double> first_sampled(const Value& value, const Vec3& from, const Vec3& to,
                                    double level, int count) {
    for (int n = 0; n <= count; ++n) {
        const double t = static_cast<double>(n) / count;
        if (value(from + t * (to - from)) >= level) return t;
    }
    return std::nullopt;
}

/// Highest value at `count` points from the start of a segment to t.
template <typename Value>
double highest_sampled(const Value& value, const Vec3& from, const Vec3& to, double t, int count) {
    double highest = value(from);
    for (int n = 1; n <= count; ++n)
        highest = std::max(highest, value(from + (t * n / count) * (to - from)));
    return highest;
}

/// A random unit vector, evenly spread.
inline Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(Vec3(normal(random), normal(random), normal(random)));
}

/// A random point of a box.
inline Vec3 random_point(std::mt19937_64& random, const Box& box) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const Vec3 share(unit(random), unit(random), unit(random));
    return box.lower + share * box.extent();
}

} // namespace palpate::test
