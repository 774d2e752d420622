// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <palpate/engine/loop/frame_report.h>

namespace palpate::internal {

/// The force's magnitude over time as a chart for a page (chart_in_page()): per column of pixels
/// the range from the smallest to the largest, so that no peak is lost. `top_n` is the upper end of
/// its axis, > 0; `id` must be unique in the page. Empty without frames.   [setup]
std::string force_chart(std::span<const FrameReport> frames, double top_n, std::string_view title,
                        std::string_view id);

/// Magnitude of the largest finite force, N; 0 without any.                              [any]
double largest_force_n(std::span<const FrameReport> frames) noexcept;

} // namespace palpate::internal
