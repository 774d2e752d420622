// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <palpate/engine/loop/frame_report.h>

namespace palpate::internal {

/// A number that each frame has.
struct FrameQuantity {
    std::string_view name; ///< "Force"
    std::string_view what; ///< in a sentence's place: "Magnitude of the force on the hand"
    std::string_view unit; ///< of its axis
    double (*of)(const FrameReport&); ///< in that unit
};
extern const FrameQuantity kForce;       ///< magnitude, N
extern const FrameQuantity kIndentation; ///< of a soft surface, mm
extern const FrameQuantity kStiffness;   ///< that the hand feels of it, N/mm

/// A quantity over time as a chart for a page (chart_in_page()): per column of pixels the range
/// from the smallest to the largest, so that no peak is lost. `top` is the upper end of its axis,
/// > 0; `id` must be unique in the page. Empty without frames.   [setup]
std::string chart_over_time(const FrameQuantity& quantity, std::span<const FrameReport> frames,
                            double top, std::string_view title, std::string_view id);

/// The largest finite one; 0 without any.                                                [any]
double largest_of(const FrameQuantity& quantity, std::span<const FrameReport> frames) noexcept;

} // namespace palpate::internal
