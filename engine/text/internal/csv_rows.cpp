// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/internal/csv_rows.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <palpate/engine/text/text_file.h>

namespace palpate::internal {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF"; // spreadsheets begin UTF-8 with it

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

} // namespace

CsvRows::CsvRows(const std::filesystem::path& file, std::string_view header)
    : file_(file), header_(header),
      text_(read_text_file(file, fmt::format("a CSV file with the columns {}", header))) {
    end_ = text_.find_last_not_of(" \t\r\n") + 1; // npos + 1 = 0: nothing but blanks
    if (text_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
    const std::string_view found = next_line();
    if (without_blanks(found) != header_)
        fail(fmt::format("the header is {}", quoted(found)), fmt::format("begin with {}", header_));
}

void CsvRows::fail(std::string_view what, std::string_view remedy) const {
    throw std::runtime_error(fmt::format("{}:{}: {}; {}", file_.string(), line_, what, remedy));
}

/// The next line without its end, LF or CRLF.
std::string_view CsvRows::next_line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = std::string_view(text_).substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

bool CsvRows::next(std::span<double> numbers) {
    if (at_ >= end_) return false;
    ++line_;
    std::string_view line = next_line();
    const auto columns = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (columns != numbers.size())
        fail(fmt::format("{} columns instead of {}", columns, numbers.size()),
             fmt::format("give {}", header_));
    for (double& number : numbers) {
        const std::size_t comma = std::min(line.find(','), line.size());
        number = number_from(line.substr(0, comma));
        line.remove_prefix(std::min(comma + 1, line.size()));
    }
    return true;
}

double CsvRows::number_from(std::string_view cell) const {
    const std::string_view text = without_blanks(cell);
    double value = 0.0;
    // A sign in front of what is positive, as printf's "%+f" writes it, is unknown to from_chars().
    const std::size_t sign = text.starts_with('+') && !text.starts_with("+-") ? 1 : 0;
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data() + sign, last, value);
    if (error == std::errc::result_out_of_range)
        fail(fmt::format("{} does not fit a number", quoted(text)), "give a double");
    if (error != std::errc() || end != last)
        fail(fmt::format("{} is not a number", quoted(text)),
             "write decimals with a point, columns with commas");
    return value;
}

} // namespace palpate::internal
