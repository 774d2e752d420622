// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace palpate::internal {

/// The rows of a CSV file of numbers under one header line. Line ends may be LF or CRLF; blanks
/// round numbers and empty lines at the end are allowed, a byte order mark at the begin. NaN and
/// inf are numbers. Everything throws std::runtime_error "FILE:LINE: what is wrong; what to do".
/// [setup]
class CsvRows {
public:
    /// `header`: the names of the columns, as "x_m,y_m,z_m".
    CsvRows(const std::filesystem::path& file, std::string_view header);

    /// The next row, as many numbers as the header has columns; false behind the last.
    bool next(std::span<double> numbers);
    /// Complains of the row that was read last or, before that, of the header.
    [[noreturn]] void fail(std::string_view what, std::string_view remedy) const;

private:
    std::string_view next_line();
    double number_from(std::string_view cell) const;

    std::filesystem::path file_;
    std::string header_;
    std::string text_;
    std::size_t at_ = 0;  // of the next line
    std::size_t end_ = 0; // of what is not blank
    std::size_t line_ = 1;
};

} // namespace palpate::internal
