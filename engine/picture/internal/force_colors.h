// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include <palpate/engine/loop/frame_report.h>

namespace palpate::internal {

/// Red, green, blue, sRGB in [0, 1].
using Color = std::array<double, 3>;

/// Colour of a force: dark blue at share 0, through purple and red to orange at 1; lightness grows
/// all the way, so that it can be read in grey and with colour-blind eyes. Shares outside [0, 1]
/// and NaN are clamped. [any]
Color force_color(double share) noexcept;

/// The force that has the last colour, N: a round number at or above 99 % of the frames in contact;
/// 1 without any.   [setup]
double force_scale_n(std::span<const FrameReport> frames);

/// The smallest of 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10 times a power of ten that is at least `value`;
/// 1 for 0 or less and for what is not finite. [any]
double round_up(double value) noexcept;

} // namespace palpate::internal
