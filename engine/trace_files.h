// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

#include <palpate/engine/frame_report.h>

namespace palpate {

/// Writes frames.csv: a row per frame, 17 significant digits, no clock in it: the same bytes for
/// the same inputs.    [setup] Complete or not at all; throws std::runtime_error naming the file.
void write_frames_csv(const std::filesystem::path& file, std::span<const FrameReport> frames);

/// Writes timing.csv: what the clock said and how many queries each frame made.         [setup]
void write_timing_csv(const std::filesystem::path& file, std::span<const FrameReport> frames);

} // namespace palpate
