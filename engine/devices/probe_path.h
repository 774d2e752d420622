// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
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

/// A row of a probe path in memory.
struct ProbeRow {
    double time_s = 0.0; ///< since its trial began, s; 0 begins a new trial
    Vec3 position{0.0};  ///< m, scene frame
};

/// The same states from rows in memory as from a file that has these rows.               [setup]
/// Throws std::invalid_argument "path[ROW]: what is wrong; what to do", rows counted from 0, and as
/// read_probe_path() on rate_hz and every.
std::vector<DeviceState> probe_states(std::span<const ProbeRow> rows, double rate_hz,
                                      int every = 1);

/// What a probe says whose positions come one by one, a period apart: read_probe_path() makes the
/// states of its rows with it, and so does who feels a path step by step. A value: a copy goes on
/// from where the original is.
class ProbeSteps {
public:
    /// rate_hz > 0, finite.                                                              [setup]
    explicit ProbeSteps(double rate_hz) noexcept : rate_hz_(rate_hz) {}

    /// The next position, m, scene frame, is the first one of a new trial.               [any]
    void begin_trial() noexcept;
    /// The state at a position, m, scene frame; its time is that of its place in the row of all.
    /// [any]
    DeviceState next(const Vec3& position) noexcept;

private:
    double rate_hz_;
    std::uint64_t count_ = 0; // positions so far
    std::uint32_t trial_ = 0;
    Vec3 last_{0.0};
    bool is_first_ = true; // of its trial: there is no velocity yet
};

} // namespace palpate
