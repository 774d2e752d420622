// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/html.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace palpate::internal {
namespace {

constexpr std::string_view kNothing = "\u2013";

std::string heading(const HtmlColumn& column, std::string_view scope, std::string_view more,
                    std::string_view text) {
    return fmt::format("<th scope=\"{}\"{}{}>{}</th>", scope, more,
                       column.is_number ? " class=\"n\"" : "", escape_html(text));
}

/// One row of headings, or two where columns have groups.
std::string table_head(const std::vector<HtmlColumn>& columns) {
    const bool grouped = std::any_of(columns.begin(), columns.end(),
                                     [](const HtmlColumn& c) { return !c.group.empty(); });
    std::string above;
    std::string below;
    for (std::size_t i = 0; i < columns.size();) {
        const HtmlColumn& column = columns[i];
        if (column.group.empty()) {
            above += heading(column, "col", grouped ? " rowspan=\"2\"" : "", column.name);
            ++i;
            continue;
        }
        std::size_t end = i;
        for (; end < columns.size() && columns[end].group == column.group; ++end)
            below += heading(columns[end], "col", "", columns[end].name);
        above += fmt::format("<th scope=\"colgroup\" colspan=\"{}\" class=\"g\">{}</th>", end - i,
                             escape_html(column.group));
        i = end;
    }
    std::string head = "<thead><tr>" + above + "</tr>";
    if (grouped) head += "<tr>" + below + "</tr>";
    return head + "</thead>\n";
}

} // namespace

std::string escape_html(std::string_view text) {
    std::string escaped;
    escaped.reserve(text.size());
    for (const char c : text) {
        switch (c) {
        case '&':
            escaped += "&amp;";
            break;
        case '<':
            escaped += "&lt;";
            break;
        case '>':
            escaped += "&gt;";
            break;
        case '"':
            escaped += "&quot;";
            break;
        case '\'':
            escaped += "&#39;";
            break;
        default: {
            const auto code = static_cast<unsigned char>(c);
            escaped += code < 0x20 || code == 0x7f ? ' ' : c;
        }
        }
    }
    return escaped;
}

std::string readable(std::optional<double> value) {
    if (!value || !std::isfinite(*value)) return std::string(kNothing);
    constexpr double kAllDigits = 100.0;     // from here on three digits stand before the point
    constexpr double kLargestInteger = 1e15; // beyond, digits would be made up
    const double size = std::abs(*value);
    if (size >= kLargestInteger) return fmt::format("{:.2e}", *value);
    if (size >= kAllDigits || std::round(size) == size) return fmt::format("{:.0f}", *value + 0.0);
    std::string text = fmt::format("{:.3g}", *value);
    if (text != "100" && text != "-100") return text;
    // 99.96 is no 100: of shares and of bounds that would say too much.
    return fmt::format("{:.2f}", std::copysign(std::floor(100.0 * size) / 100.0, *value));
}

std::string html_table(std::string_view caption, const std::vector<HtmlColumn>& columns,
                       const std::vector<std::vector<std::string>>& rows) {
    constexpr std::size_t kUpright = 16; // columns that paper is wide enough for
    std::string html =
        fmt::format("<div class=\"scroll{1}\" role=\"region\" tabindex=\"0\" aria-label=\"{0}\">\n"
                    "<table><caption><span>{0}</span></caption>\n",
                    escape_html(caption), columns.size() > kUpright ? " many" : "");
    html += table_head(columns) + "<tbody>\n";
    for (const std::vector<std::string>& row : rows) {
        html += "<tr>";
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string cell = escape_html(row[i]);
            if (i == 0)
                html += "<th scope=\"row\">" + cell + "</th>";
            else
                html += (columns[i].is_number ? "<td class=\"n\">" : "<td>") + cell + "</td>";
        }
        html += "</tr>\n";
    }
    return html + "</tbody></table></div>\n";
}

} // namespace palpate::internal
