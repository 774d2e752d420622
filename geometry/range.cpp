// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/range.h>

#include <array>
#include <charconv>
#include <cmath>

namespace palpate {

bool Range::contains(double value) const noexcept {
    if (std::isnan(value)) return false;
    if (or_infinite && value == std::numeric_limits<double>::infinity()) return true;
    const bool low_open = ends == Ends::low_open || ends == Ends::open;
    const bool high_open = ends == Ends::high_open || ends == Ends::open;
    return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
}

std::string Range::text() const {
    const bool low_open = ends == Ends::low_open || ends == Ends::open;
    const bool high_open = ends == Ends::high_open || ends == Ends::open;
    return (low_open ? "(" : "[") + in_digits(low) + ", " + in_digits(high) +
           (high_open ? ")" : "]") + (or_infinite ? " or inf" : "");
}

std::string in_digits(double value) {
    // Powers of ten up to here are read at a glance; beyond, their number is.
    const double size = std::abs(value);
    const bool plain = size == 0.0 || (size >= 1e-4 && size < 1e16) || !std::isfinite(value);
    std::array<char, 64> digits{};
    const auto [end, error] =
        std::to_chars(digits.data(), digits.data() + digits.size(), value,
                      plain ? std::chars_format::fixed : std::chars_format::scientific);
    static_cast<void>(error); // 17 digits and an exponent fit
    return {digits.data(), end};
}

namespace {

std::string text_of(const Vec3& value) {
    return "[" + in_digits(value.x) + ", " + in_digits(value.y) + ", " + in_digits(value.z) + "]";
}

[[noreturn]] void refuse(std::string_view what, const std::string& value, const char* why,
                         const std::string& remedy) {
    throw std::invalid_argument(std::string(what) + " = " + value + " " + why + "; " + remedy);
}

} // namespace

void require(std::string_view what, double value, const Range& range) {
    if (range.contains(value)) return;
    refuse(what, in_digits(value), std::isnan(value) ? "is not a number" : "is out of range",
           "give a number in " + range.text());
}

void require_finite(std::string_view what, const Vec3& value) {
    if (is_finite(value)) return;
    refuse(what, text_of(value), "is not finite", "give three finite numbers");
}

void require_direction(std::string_view what, const Vec3& value) {
    const double length = glm::length(value);
    if (length > 0.0 && std::isfinite(length)) return;
    refuse(what, text_of(value), "has no direction",
           "give three finite numbers, not all of them 0");
}

} // namespace palpate
