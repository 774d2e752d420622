// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/report_page.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/time_chart.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/text_count.h"

namespace palpate {
namespace {

using test::count_of;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kDash = "\u2013";

constexpr const char* kSummary = R"({
 "version": "0.1.0", "scene": {"file": "skull.toml", "sha256": "00"}, "something_new": [1, 2],
 "machine": {"cpu": "Model <7>", "cores": 2, "system": "Linux 6.1"},
 "method": "adaptive", "contact": "volume", "pace": "asap",
 "frames": 48197, "trials": 1, "frames_in_contact": 26700, "overruns": 3,
 "spent_us": {"mean": 2.0, "p50": 1.8, "p90": 3.0, "p99": 7.3, "max": 90.0},
 "sub_steps": {"mean": 2.125, "p50": 2, "p90": 3, "p99": 5, "max": 8},
 "queries_per_frame": {"field_samples": 2.9, "roots": 2.6, "surface_queries": 0.0},
 "force_n": {"p50": 1.01, "p99": 2.5, "max": 4.1},
 "surfaces": [
  {"name": "skin", "contact": "volume", "level": 40.0, "level_distance_um": {"rms": 0.01, "p99": 0.02, "max": null}},
  {"name": "bone", "contact": "volume", "level": 255.5, "shift_mean_mm": 0.001, "shift_sd_mm": 0.11,
   "level_distance_um": {"frames": 26700, "mean": 0.01, "rms": 0.14, "p50": 0.0, "p99": 0.05, "max": 15.5},
   "deepest_chord": {"value_above_level": 9.99, "tolerance": 10.0, "depth_mm": 0.023, "frame": 3121}}],
 "felt": [{"bit": 0, "name": "periosteum", "frames": 26701, "contact_s": 26.7, "force_mean_n": 1.22,
   "force_max_n": 4.31, "path_mm": 5343.0}],
 "truth": {"level_um": {"mean": 0.31, "rms": 0.41, "p99": 0.51, "max": 0.61}, "position_um": {}},
 "flags": [{"name": "stalled", "frames": 12}, {"name": "odd", "frames": 1, "meaning": "never <seen>"}],
 "effects": [{"type": "surface", "surface": "bone", "cost_us": 0.93}]})";

std::shared_ptr<const TriangleMesh> tetrahedron() {
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->vertices = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
    mesh->triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    return mesh;
}

std::vector<FrameReport> frames_of(std::size_t count) {
    std::vector<FrameReport> frames(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double t = 1e-3 * static_cast<double>(i);
        frames[i].frame = i;
        frames[i].time_s = t;
        frames[i].proxy =
            Vec3(0.03 + 0.01 * std::cos(6.0 * t), -1e-4, 0.03 + 0.01 * std::sin(6.0 * t));
        frames[i].force = Vec3(0.0, 1.0 + std::sin(9.0 * t), 0.0);
        frames[i].contacts = 1;
    }
    return frames;
}

ReportSubject subject_of(const std::string& title, const std::string& summary) {
    return {title, nullptr, {{title + ", adaptive", summary, frames_of(3000)}}};
}

/// One with pictures.
ReportSubject drawn_subject_of(const std::string& title, const std::string& summary) {
    ReportSubject subject = subject_of(title, summary);
    subject.mesh = tetrahedron();
    return subject;
}

/// A page without its pictures' bytes: in them anything may stand.
std::string without_pictures(const std::string& page) {
    const std::string mark = ";base64,";
    std::string rest;
    std::size_t from = 0;
    for (std::size_t at = page.find(mark); at != std::string::npos; at = page.find(mark, from)) {
        rest += page.substr(from, at - from);
        from = page.find('"', at);
    }
    return rest + page.substr(from);
}

/// The words of a line, those of the title first.
std::vector<std::string> words_of(const std::string& line) {
    std::istringstream stream(line);
    return {std::istream_iterator<std::string>(stream), {}};
}

class ReportPage : public testing::Test {
protected:
    std::string written(const std::vector<ReportSubject>& subjects,
                        const std::vector<std::string>& notes = {}) {
        write_report_page(folder_.path() / "report.html", subjects, notes);
        EXPECT_EQ(test::files_in(folder_.path()), 1u);
        return test::content_of(folder_.path() / "report.html");
    }
    const std::filesystem::path& folder() const { return folder_.path(); }

private:
    test::TemporaryFolder folder_;
};

TEST(ReportTable, ShowsTheNumbersOfTheSummaryWithTheWorstSurface) {
    const std::string table = report_table({subject_of("skull", kSummary)});
    std::istringstream lines(table);
    std::string line;
    for (int i = 0; i < 3; ++i)
        std::getline(lines, line);
    // 2.9 + 2.6 + 0 queries; distances and chord are bone's, the worse ones.
    const std::vector<std::string> expected{
        "skull,", "adaptive", "48197", "26700", "2.12", "/",    "8",   "1.8", "/",   "7.3",  "5.5",
        "1.01",   "/",        "4.1",   "0.14",  "/",    "0.05", kDash, "/",   kDash, "0.023"};
    EXPECT_EQ(words_of(line), expected);
}

// A proxy may be on its mesh and still far behind.
TEST(ReportTable, ShowsTheDistanceFromWhereTheProxyShouldBeWhereThatIsKnown) {
    const std::string table = report_table({subject_of("sphere", R"({"surfaces": [
        {"name": "wall", "mesh_distance_um": {"rms": 3.5e-12, "p99": 4.5e-12},
         "position_error_um": {"rms": 483.0, "p99": 512.0}}]})")});
    EXPECT_THAT(table, HasSubstr("3.5e-12 / 4.5e-12"));
    EXPECT_THAT(table, HasSubstr("483 / 512"));
}

TEST(ReportTable, LinesAreOfOneWidthWhateverTheTitles) {
    const std::string table = report_table(
        {subject_of("Sch\u00e4del", kSummary), subject_of("a much longer title", "{}")});
    std::istringstream lines(table);
    std::vector<std::size_t> widths;
    for (std::string line; std::getline(lines, line);)
        widths.push_back(static_cast<std::size_t>(
            std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; })));
    ASSERT_EQ(widths.size(), 4u);
    EXPECT_EQ(std::count(widths.begin(), widths.end(), widths.front()), 4);
}

TEST(ReportTable, AbsentNumbersAreDashes) {
    const std::string table = report_table({subject_of("x", "{}")});
    EXPECT_THAT(table, HasSubstr(kDash));
    EXPECT_EQ(
        report_table({subject_of("x", R"({"frames": null, "surfaces": null, "spent_us": {}})")}),
        table);
}

TEST(ReportTable, SummaryThatIsNoneIsAnErrorThatNamesTheTrace) {
    for (const char* summary :
         {"", "not json", "[1, 2]", R"({"frames": "many"})", R"({"spent_us": 3})",
          R"({"surfaces": [3]})", R"({"surfaces": {}})", R"({"version": 1})", "{\"frames\": 1"}) {
        SCOPED_TRACE(summary);
        try {
            report_table({subject_of("skull", summary)});
            ADD_FAILURE() << "nothing was thrown";
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_EQ(message.rfind("skull, adaptive: summary", 0), 0u) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos);
        }
    }
}

TEST_F(ReportPage, ShowsTablesPicturesAndCharts) {
    const std::string page = written(
        {drawn_subject_of("skull", kSummary), drawn_subject_of("brain", kSummary)}, {"A note."});
    EXPECT_EQ(page.rfind("<!DOCTYPE html>", 0), 0u);
    EXPECT_THAT(page, HasSubstr("<html lang=\"en\">"));
    EXPECT_THAT(page, HasSubstr("name=\"viewport\""));
    EXPECT_THAT(page, HasSubstr("prefers-color-scheme: dark"));
    EXPECT_THAT(page, HasSubstr("<p>A note.</p>"));
    EXPECT_EQ(count_of(page, "<img "), 4u);
    EXPECT_EQ(count_of(page, "src=\"data:image/png;base64,iVBORw0KGgo"), 4u);
    EXPECT_EQ(count_of(page, "<div class=\"chart\">"), 2u);
    EXPECT_EQ(count_of(page, "<svg class=\"legend\""), 2u);
    for (const char* number :
         {"48197", "26700", "7.3", "2.12", "15.5", "9.99", "3121", "0.023", "0.11", "0.93", "0.61",
          "periosteum", "26701", "26.7", "1.22", "4.31"})
        EXPECT_THAT(page, HasSubstr(">" + std::string(number) + "<"));
    // The meaning of a flag that the summary only names.
    EXPECT_THAT(page, HasSubstr("no certified step was left"));
    EXPECT_THAT(page, HasSubstr("Model &lt;7&gt;"));
    EXPECT_THAT(page, HasSubstr("never &lt;seen&gt;"));
}

TEST_F(ReportPage, LoadsNothingAndRunsNothing) {
    const std::string page = written({drawn_subject_of("skull", kSummary)}, {"note"});
    const std::string text = without_pictures(page);
    for (const char* word :
         {"http:", "https:", "//", "<script", "<link", "@import", "url(", "onload", "<iframe"})
        EXPECT_THAT(text, Not(HasSubstr(word))) << word;
    EXPECT_THAT(page, HasSubstr("default-src 'none'"));
}

TEST_F(ReportPage, LinksToPagesThatPlayATraceAndToNoOthers) {
    ReportSubject skull = drawn_subject_of("skull", kSummary);
    EXPECT_EQ(written({skull}, {}).find("<a "), std::string::npos);
    skull.traces.front().playback = "my \"skull\" #1.html";
    const std::string page = written({skull, drawn_subject_of("brain", kSummary)}, {});
    EXPECT_EQ(count_of(page, "<a "), 1u);
    EXPECT_THAT(page, HasSubstr("<a href=\"my%20%22skull%22%20%231.html\">Play "));
}

TEST_F(ReportPage, TextFromOutsideIsEscapedEverywhere) {
    const std::string title = "<b>&\"'</b>";
    const std::string page = written({drawn_subject_of(title, kSummary)}, {"<i>note</i>"});
    EXPECT_THAT(page, Not(HasSubstr("<b>")));
    EXPECT_THAT(page, Not(HasSubstr("<i>")));
    EXPECT_THAT(page, HasSubstr("<h2>&lt;b&gt;&amp;&quot;&#39;&lt;/b&gt;</h2>"));
    EXPECT_THAT(page, HasSubstr("alt=\"&lt;b&gt;&amp;&quot;&#39;&lt;/b&gt;, seen"));
}

TEST_F(ReportPage, TablesHaveHeadingsForScreenReaders) {
    const std::string page = written({drawn_subject_of("skull", kSummary)});
    EXPECT_EQ(count_of(page, "<table>"), count_of(page, "<caption>"));
    EXPECT_EQ(count_of(page, "<th "), count_of(page, "<th scope="));
    EXPECT_EQ(count_of(page, "<img "), count_of(page, " alt=\"skull, seen along"));
    EXPECT_EQ(count_of(page, "<svg "), count_of(page, "role=\"img\" aria-label"));
    EXPECT_GE(count_of(page, "<th scope=\"row\">"), 5u);
}

TEST_F(ReportPage, ElementsAreClosedInOrder) {
    const std::string page = written({drawn_subject_of("<", kSummary), subject_of("\"", "{}")});
    const std::vector<std::string> alone{"!DOCTYPE", "meta", "img", "path", "rect"};
    std::vector<std::string> open;
    for (std::size_t at = page.find('<'); at != std::string::npos; at = page.find('<', at + 1)) {
        const bool closes = page[at + 1] == '/';
        const std::size_t first = at + (closes ? 2 : 1);
        const std::string name = page.substr(first, page.find_first_of(" />\n", first) - first);
        if (std::find(alone.begin(), alone.end(), name) != alone.end()) continue;
        if (!closes) {
            open.push_back(name);
            continue;
        }
        ASSERT_FALSE(open.empty()) << name;
        ASSERT_EQ(open.back(), name) << "at " << at;
        open.pop_back();
    }
    EXPECT_TRUE(open.empty());
}

TEST_F(ReportPage, RowsHaveAsManyCellsAsHeadings) {
    const std::string page = written({subject_of("skull", kSummary)});
    const std::size_t first = page.find("<tbody>");
    const std::string row = page.substr(first, page.find("</tr>", first) - first);
    // 16 columns: the trace and 15 numbers.
    EXPECT_EQ(count_of(row, "<td"), 15u);
    EXPECT_EQ(count_of(row, "<th scope=\"row\""), 1u);
}

TEST_F(ReportPage, SubjectWithoutMeshOrFramesIsStillReported) {
    ReportSubject bare{"bare", nullptr, {{"bare trace", "{}", {}}}};
    ReportSubject empty{"empty", std::make_shared<TriangleMesh>(), {}};
    const std::string page = written({bare, empty});
    EXPECT_EQ(count_of(page, "<img "), 0u);
    EXPECT_EQ(count_of(page, "<div class=\"chart\">"), 0u);
    EXPECT_EQ(count_of(page, "No picture"), 2u);
    EXPECT_THAT(page, HasSubstr("bare trace"));
}

TEST_F(ReportPage, NothingIsLeftWhereItCannotBeWritten) {
    const std::filesystem::path missing = folder() / "missing" / "report.html";
    try {
        write_report_page(missing, {subject_of("skull", kSummary)}, {});
        FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()).rfind(missing.string() + ": ", 0), 0u) << error.what();
    }
    EXPECT_THROW(write_report_page(folder() / "report.html", {subject_of("skull", "[")}, {}),
                 std::runtime_error);
    EXPECT_EQ(test::files_in(folder()), 0u);
}

TEST_F(ReportPage, ShowsHowSoftSurfacesGaveWay) {
    EXPECT_THAT(
        written({subject_of("skull", kSummary)}),
        testing::AllOf(Not(HasSubstr("What gave way")), Not(HasSubstr("Indentation over time"))));
    std::string summary = kSummary;
    summary.insert(summary.find(" \"truth\""),
                   " \"pressed\": [{\"name\": \"periosteum\", \"indentation_mm\": {\"frames\": "
                   "777, \"p50\": 1.375, \"max\": 3.125}, \"stiffness_n_per_mm\": {\"p50\": "
                   "0.1875, \"max\": 0.4375}}],\n");
    ReportSubject subject = subject_of("skull", summary);
    subject.traces[0].frames[100].indentation_m = 3.125e-3;
    const std::string page = written({subject});
    for (const char* said : {"What gave way", "777", "1.38", "3.12", "0.188", "0.438",
                             "Indentation over time", "Stiffness over time"})
        EXPECT_THAT(page, HasSubstr(said));
}

TEST(TimeChart, OfAPeakedIndentationIsInMillimetres) {
    std::vector<FrameReport> frames = frames_of(100);
    frames[50].indentation_m = 3.25e-3;
    EXPECT_DOUBLE_EQ(internal::largest_of(internal::kIndentation, frames), 3.25);
    const std::string svg =
        internal::chart_over_time(internal::kIndentation, frames, 3.25, "skin", "x");
    EXPECT_THAT(svg, HasSubstr("Indentation over time: skin"));
    EXPECT_THAT(svg, HasSubstr("at most 3.25 mm"));
    // The band goes along its top and back, in the wide and in the narrow chart.
    EXPECT_EQ(count_of(svg, " 24.0 "), 4u);
}

TEST(ForceChart, KeepsAPeakOfOneFrame) {
    std::vector<FrameReport> frames = frames_of(100000);
    for (FrameReport& frame : frames)
        frame.force = Vec3(0.1, 0.0, 0.0);
    frames[54321].force = Vec3(0.0, 0.0, -4.0);
    const std::string svg = internal::chart_over_time(internal::kForce, frames, 4.0, "peak", "x");
    // The top of the plot is 24 pixels down. It begins at 46 and has a column for each of its 660
    // pixels, or 280 where it is narrow; the peak is in column 54321 / 100000 of them, 358 or 152,
    // and drawn at its middle.
    EXPECT_THAT(svg, HasSubstr("404.5 24.0 "));
    EXPECT_THAT(svg, HasSubstr("198.5 24.0 "));
    EXPECT_EQ(count_of(svg, ".5 24.0 "), 2u);
    EXPECT_LT(svg.size(), 60000u);
}

TEST(ForceChart, ForcesThatAreNoNumbersLeaveAGap) {
    std::vector<FrameReport> frames = frames_of(200); // fewer than columns
    frames[100].force.x = std::numeric_limits<double>::quiet_NaN();
    const std::string svg = internal::chart_over_time(internal::kForce, frames, 2.0, "gap", "x");
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_EQ(count_of(svg, "Z"), 4u); // wide and narrow
    EXPECT_EQ(internal::chart_over_time(internal::kForce, {}, 1.0, "", "x"), "");
}

TEST(Html, ControlCharactersBecomeSpaces) {
    EXPECT_EQ(internal::escape_html(std::string("a\0b\x1b[1m\n", 8)), "a b [1m ");
}

TEST(Html, NumbersAreReadable) {
    EXPECT_EQ(internal::readable(std::nullopt), kDash);
    EXPECT_EQ(internal::readable(std::numeric_limits<double>::quiet_NaN()), kDash);
    EXPECT_EQ(internal::readable(48197.0), "48197");
    EXPECT_EQ(internal::readable(1234.5678), "1235");
    EXPECT_EQ(internal::readable(0.0123456), "0.0123");
    for (const double almost : {99.96, 99.996, 99.99999})
        EXPECT_NE(internal::readable(almost), "100");
    EXPECT_EQ(internal::readable(-99.996), "-99.99");
    EXPECT_EQ(internal::readable(99.2), "99.2");
    EXPECT_EQ(internal::readable(100.0), "100");
    EXPECT_EQ(internal::readable(-0.0), "0");
    EXPECT_EQ(internal::readable(1e300), "1.00e+300");
}

} // namespace
} // namespace palpate
