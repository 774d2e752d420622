// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/value_sample.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate::internal {

std::size_t ValueSample::step_for(std::size_t count, std::size_t row) noexcept {
    constexpr std::size_t kMost = std::size_t{1} << 20;
    std::size_t step = (count + kMost - 1) / kMost;
    if (step <= 1) return 1;
    while (std::gcd(step, std::max<std::size_t>(row, 1)) != 1)
        ++step;
    return step;
}

void ValueSample::add(double value) {
    if (std::isfinite(value)) sorted_.push_back(static_cast<float>(value));
}

void ValueSample::sort() { std::sort(sorted_.begin(), sorted_.end()); }

double ValueSample::percentile(double share) const noexcept {
    if (sorted_.empty()) return 0.0;
    const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(sorted_.size() - 1);
    return sorted_[static_cast<std::size_t>(std::lround(place))];
}

std::optional<double> ValueSample::otsu_threshold() const noexcept {
    // Variance between the classes: w0 w1 (m0 - m1)^2, from the sums below a split. Values are
    // taken from the smallest one on: a large offset would cancel their differences.
    if (sorted_.empty()) return std::nullopt;
    const double first = sorted_.front();
    double total = 0.0;
    for (const float value : sorted_)
        total += value - first;
    std::optional<double> threshold;
    double most = 0.0;
    double below = 0.0;
    const auto count = static_cast<double>(sorted_.size());
    for (std::size_t i = 0; i + 1 < sorted_.size(); ++i) {
        below += sorted_[i] - first;
        if (!(sorted_[i] < sorted_[i + 1])) continue;
        const double n0 = static_cast<double>(i + 1);
        const double n1 = count - n0;
        const double between = below / n0 - (total - below) / n1;
        const double variance = n0 / count * (n1 / count) * between * between;
        if (!(variance > most)) continue;
        most = variance;
        threshold = 0.5 * (static_cast<double>(sorted_[i]) + static_cast<double>(sorted_[i + 1]));
    }
    return threshold;
}

} // namespace palpate::internal
