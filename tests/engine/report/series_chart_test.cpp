// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/series_chart.h>

#include <cmath>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate::internal {
namespace {

using testing::HasSubstr;
using testing::Not;

SeriesChart chart_of(std::vector<std::array<double, 2>> points, ChartScale scale) {
    return {"t", {"x", scale, 1e-3}, {"y", scale, 1e-3}, {{"a", std::move(points), {}}}};
}

TEST(SeriesChart, DecadesAreEquallyFarApart) {
    const std::string svg =
        series_chart(chart_of({{1, 1}, {10, 10}, {100, 100}}, ChartScale::logarithmic), "c");
    // The plot is 660 by 320 from (72, 40): two decades, the middle one in the middle.
    EXPECT_THAT(svg, HasSubstr("d=\"M72.0 360.0 L402.0 200.0 L732.0 40.0 \""));
}

TEST(SeriesChart, WhatIsTooSmallForALogarithmIsDrawnAtTheSmallest) {
    const std::string svg =
        series_chart(chart_of({{0.0, 1}, {1, 1000}}, ChartScale::logarithmic), "c");
    EXPECT_THAT(svg, HasSubstr("d=\"M72.0 360.0 L732.0 40.0 \""));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(SeriesChart, ALineBreaksWhereThereIsNoNumber) {
    const std::string svg =
        series_chart(chart_of({{0, 0}, {1, 1}, {2, NAN}, {3, 1}, {4, 0}}, ChartScale::linear), "c");
    EXPECT_THAT(svg, HasSubstr("d=\"M72.0 360.0 L237.0 40.0 M567.0 40.0 L732.0 360.0 \""));
}

TEST(SeriesChart, NamesAreEscaped) {
    SeriesChart chart = chart_of({{0, 0}, {1, 1}}, ChartScale::linear);
    chart.series[0].name = "<b>";
    chart.title = "a & b";
    const std::string svg = series_chart(chart, "c");
    EXPECT_THAT(svg, Not(HasSubstr("<b>")));
    EXPECT_THAT(svg, HasSubstr("a &amp; b"));
}

TEST(SeriesChart, WithoutAPointThereIsNone) {
    EXPECT_EQ(series_chart(chart_of({{NAN, 1}}, ChartScale::linear), "c"), "");
    EXPECT_EQ(series_chart(chart_of({}, ChartScale::logarithmic), "c"), "");
}

TEST(SeriesChart, LabelledPointsAreNotJoinedAndTheirLabelsNotOverEachOther) {
    SeriesChart chart = chart_of({{0, 0}, {1, 1}, {1, 1}}, ChartScale::linear);
    chart.series[0].labels = {"<one>", "two", "three"};
    const std::string svg = series_chart(chart, "c");
    EXPECT_THAT(svg, Not(HasSubstr("class=\"line")));
    EXPECT_THAT(svg, HasSubstr("&lt;one&gt;</text>"));
    const auto place_of = [&](const std::string& label) {
        const std::size_t end = svg.find(">" + label + "</text>");
        return svg.substr(svg.rfind("<text", end), end - svg.rfind("<text", end));
    };
    // Text of 12 px, so that one line below the other or a word apart is enough.
    EXPECT_NE(place_of("two"), place_of("three"));
}

TEST(SeriesChart, SixSeriesHaveMarksOfTheirOwn) {
    SeriesChart chart{"t", {"x"}, {"y"}, {}};
    for (int i = 0; i < 6; ++i)
        chart.series.push_back({std::to_string(i), {{0.0, 0.0}, {1.0, 1.0}}, {}});
    const std::string svg = series_chart(chart, "c");
    std::set<std::string> shapes;
    for (int i = 0; i < 6; ++i) {
        const std::string mark = "class=\"mark s" + std::to_string(i) + "\" d=\"M";
        const std::size_t at = svg.rfind(mark); // in the plot, where all are at the same place
        ASSERT_NE(at, std::string::npos);
        const std::size_t begin = at + mark.size();
        shapes.insert(svg.substr(begin, svg.find('"', begin) - begin));
    }
    EXPECT_EQ(shapes.size(), 6u);
}

TEST(SeriesChart, OnePointIsDrawn) {
    const std::string svg = series_chart(chart_of({{5, 5}}, ChartScale::linear), "c");
    EXPECT_THAT(svg, HasSubstr("class=\"mark s0\""));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

} // namespace
} // namespace palpate::internal
