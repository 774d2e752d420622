// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/probe_path.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/text/internal/csv_rows.h>
#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate {
namespace {

constexpr std::string_view kHeader = "t_s,x_m,y_m,z_m";
constexpr double kSpacingTolerance = 0.01; // of a period: docs/files.md 1, "within 1 %"

struct Row {
    double time_s = 0.0;
    Vec3 position{0.0};
};

/// Rows are frames: one period apart, whatever the recording's clock did.
void check_spacing(double spacing_s, double period_s, const internal::CsvRows& rows) {
    if (std::abs(spacing_s - period_s) <= kSpacingTolerance * period_s) return;
    rows.fail(
        fmt::format("{} s after the row before it instead of {} s (within 1 %)", spacing_s,
                    period_s),
        "resample the path to loop.rate_hz or set loop.rate_hz to the path's rate; t_s = 0 begins "
        "a "
        "trial");
}

/// The frames of a path; rows come in one after another.
class FrameList {
public:
    FrameList(double rate_hz, int every) : rate_hz_(rate_hz), every_(every) {}

    void add(const Row& row, const internal::CsvRows& rows) {
        if (rows_ > 0 && row.time_s == 0.0) {
            ++trial_;
            rows_ = 0;
        }
        if (rows_ > 0) check_spacing(row.time_s - last_time_s_, 1.0 / rate_hz_, rows);
        if (rows_ % every_ == 0) add_frame(row.position);
        last_time_s_ = row.time_s;
        ++rows_;
    }

    std::vector<DeviceState> take() { return std::move(frames_); }

private:
    void add_frame(const Vec3& position) {
        DeviceState frame;
        frame.time_s = static_cast<double>(frames_.size()) / rate_hz_;
        frame.position = position;
        frame.trial = trial_;
        if (rows_ > 0) {
            const Vec3 velocity = (position - frames_.back().position) * rate_hz_;
            if (is_finite(velocity)) frame.velocity = velocity;
        }
        frames_.push_back(frame);
    }

    double rate_hz_;
    std::int64_t every_;
    std::vector<DeviceState> frames_;
    std::uint32_t trial_ = 0;
    std::int64_t rows_ = 0; // of this trial so far
    double last_time_s_ = 0.0;
};

void check_arguments(double rate_hz, int every) {
    if (!(rate_hz > 0.0) || !std::isfinite(rate_hz))
        throw std::invalid_argument(
            fmt::format("read_probe_path: rate_hz = {}; give a finite rate > 0", rate_hz));
    if (every < 1)
        throw std::invalid_argument(
            fmt::format("read_probe_path: every = {}; give an integer >= 1", every));
}

/// What a trace writes is not what it reads: the two are easily confused.
void refuse_results(const std::filesystem::path& file) {
    internal::refuse_pipe_or_device(file);
    std::string start(64, '\0');
    std::ifstream(file, std::ios::binary).read(start.data(), 64);
    const bool is_frames = start.starts_with("frame,trial,time_s,");
    if (!is_frames && !start.starts_with("\x89HDF")) return;
    const std::filesystem::path recording = is_frames ? file.parent_path() / "recording.h5" : file;
    throw std::runtime_error(
        fmt::format("{}:1: is {} of a trace, and no path; play its recording with type = "
                    "\"recording\" and file = \"{}\" (--device recording:{})",
                    file.string(), is_frames ? "the frames" : "the recording", recording.string(),
                    recording.string()));
}

} // namespace

std::vector<DeviceState> read_probe_path(const std::filesystem::path& file, double rate_hz,
                                         int every) {
    check_arguments(rate_hz, every);
    refuse_results(file);
    internal::CsvRows rows(file, kHeader);
    FrameList frames(rate_hz, every);
    for (std::array<double, 4> numbers; rows.next(numbers);) {
        if (!std::isfinite(numbers[0]))
            rows.fail(fmt::format("t_s = {}", numbers[0]), "give a finite time in seconds");
        frames.add({numbers[0], {numbers[1], numbers[2], numbers[3]}}, rows);
    }
    std::vector<DeviceState> states = frames.take();
    if (states.empty()) rows.fail("no rows after the header", "give a row per frame");
    return states;
}

} // namespace palpate
