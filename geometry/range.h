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
    /// Which ends belong to the range: both, the high one alone, the low one alone, none.
    enum class Ends { closed, low_open, high_open, open };
    double low = -std::numeric_limits<double>::infinity(); ///< may be -infinity
    double high = std::numeric_limits<double>::infinity(); ///< >= low; may be infinity
    Ends ends = Ends::closed;                              ///< which of them are in it
    bool or_infinite = false;                              ///< infinity, too, beyond `high`

    bool contains(double value) const noexcept; ///< [any]
    std::string text() const;                   ///< as "(0, 1000]" or "[0, 1000] or inf"  [any]
};

/// Any number: -infinity < x < infinity. Like those below, a range of settings without an end.
inline constexpr Range kFiniteRange{-std::numeric_limits<double>::infinity(),
                                    std::numeric_limits<double>::infinity(), Range::Ends::open};
/// 0 < x < infinity.
inline constexpr Range kPositive{0.0, std::numeric_limits<double>::infinity(), Range::Ends::open};
/// 0 <= x < infinity.
inline constexpr Range kNotNegative{0.0, std::numeric_limits<double>::infinity(),
                                    Range::Ends::high_open};
/// 0 < x <= infinity.
inline constexpr Range kPositiveOrInfinite{0.0, std::numeric_limits<double>::infinity(),
                                           Range::Ends::low_open};
/// 0 <= x <= infinity.
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
