// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace palpate::internal {

/// Finds x = T(x) for a map of a few numbers that is nearly linear around its fixed point, from
/// what the last rounds have shown of it (Anderson 1965, type II): of all mixtures of them, the one
/// with the least T(x) - x goes on. For a linear map of n <= kMemory numbers it is there after
/// n + 1 rounds, whether T itself converges or not. No allocation.                        [loop]
template <std::size_t Capacity>
class FixedPoint {
public:
    explicit FixedPoint(std::size_t size) noexcept : size_(size) {}

    using Values = std::array<double, Capacity>;

    /// The next x to try, after T(x) = `found` at `x`.
    Values next(const Values& x, const Values& found) noexcept {
        Values apart{};
        for (std::size_t i = 0; i < size_; ++i)
            apart[i] = found[i] - x[i];
        const double distance = dot(apart, apart);
        if (distance >= last_distance_) known_ = 0; // beyond a kink: older rounds mislead
        if (begun_) remember(x, apart);
        begun_ = true;
        last_distance_ = distance;
        last_x_ = x;
        last_apart_ = apart;

        // Newest difference first: what it explains of `apart` is taken away, then the next one's.
        Values result = found;
        std::array<Values, kMemory> direction{}, steps{};
        std::size_t kept = 0;
        for (std::size_t m = 0; m < known_; ++m) {
            Values d = apart_steps_[m], s{};
            for (std::size_t i = 0; i < size_; ++i)
                s[i] = x_steps_[m][i] + apart_steps_[m][i];
            const double length = dot(d, d);
            for (std::size_t k = 0; k < kept; ++k) {
                const double share = dot(d, direction[k]) / dot(direction[k], direction[k]);
                add(d, direction[k], -share);
                add(s, steps[k], -share);
            }
            if (!(dot(d, d) > kIndependent * length)) continue;
            const double explained = dot(apart, d) / dot(d, d);
            add(apart, d, -explained);
            add(result, s, -explained);
            direction[kept] = d;
            steps[kept++] = s;
        }
        return result;
    }

private:
    static constexpr std::size_t kMemory = 3;
    // Differences that leave less than this share of their square are the ones before them again.
    static constexpr double kIndependent = 1e-8;

    double dot(const Values& a, const Values& b) const noexcept {
        double sum = 0.0;
        for (std::size_t i = 0; i < size_; ++i)
            sum += a[i] * b[i];
        return sum;
    }
    void add(Values& to, const Values& what, double share) const noexcept {
        for (std::size_t i = 0; i < size_; ++i)
            to[i] += share * what[i];
    }
    void remember(const Values& x, const Values& apart) noexcept {
        for (std::size_t m = kMemory - 1; m > 0; --m) {
            x_steps_[m] = x_steps_[m - 1];
            apart_steps_[m] = apart_steps_[m - 1];
        }
        for (std::size_t i = 0; i < size_; ++i) {
            x_steps_[0][i] = x[i] - last_x_[i];
            apart_steps_[0][i] = apart[i] - last_apart_[i];
        }
        if (known_ < kMemory) ++known_;
    }

    std::size_t size_;
    bool begun_ = false;
    std::size_t known_ = 0;
    double last_distance_ = std::numeric_limits<double>::infinity(); // its square
    Values last_x_{}, last_apart_{};
    std::array<Values, kMemory> x_steps_{}, apart_steps_{};
};

} // namespace palpate::internal
