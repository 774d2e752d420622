// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/chart_ruler.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/picture/internal/force_colors.h>

namespace palpate::internal {
namespace {

// Values nearer to each other than this share of the largest are one: their steps are rounding.
constexpr double kLeastSpan = 1.0e-12;

/// The digits of an exponent, raised, in UTF-8.
std::string raised(int exponent) {
    constexpr std::array<const char*, 10> digits{"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                                 "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
    std::string text = exponent < 0 ? "\u207b" : "";
    for (const char digit : std::to_string(std::abs(exponent)))
        text += digits[static_cast<std::size_t>(digit - '0')];
    return text;
}

} // namespace

ChartRuler::ChartRuler(std::span<const ChartSeries> series, const ChartAxis& axis,
                       std::size_t coordinate)
    : axis_(axis), low_(std::numeric_limits<double>::infinity()), high_(-low_) {
    for (const ChartSeries& one : series)
        for (const auto& point : one.points) {
            if (!std::isfinite(point[0]) || !std::isfinite(point[1])) continue;
            low_ = std::min(low_, scaled(point[coordinate]));
            high_ = std::max(high_, scaled(point[coordinate]));
        }
    if (axis_.scale == ChartScale::logarithmic) {
        low_ = std::floor(low_);
        high_ = std::max(std::ceil(high_), low_ + 1.0);
    } else if (const double most = std::max(std::abs(low_), std::abs(high_));
               is_empty() || high_ - low_ <= kLeastSpan * most) {
        high_ = low_ + std::max(1.0, 10.0 * kLeastSpan * most);
    }
}

bool ChartRuler::is_empty() const noexcept { return !std::isfinite(low_); }

double ChartRuler::share(double value) const noexcept {
    return (scaled(value) - low_) / (high_ - low_);
}

double ChartRuler::scaled(double value) const noexcept {
    if (axis_.scale == ChartScale::linear) return value;
    return std::log10(std::max(value, axis_.smallest));
}

std::vector<double> ChartRuler::ticks(double most) const {
    const double span = high_ - low_;
    const bool is_log = axis_.scale == ChartScale::logarithmic;
    const double step = is_log ? std::ceil(span / most) : round_up(span / most);
    std::vector<double> values;
    for (double at = std::ceil(low_ / step); at * step <= high_ + 1e-9 * span; ++at) {
        values.push_back(is_log ? std::pow(10.0, at * step) : at * step);
        // Where there is room, decades are divided: 1, 2, 5, 10.
        if (is_log && 3.0 * span <= most && at * step < high_)
            values.insert(values.end(), {2.0 * values.back(), 5.0 * values.back()});
    }
    return values;
}

std::string ChartRuler::label(double tick) const {
    // The smallest and largest powers of ten that are as short as with an exponent.
    constexpr double small = 0.9e-3;
    constexpr double large = 1.1e4;
    if (axis_.scale == ChartScale::logarithmic && (tick < small || tick > large)) {
        const int exponent = static_cast<int>(std::floor(std::log10(tick) + 1e-9));
        const double factor = std::round(tick / std::pow(10.0, exponent));
        return (factor > 1.0 ? fmt::format("{:.0f}\u00b7", factor) : "") + "10" + raised(exponent);
    }
    return fmt::format("{:.6g}", tick == 0.0 ? 0.0 : tick);
}

} // namespace palpate::internal
