// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/chart_frame.h>

#include <algorithm>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>

namespace palpate::internal {
namespace {

/// Width of a letter as a share of the text's size, the widest of its class in DejaVu Sans.
double letter_width(char letter) noexcept {
    constexpr std::string_view narrow = " .,:;'|!ijltfIr()[]/-";
    constexpr std::string_view wide = "mwMW%@";
    if ((static_cast<unsigned char>(letter) & 0xc0) == 0x80) return 0.0; // goes on a UTF-8 letter
    if (narrow.find(letter) != std::string_view::npos) return 0.42;
    if (wide.find(letter) != std::string_view::npos) return 1.0;
    if (letter >= 'A' && letter <= 'Z') return 0.75;
    return 0.64;
}

} // namespace

double width_px(ChartWidth width) noexcept { return width == ChartWidth::wide ? 720.0 : 340.0; }

double text_width_px(std::string_view text) noexcept {
    double width = 0.0;
    for (const char letter : text)
        width += letter_width(letter);
    return kChartText_px * width;
}

std::vector<std::string> lines_of(std::string_view text, double width_px) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find(' '), text.size());
        const std::string word(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        if (word.empty()) continue;
        if (!lines.empty() && text_width_px(lines.back() + " " + word) <= width_px)
            lines.back() += " " + word;
        else
            lines.push_back(word);
    }
    return lines;
}

std::string chart_text(double x, double y, std::string_view anchor,
                       const std::vector<std::string>& lines) {
    std::string svg;
    for (const std::string& line : lines) {
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y,
                           anchor, escape_html(line));
        y += kChartLine_px;
    }
    return svg;
}

std::string chart_opening(ChartWidth width, double height_px, std::string_view id,
                          std::string_view title, std::string_view description) {
    return fmt::format(
        "<svg class=\"{5}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" role=\"img\" "
        "aria-labelledby=\"{2}-title {2}-text\">\n<title id=\"{2}-title\">{3}</title>\n"
        "<desc id=\"{2}-text\">{4}</desc>\n",
        width_px(width), height_px, id, escape_html(title), escape_html(description),
        width == ChartWidth::wide ? "wide" : "narrow");
}

std::string chart_line(double left, double y, double width, std::string_view label) {
    constexpr double kGap = 6.0;      // between label and line
    constexpr double kBaseline = 4.5; // below the line
    return fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}h{:.1f}\"/>"
                       "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
                       left, y, width, left - kGap, y + kBaseline, label);
}

std::string
chart_in_page(std::string_view id,
              const std::function<std::string(ChartWidth, const std::string& id)>& draw) {
    const std::string wide = draw(ChartWidth::wide, fmt::format("{}-wide", id));
    if (wide.empty()) return {};
    return "<div class=\"chart\">\n" + wide +
           draw(ChartWidth::narrow, fmt::format("{}-narrow", id)) + "</div>\n";
}

} // namespace palpate::internal
