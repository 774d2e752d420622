// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <palpate/engine/loop/frame_report.h>

namespace palpate {

/// How our files of frames begin; more columns may follow.
inline constexpr std::string_view kFramesColumns =
    "frame,trial,time_s,probe_x_m,probe_y_m,probe_z_m,proxy_x_m,proxy_y_m,proxy_z_m,";
/// How timing.csv begins: what a clock decided, us.
inline constexpr std::string_view kTimingColumns = "frame,spent_us,estimate_us,late_us,";

/// Writes frames.csv: a row per frame, 17 significant digits, no clock in it: the same bytes for
/// the same inputs. The last column says what is felt, by the names of felt_names(): "a+b".
/// [setup] Complete or not at all; throws std::runtime_error naming the file.
void write_frames_csv(const std::filesystem::path& file, std::span<const FrameReport> frames,
                      std::span<const std::string> felt_names);

/// Writes timing.csv: what the clock said and how many queries each frame made.         [setup]
void write_timing_csv(const std::filesystem::path& file, std::span<const FrameReport> frames);

} // namespace palpate
