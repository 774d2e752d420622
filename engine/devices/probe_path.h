// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// Reads a probe path: CSV `t_s,x_m,y_m,z_m`, scene frame, a row per frame; t_s = 0 after the first
/// row begins a new trial. `every` = K >= 1 keeps each K-th row of a trial, K times as fast: time
/// and velocity are those of rows 1/rate_hz apart.   [setup] Velocity is the backward difference
/// within a trial, zero in its first row and next to a position that is not finite. Time goes on
/// over trials: frame / rate_hz. Line ends may be LF or CRLF; empty lines are allowed at the end.
/// Throws std::runtime_error "FILE:LINE: what is wrong; what to do": missing file, wrong header,
/// text where a number should be, wrong number of columns, rows not 1/rate_hz apart within 1 %, no
/// rows. NaN and inf are positions: the loop holds the proxy on them. Throws std::invalid_argument
/// on rate_hz <= 0 or every < 1.
std::vector<DeviceState> read_probe_path(const std::filesystem::path& file, double rate_hz,
                                         int every = 1);

} // namespace palpate
