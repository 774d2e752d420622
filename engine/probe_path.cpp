// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/probe_path.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/internal/text_file.h>

namespace palpate {
namespace {

constexpr std::string_view kHeader = "t_s,x_m,y_m,z_m";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF"; // spreadsheets begin UTF-8 with it
constexpr std::size_t kColumns = 4;
constexpr double kSpacingTolerance = 0.01; // of a period: contract.md, "within 1 %"

struct Row {
    double time_s = 0.0;
    Vec3 position{0.0};
};

/// Where a row is, for messages.
struct Place {
    const std::filesystem::path& file;
    std::size_t line = 0;
};

[[noreturn]] void fail(const Place& place, std::string_view what, std::string_view remedy) {
    throw std::runtime_error(
        fmt::format("{}:{}: {}; {}", place.file.string(), place.line, what, remedy));
}

/// The next line without its end, LF or CRLF; `rest` moves on behind it.
std::string_view next_line(std::string_view& rest) {
    const std::size_t end = rest.find('\n');
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

std::string_view without_blanks(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t'))
        text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t'))
        text.remove_suffix(1);
    return text;
}

/// Text of a file in a message: short, and on one line.
std::string quoted(std::string_view text) {
    constexpr std::size_t longest = 40;
    std::string shown(text.substr(0, longest));
    std::replace_if(
        shown.begin(), shown.end(), [](unsigned char c) { return c < 0x20; }, ' ');
    return fmt::format("\"{}{}\"", shown, text.size() > longest ? "..." : "");
}

double parse_number(std::string_view cell, const Place& place) {
    const std::string_view text = without_blanks(cell);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::result_out_of_range)
        fail(place, fmt::format("{} does not fit a number", quoted(text)), "give a double");
    if (error != std::errc() || end != text.data() + text.size())
        fail(place, fmt::format("{} is not a number", quoted(text)),
             "write decimals with a point, columns with commas");
    return value;
}

Row parse_row(std::string_view line, const Place& place) {
    const auto columns = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (columns != kColumns)
        fail(place, fmt::format("{} columns instead of {}", columns, kColumns),
             fmt::format("give {}", kHeader));
    std::array<double, kColumns> numbers{};
    for (double& number : numbers) {
        const std::size_t comma = std::min(line.find(','), line.size());
        number = parse_number(line.substr(0, comma), place);
        line.remove_prefix(std::min(comma + 1, line.size()));
    }
    if (!std::isfinite(numbers[0]))
        fail(place, fmt::format("t_s = {}", numbers[0]), "give a finite time in seconds");
    return {numbers[0], {numbers[1], numbers[2], numbers[3]}};
}

/// Rows are frames: one period apart, whatever the recording's clock did.
void check_spacing(double spacing_s, double period_s, const Place& place) {
    if (std::abs(spacing_s - period_s) <= kSpacingTolerance * period_s) return;
    fail(place,
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

    void add(const Row& row, const Place& place) {
        if (rows_ > 0 && row.time_s == 0.0) {
            ++trial_;
            rows_ = 0;
        }
        if (rows_ > 0) check_spacing(row.time_s - last_time_s_, 1.0 / rate_hz_, place);
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

} // namespace

std::vector<DeviceState> read_probe_path(const std::filesystem::path& file, double rate_hz,
                                         int every) {
    check_arguments(rate_hz, every);
    const std::string text =
        internal::read_text_file(file, fmt::format("a CSV file with the columns {}", kHeader));
    std::string_view rest = text;
    if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());

    Place place{file, 1};
    const std::string_view header = next_line(rest);
    if (without_blanks(header) != kHeader)
        fail(place, fmt::format("the header is {}", quoted(header)),
             fmt::format("begin with {}", kHeader));

    FrameList frames(rate_hz, every);
    rest = rest.substr(0, rest.find_last_not_of(" \t\r\n") + 1); // npos + 1 = 0: nothing but blanks
    while (!rest.empty()) {
        ++place.line;
        frames.add(parse_row(next_line(rest), place), place);
    }
    std::vector<DeviceState> states = frames.take();
    if (states.empty()) fail(place, "no rows after the header", "give a row per frame");
    return states;
}

} // namespace palpate
