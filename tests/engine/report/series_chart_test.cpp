// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/series_chart.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/report_style.h>
#include <palpate/engine/text/whole_file.h>

#include "tests/support/text_count.h"

namespace palpate::internal {
namespace {

using test::count_of;
using testing::HasSubstr;
using testing::Not;

SeriesChart chart_of(std::vector<std::array<double, 2>> points, ChartScale scale) {
    return {"t", {"x", scale, 1e-3}, {"y", scale, 1e-3}, {{"a", std::move(points), {}}}};
}

/// The numbers of the first line's path, x and y in turn.
std::vector<double> line_of(const std::string& svg) {
    const std::string before = "class=\"line s0\" d=\"";
    const std::size_t begin = svg.rfind(before) + before.size(); // the last is not the legend's
    std::string path = svg.substr(begin, svg.find('"', begin) - begin);
    for (char& c : path)
        if (std::isalpha(static_cast<unsigned char>(c))) c = ' ';
    std::istringstream text(path);
    return {std::istream_iterator<double>(text), {}};
}

constexpr double kRounding_px = 0.11; // positions have one digit

TEST(SeriesChart, DecadesAreEquallyFarApart) {
    const auto at = line_of(
        series_chart(chart_of({{1, 1}, {10, 10}, {100, 100}}, ChartScale::logarithmic), "c"));
    ASSERT_EQ(at.size(), 6u);
    EXPECT_NEAR(at[2] - at[0], at[4] - at[2], kRounding_px);
    EXPECT_NEAR(at[3] - at[1], at[5] - at[3], kRounding_px);
    EXPECT_GT(at[2], at[0]);
    EXPECT_LT(at[3], at[1]); // upwards
}

// Ticks between them would be rounding, and never get from one to the next.
TEST(SeriesChart, ValuesThatDifferByRoundingAreOneLine) {
    for (const double value : {1.0, -3e-7, 1e17, 1e300}) {
        const double next = std::nextafter(value, 2.0 * value);
        const std::string svg =
            series_chart(chart_of({{value, value}, {next, next}}, ChartScale::linear), "c");
        EXPECT_EQ(line_of(svg).size(), 4u) << value;
        EXPECT_LT(svg.size(), 20000u) << value;
    }
}

TEST(SeriesChart, WhatIsTooSmallForALogarithmIsDrawnAtTheSmallest) {
    const SeriesChart chart = chart_of({{0.0, 1}, {1, 1000}}, ChartScale::logarithmic);
    SeriesChart at_smallest = chart;
    at_smallest.series[0].points[0][0] = chart.x.smallest;
    const std::string svg = series_chart(chart, "c");
    EXPECT_EQ(line_of(svg), line_of(series_chart(at_smallest, "c")));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(SeriesChart, ALineBreaksWhereThereIsNoNumber) {
    const std::string svg =
        series_chart(chart_of({{0, 0}, {1, 1}, {2, NAN}, {3, 1}, {4, 0}}, ChartScale::linear), "c");
    const std::string before = "class=\"line s0\" d=\"";
    const std::size_t begin = svg.rfind(before) + before.size();
    const std::string path = svg.substr(begin, svg.find('"', begin) - begin);
    EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
    EXPECT_EQ(std::count(path.begin(), path.end(), 'L'), 2);
}

TEST(SeriesChart, APointBetweenGapsIsSeen) {
    const std::string svg = series_chart(
        chart_of({{0, 0}, {1, NAN}, {2, 1}, {3, NAN}, {4, 0}}, ChartScale::linear), "c");
    const std::string before = "class=\"line s0\" d=\"";
    const std::size_t begin = svg.rfind(before) + before.size();
    const std::string path = svg.substr(begin, svg.find('"', begin) - begin);
    EXPECT_EQ(std::count(path.begin(), path.end(), 'h'), 3); // each is alone
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
    // The places' own test has that they are not over each other.
    EXPECT_NE(place_of("two"), place_of("three"));
}

SeriesChart chart_of_lines(std::size_t count, std::size_t points) {
    SeriesChart chart{"t", {"x"}, {"y"}, {}};
    for (std::size_t i = 0; i < count; ++i) {
        ChartSeries series{"n" + std::to_string(i), {}, {}};
        for (std::size_t k = 0; k < points; ++k)
            series.points.push_back({static_cast<double>(k), static_cast<double>(i)});
        chart.series.push_back(std::move(series));
    }
    return chart;
}

TEST(SeriesChart, ALegendHasTheLineAndTheMarkerOfItsSeriesHoweverManyPointsThereAre) {
    for (const std::size_t points : {2u, 600u}) {
        const std::string svg = series_chart(chart_of_lines(16, points), "c");
        for (std::size_t i = 0; i < 16; ++i) {
            const std::string look = " s" + std::to_string(i) + "\"";
            EXPECT_EQ(count_of(svg, "class=\"line" + look), 4u) << i; // legend and plot, two widths
            EXPECT_GE(count_of(svg, "class=\"mark" + look), 4u) << i;
            EXPECT_LE(count_of(svg, "class=\"mark" + look), 18u) << i; // eight of many in each
        }
    }
}

TEST(SeriesChart, ALookThatIsGivenIsTheOneInLegendAndPlot) {
    SeriesChart chart = chart_of_lines(1, 2);
    chart.series[0].look = 5;
    const std::string svg = series_chart(chart, "c");
    EXPECT_EQ(count_of(svg, "class=\"line s5\""), 4u);
    EXPECT_EQ(count_of(svg, " s0\""), 0u);
}

TEST(SeriesChart, APageHasItWideAndNarrowWithIdsOfTheirOwn) {
    const std::string svg = series_chart(chart_of_lines(1, 2), "c");
    EXPECT_EQ(count_of(svg, "<svg class=\"wide\""), 1u);
    EXPECT_EQ(count_of(svg, "<svg class=\"narrow\""), 1u);
    EXPECT_EQ(count_of(svg, "id=\"c-wide-title\""), 1u);
    EXPECT_EQ(count_of(svg, "id=\"c-narrow-title\""), 1u);
}

TEST(SeriesChart, LabelledPointsOfALineAreJoinedWhereThatIsAsked) {
    SeriesChart chart = chart_of({{0, 0}, {1, 1}}, ChartScale::linear);
    chart.series[0].labels = {"first", ""};
    chart.series[0].form = SeriesForm::line;
    const std::string svg = series_chart(chart, "c");
    EXPECT_EQ(count_of(svg, "class=\"line s0\""), 4u);
    EXPECT_EQ(count_of(svg, "class=\"label\""), 2u);
}

TEST(SeriesChart, TheFrontHasThePointsThatNoneIsBetterThan) {
    std::mt19937 random(11);
    std::uniform_int_distribution<int> value(0, 9); // few values, so that there are ties
    for (int round = 0; round < 200; ++round) {
        std::vector<ChartSeries> series(2);
        for (int i = 0; i < 12; ++i)
            series[static_cast<std::size_t>(i % 2)].points.push_back(
                {1.0 * value(random), i == 7 ? NAN : 1.0 * value(random)});
        // The definition, word for word.
        std::set<std::array<double, 2>> expected;
        const auto each = [&](auto&& visit) {
            for (const ChartSeries& one : series)
                for (const auto& point : one.points)
                    if (std::isfinite(point[1])) visit(point);
        };
        each([&](const std::array<double, 2>& p) {
            bool beaten = false;
            each([&](const std::array<double, 2>& q) {
                beaten = beaten || (q[0] <= p[0] && q[1] <= p[1] && q != p);
            });
            if (!beaten) expected.insert(p);
        });
        const auto front = pareto_front(series);
        EXPECT_EQ(std::set(front.begin(), front.end()), expected);
        EXPECT_EQ(front.size(), expected.size());
        EXPECT_TRUE(std::is_sorted(front.begin(), front.end()));
    }
}

TEST(SeriesChart, TheFrontIsDrawnAndInTheLegendWhereItHasAName) {
    SeriesChart chart = chart_of_lines(2, 3);
    EXPECT_EQ(count_of(series_chart(chart, "c"), "class=\"front\""), 0u);
    chart.front = "nothing is faster and better";
    const std::string svg = series_chart(chart, "c");
    EXPECT_EQ(count_of(svg, "class=\"front\""), 4u);
    EXPECT_THAT(svg, HasSubstr(">nothing is faster and better</text>"));
}

TEST(SeriesChart, APictureIsAFileOfItsOwnWithColoursForLightAndDark) {
    const std::vector<SeriesChart> charts{chart_of_lines(2, 3), chart_of({}, ChartScale::linear),
                                          chart_of_lines(1, 3)};
    const std::string svg = series_picture(charts, ChartWidth::narrow);
    EXPECT_THAT(svg, testing::StartsWith("<svg xmlns=\"http://www.w3.org/2000/svg\""));
    EXPECT_EQ(count_of(svg, "class=\"narrow\""), 2u); // one has no points
    EXPECT_EQ(count_of(svg, "<svg"), count_of(svg, "</svg>"));
    EXPECT_THAT(svg, HasSubstr("prefers-color-scheme: dark"));
    EXPECT_THAT(svg, HasSubstr(".line.s1"));
}

TEST(SeriesChart, OnePointIsDrawn) {
    const std::string svg = series_chart(chart_of({{5, 5}}, ChartScale::linear), "c");
    EXPECT_THAT(svg, HasSubstr("class=\"mark s0\""));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

/// Errors against times as a study has them, with names at all points: nine series of `points`.
SeriesChart crowded_scatter(int points) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    SeriesChart chart{"Error against time",
                      {"median us per frame in contact", ChartScale::logarithmic, 1e-2},
                      {"distance of the proxy from where an exact method would have it, um rms",
                       ChartScale::logarithmic, 1e-6},
                      {},
                      "the best for their time"};
    for (int i = 0; i < 9; ++i) {
        ChartSeries series{"method number " + std::to_string(i + 1), {}, {}};
        if (i % 2 == 0) series.form = SeriesForm::line;
        for (int k = 0; k < points; ++k) {
            const double time = std::pow(10.0, 3.0 * (k + share(random)) / points);
            series.points.push_back({time, std::pow(10.0, -1.0 - 4.0 * share(random)) * time});
            // The first of a line, and all points that stand alone.
            const bool named = i % 2 == 1 || k == 0;
            series.labels.push_back(named ? "way " + std::to_string(10 * i + k) : "");
        }
        chart.series.push_back(std::move(series));
    }
    return chart;
}

TEST(SeriesChart, EachLabelOfAScatterFindsRoomOnAPhoneToo) {
    // Thirteen; of seventeen, two are left out on a phone.
    const std::string svg = series_chart(crowded_scatter(2), "c");
    EXPECT_EQ(count_of(svg, "class=\"label\""), 2u * (5u + 4u * 2u));
}

/// Charts that are hard to lay out, for what pages_test.cmake measures in a browser.
TEST(SeriesChart, HardOnesFillAPage) {
    SeriesChart long_lines = chart_of_lines(16, 600);
    for (ChartSeries& series : long_lines.series)
        series.name += " with a name that is longer than most";
    SeriesChart negative = chart_of({{-1e-7, -123456.0}, {2e-7, 98765.0}}, ChartScale::linear);
    negative.x.name =
        "a name of an axis that is by far too long to stand on one line of a phone, N/m";
    std::string page = page_head("Charts") + "<h1>Charts</h1>\n";
    int id = 0;
    for (const SeriesChart& chart :
         {crowded_scatter(3), long_lines, negative, chart_of({{5, 5}}, ChartScale::logarithmic),
          chart_of({{1e-9, 1}, {1e9, 2}}, ChartScale::logarithmic)})
        page += "<h2>Chart</h2>\n" + series_chart(chart, "chart" + std::to_string(id++));
    page += "<h2>Table</h2>\n" +
            html_table("A caption that is so long that it has to be broken where a phone ends",
                       std::vector<HtmlColumn>(24, {"a group", "heading"}),
                       std::vector(60, std::vector<std::string>(24, "1.23e-06"))) +
            "</main>\n</body>\n</html>\n";
    EXPECT_EQ(count_of(page, "<svg class=\"narrow\""), 5u);
    EXPECT_THAT(page, Not(HasSubstr("nan")));
    const std::vector<SeriesChart> charts{crowded_scatter(2), negative};
    if (const char* file = std::getenv("PALPATE_CHART_PAGE")) {
        write_whole_file(file, page);
        write_whole_file(std::string(file) + ".svg", series_picture(charts, ChartWidth::narrow));
    }
}

} // namespace
} // namespace palpate::internal
