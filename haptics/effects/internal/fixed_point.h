// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>

#include <palpate/haptics/solver/fixed_vector.h>

namespace palpate::internal {

/// Finds x = T(x) for a map of a few numbers that is nearly linear around its fixed point, from
/// what the last rounds have shown of it (Anderson 1965, type II): of all mixtures of them, the one
/// with the least T(x) - x goes on. For a linear map of n <= kMemory numbers it is there after
/// n + 1 rounds, whether T itself converges or not. No allocation.                        [loop]
template <std::size_t Capacity>
class FixedPoint {
public:
    using Values = FixedVector<double, Capacity>;

    /// The next x to try, after T(x) = `found` at `x`; of as many numbers in every round.
    Values next(const Values& x, const Values& found) noexcept {
        Values apart = difference(found, x);
        const double distance = dot(apart, apart);
        if (distance >= last_distance_) rounds_.clear(); // beyond a kink: older ones mislead
        if (!last_x_.empty()) remember(difference(x, last_x_), difference(apart, last_apart_));
        last_distance_ = distance;
        last_x_ = x;
        last_apart_ = apart;

        // Newest difference first: what it explains of `apart` is taken away, then the next one's.
        Values result = found;
        Rounds explained;
        for (std::size_t m = rounds_.size(); m-- > 0;) {
            Round round = rounds_[m];
            const double length = dot(round.apart, round.apart);
            for (const Round& before : explained) {
                const double share =
                    dot(round.apart, before.apart) / dot(before.apart, before.apart);
                add(round.apart, before.apart, -share);
                add(round.found, before.found, -share);
            }
            const double rest = dot(round.apart, round.apart);
            if (!(rest > kIndependent * length)) continue;
            const double share = dot(apart, round.apart) / rest;
            add(apart, round.apart, -share);
            add(result, round.found, -share);
            explained.push_back(round);
        }
        return result;
    }

private:
    static constexpr std::size_t kMemory = 3;
    // Differences that leave less than this share of their square are the ones before them again.
    static constexpr double kIndependent = 1e-8;

    /// How T(x) and T(x) - x changed from one round to the next.
    struct Round {
        Values found, apart;
    };
    using Rounds = FixedVector<Round, kMemory>;

    static Values difference(const Values& a, const Values& b) noexcept {
        Values result = a;
        add(result, b, -1.0);
        return result;
    }
    static double dot(const Values& a, const Values& b) noexcept {
        double sum = 0.0;
        for (std::size_t i = 0; i < a.size(); ++i)
            sum += a[i] * b[i];
        return sum;
    }
    static void add(Values& to, const Values& what, double share) noexcept {
        for (std::size_t i = 0; i < to.size(); ++i)
            to[i] += share * what[i];
    }
    void remember(Values x_step, const Values& apart_step) noexcept {
        if (rounds_.full()) {
            for (std::size_t m = 1; m < kMemory; ++m)
                rounds_[m - 1] = rounds_[m];
            rounds_.pop_back();
        }
        add(x_step, apart_step, 1.0);
        rounds_.push_back({x_step, apart_step});
    }

    double last_distance_ = std::numeric_limits<double>::infinity(); // its square
    Values last_x_, last_apart_;
    Rounds rounds_; // oldest first
};

} // namespace palpate::internal
