// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::internal {

/// Text that may stand in HTML, between tags and in quoted attributes; control characters become
/// spaces.      [any]
std::string escape_html(std::string_view text);

/// Base 64 (RFC 4648, with padding).                                                    [any]
std::string base64(std::string_view bytes);

/// A number for people: three significant digits, all digits of integers and before the point; an
/// en dash where there is none or it is not finite. [any]
std::string readable(std::optional<double> value);

/// A column of an HTML table. Neighbours with the same group get a common heading above theirs.
struct HtmlColumn {
    std::string group; ///< may be empty
    std::string name;
    bool is_number = true; ///< set to the right
};

/// A table for eyes and screen readers: caption, scopes, first cell of a row as its heading,
/// scrolls sideways on a phone. Cells are escaped here. [setup]
std::string html_table(std::string_view caption, const std::vector<HtmlColumn>& columns,
                       const std::vector<std::vector<std::string>>& rows);

/// The beginning of a chart: an <svg> of the class `chart`, in pixels before the page scales it,
/// with its title and description for screen readers, which are escaped here. `id` must be unique
/// in the page. [setup]
std::string chart_opening(double width_px, double height_px, std::string_view id,
                          std::string_view title, std::string_view description);

/// A line across a chart from (`left`, `y`), `width` long, pixels, with its label at the left.
/// [setup]
std::string chart_line(double left, double y, double width, std::string_view label);

} // namespace palpate::internal
