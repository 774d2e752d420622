// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/force_colors.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate::internal {

Color force_color(double share) noexcept {
    constexpr std::array<Color, 6> kColors{{{0.09, 0.16, 0.55},
                                            {0.32, 0.14, 0.66},
                                            {0.60, 0.13, 0.60},
                                            {0.82, 0.17, 0.40},
                                            {0.94, 0.36, 0.17},
                                            {1.00, 0.62, 0.10}}};
    if (!(share > 0.0)) return kColors.front();
    if (share >= 1.0) return kColors.back();
    const double at = share * static_cast<double>(kColors.size() - 1);
    const auto low = static_cast<std::size_t>(at);
    const double part = at - static_cast<double>(low);
    Color color{};
    for (std::size_t i = 0; i < color.size(); ++i)
        color[i] = kColors[low][i] + part * (kColors[low + 1][i] - kColors[low][i]);
    return color;
}

double round_up(double value) noexcept {
    if (!(value > 0.0) || !std::isfinite(value)) return 1.0;
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    constexpr double kRounding = 1e-9; // relative: 0.3 is 3 times 0.1, not a bit more
    for (const double step : {1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0})
        if (value <= step * power * (1.0 + kRounding)) return step * power;
    return 10.0 * power;
}

double force_scale_n(std::span<const FrameReport> frames) {
    std::vector<double> forces;
    for (const FrameReport& frame : frames)
        if (frame.contacts > 0 && is_finite(frame.force))
            forces.push_back(glm::length(frame.force));
    if (forces.empty()) return 1.0;
    // Nearest rank: what is below it, and itself, are 99 % at least.
    const auto rank =
        static_cast<std::ptrdiff_t>(std::ceil(0.99 * static_cast<double>(forces.size()))) - 1;
    std::nth_element(forces.begin(), forces.begin() + rank, forces.end());
    return round_up(forces[static_cast<std::size_t>(rank)]);
}

} // namespace palpate::internal
