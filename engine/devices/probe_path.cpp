// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/probe_path.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/text/internal/csv_rows.h>
#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate {
namespace {

constexpr std::string_view kHeader = "t_s,x_m,y_m,z_m";
constexpr double kSpacingTolerance = 0.01; // of a period: docs/files.md 1, "within 1 %"

/// Throws what is wrong with the row that was taken last, and what to do about it.
using Complain = std::function<void(const std::string& what, const std::string& remedy)>;

/// Rows are frames: one period apart, whatever the recording's clock did.
void check_spacing(double spacing_s, double period_s, const Complain& complain) {
    if (std::abs(spacing_s - period_s) <= kSpacingTolerance * period_s) return;
    complain(
        fmt::format("{} s after the row before it instead of {} s (within 1 %)", spacing_s,
                    period_s),
        "resample the path to loop.rate_hz or set loop.rate_hz to the path's rate; t_s = 0 begins "
        "a trial");
}

/// The frames of a path; rows come in one after another.
class FrameList {
public:
    FrameList(double rate_hz, int every, Complain complain)
        : rate_hz_(rate_hz), every_(every), complain_(std::move(complain)), steps_(rate_hz) {}

    void add(const ProbeRow& row) {
        if (!std::isfinite(row.time_s))
            complain_(fmt::format("t_s = {}", row.time_s), "give a finite time in seconds");
        if (rows_ > 0 && row.time_s == 0.0) {
            steps_.begin_trial();
            rows_ = 0;
        }
        if (rows_ > 0) check_spacing(row.time_s - last_time_s_, 1.0 / rate_hz_, complain_);
        if (rows_ % every_ == 0) frames_.push_back(steps_.next(row.position));
        last_time_s_ = row.time_s;
        ++rows_;
    }

    std::vector<DeviceState> take() { return std::move(frames_); }

private:
    double rate_hz_;
    std::int64_t every_;
    Complain complain_;
    ProbeSteps steps_;
    std::vector<DeviceState> frames_;
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
    FrameList frames(rate_hz, every, [&rows](const std::string& what, const std::string& remedy) {
        rows.fail(what, remedy);
    });
    for (std::array<double, 4> numbers; rows.next(numbers);)
        frames.add({numbers[0], {numbers[1], numbers[2], numbers[3]}});
    std::vector<DeviceState> states = frames.take();
    if (states.empty()) rows.fail("no rows after the header", "give a row per frame");
    return states;
}

std::vector<DeviceState> probe_states(std::span<const ProbeRow> rows, double rate_hz, int every) {
    check_arguments(rate_hz, every);
    if (rows.empty()) throw std::invalid_argument("path: has no rows; give a row per frame");
    std::size_t at = 0;
    FrameList frames(rate_hz, every, [&at](const std::string& what, const std::string& remedy) {
        throw std::invalid_argument(fmt::format("path[{}]: {}; {}", at, what, remedy));
    });
    for (; at < rows.size(); ++at)
        frames.add(rows[at]);
    return frames.take();
}

void ProbeSteps::begin_trial() noexcept {
    if (count_ > 0) ++trial_;
    is_first_ = true;
}

DeviceState ProbeSteps::next(const Vec3& position) noexcept {
    DeviceState state;
    state.time_s = static_cast<double>(count_) / rate_hz_;
    state.position = position;
    state.trial = trial_;
    if (!is_first_) {
        const Vec3 velocity = (position - last_) * rate_hz_;
        if (is_finite(velocity)) state.velocity = velocity;
    }
    last_ = position;
    is_first_ = false;
    ++count_;
    return state;
}

} // namespace palpate
