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
/// scrolls sideways on a phone. With more than 16 columns it is printed on pages of its own,
/// turned. Cells are escaped here. [setup]
std::string html_table(std::string_view caption, const std::vector<HtmlColumn>& columns,
                       const std::vector<std::vector<std::string>>& rows);

} // namespace palpate::internal
