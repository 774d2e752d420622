// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include <palpate/geometry/vec.h>

namespace palpate {

/// What a number may be; NaN is never in it.
struct Range {
    enum class Ends { closed, low_open, high_open, open };
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    Ends ends = Ends::closed;
    bool or_infinite = false; ///< infinity, too, beyond `high`

    bool contains(double value) const noexcept; ///< [any]
    std::string text() const;                   ///< as "(0, 1000]" or "[0, 1000] or inf"  [any]
};

// Ranges of settings that have no end but that they are numbers.
inline constexpr Range kFiniteRange{-std::numeric_limits<double>::infinity(),
                                    std::numeric_limits<double>::infinity(), Range::Ends::open};
inline constexpr Range kPositive{0.0, std::numeric_limits<double>::infinity(), Range::Ends::open};
inline constexpr Range kNotNegative{0.0, std::numeric_limits<double>::infinity(),
                                    Range::Ends::high_open};
inline constexpr Range kPositiveOrInfinite{0.0, std::numeric_limits<double>::infinity(),
                                           Range::Ends::low_open};
inline constexpr Range kNotNegativeOrInfinite{0.0, std::numeric_limits<double>::infinity()};

/// A number as messages say it: the shortest text that reads as the same.               [any]
std::string in_digits(double value);

// What constructors refuse settings with: std::invalid_argument "FIELD = VALUE is out of range;
// give a number in RANGE". All [setup].

/// Refuses a number outside of the range; `what` begins the message: "vibration: decay_s".
void require(std::string_view what, double value, const Range& range);
/// Refuses a place or force that is not finite.
void require_finite(std::string_view what, const Vec3& value);
/// Refuses a direction that has no length, or none that is finite.
void require_direction(std::string_view what, const Vec3& value);
/// The part itself; refuses nothing at all.
template <class Pointer>
Pointer required(std::string_view what, Pointer part) {
    if (!part) throw std::invalid_argument(std::string(what) + " is missing; give one");
    return part;
}

} // namespace palpate
