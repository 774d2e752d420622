// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/machine.h>
#include <palpate/engine/report/internal/report_style.h>
#include <palpate/engine/report/internal/series_chart.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/study/internal/study_columns.h>
#include <palpate/engine/study/internal/study_page_parts.h>
#include <palpate/engine/text/internal/front_mark.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/version.h>

namespace palpate::internal {
namespace {

constexpr double kSmallestError_um = 1e-6; // a picometre: what is below is rounding, drawn as one
constexpr double kSmallestTime_us = 1e-2;
constexpr std::size_t kMostRows = 12;    // of the table beside it
constexpr std::size_t kMostPoints = 600; // of a line over time: more would share a pixel

std::string paragraph(const std::string& text) { return "<p>" + escape_html(text) + "</p>\n"; }

bool is_in_accuracy_chart(const StudyRun& run) {
    return run.level.frames > 0 && run.frames_in_contact > 0;
}

/// The series of the chart that a run belongs to: its method, or all of a kind.
std::string series_of(const StudyRun& run) {
    if (run.baseline) return "others";
    return run.pace.empty() ? std::string(name(run.loop.method)) : "real time";
}

/// The letter of a run in real time among those in the chart, whose names would not fit there:
/// "a" .. "z"; empty for other runs.
std::string letter_of(const StudyRun& run, const Study& study) {
    if (run.pace.empty()) return {};
    char letter = 'a';
    for (const StudyRun& other : study.runs) {
        if (&other == &run) break;
        if (!other.pace.empty() && is_in_accuracy_chart(other) && letter < 'z') ++letter;
    }
    return {letter};
}

/// One line per method, where its settings lie between time and error; a point for each baseline
/// and each run in real time, of which the reference at the clock's pace knows no positions.
SeriesChart accuracy_chart(const Study& study, TradedError of) {
    const bool of_position = of == TradedError::position;
    SeriesChart chart{of_position ? "Error of position against time" : "Error against time",
                      {"median us per frame in contact", ChartScale::logarithmic, kSmallestTime_us},
                      {of_position ? "distance from the converged proxy, um rms"
                                   : "distance from the surface, um rms",
                       ChartScale::logarithmic,
                       of_position && study.reference
                           ? std::max(kSmallestError_um, study.reference->own_error.rms_um)
                           : kSmallestError_um},
                      {}};
    for (const StudyRun& run : study.runs) {
        const StudyRun::Error& error = of_position ? run.converged : run.level;
        if (error.frames == 0 || run.frames_in_contact == 0) continue;
        const std::string series = series_of(run);
        if (chart.series.empty() || chart.series.back().name != series)
            chart.series.push_back({series, {}, {}});
        chart.series.back().points.push_back({run.spent_p50_us, error.rms_um});
        if (run.baseline) chart.series.back().labels.push_back(title(run));
        if (!run.pace.empty()) chart.series.back().labels.push_back(letter_of(run, study));
    }
    return chart;
}

/// The first picture: what accuracy costs; nothing where no position is known.
std::string front(const Study& study) {
    const std::string chart = series_chart(accuracy_chart(study, TradedError::position), "front");
    if (chart.empty()) return {};
    return "<h2>What accuracy costs in time</h2>\n" + chart +
           paragraph(fmt::format(
               "Each point is a method with a setting: how far its proxy is from "
               "where it should be, and how long its frames take. Nearer to the "
               "lower left is better. Others: methods up to the paper's own, and one "
               "after it. "
               "Distances below {} um are drawn there.",
               readable(std::max(kSmallestError_um, study.reference->own_error.rms_um))));
}

std::string accuracy_table(const Study& study) {
    std::vector<std::vector<std::string>> rows;
    for (const StudyRun& run : study.runs) {
        if (!is_in_accuracy_chart(run)) continue;
        const std::string letter = letter_of(run, study);
        rows.push_back({(letter.empty() ? "" : letter + ": ") + title_with_mark(run),
                        readable(run.spent_p50_us), readable(run.level.rms_um)});
    }
    return html_table("The points of the chart",
                      {{"", "method", false}, {"", "us"}, {"", "um rms"}}, rows);
}

/// The frames that are drawn.
std::size_t frames_per_point(const Study& study) { return study.time_s.size() / kMostPoints + 1; }

std::string drift_unit(const Study& study) {
    return study.sphere ? "distance from the centre, mm" : "distance inside, um";
}

std::string drift_chart(const Study& study) {
    SeriesChart chart{"The proxy over time",
                      {"s", ChartScale::linear, 0.0},
                      {drift_unit(study), ChartScale::linear, 0.0},
                      {}};
    for (const StudyRun* run : runs_over_time(study)) {
        ChartSeries series{title(*run), {}, {}};
        for (std::size_t i = 0; i < study.time_s.size(); i += frames_per_point(study))
            series.points.push_back({study.time_s[i], place_of(study, *run, i)});
        chart.series.push_back(std::move(series));
    }
    return series_chart(chart, "drift");
}

/// Some of the chart's points, as numbers.
std::string drift_table(const Study& study) {
    std::vector<HtmlColumn> columns{{"", "s", false}};
    for (const StudyRun* run : runs_over_time(study))
        columns.push_back({drift_unit(study), title(*run)});
    std::vector<std::vector<std::string>> rows;
    const std::size_t every = study.time_s.size() / kMostRows + 1;
    for (std::size_t i = every - 1; i < study.time_s.size(); i += every) {
        std::vector<std::string> row{fmt::format("{:.4g}", study.time_s[i])};
        for (const StudyRun* run : runs_over_time(study)) {
            const double place = place_of(study, *run, i);
            // A radius is told apart by digits that readable() would round away.
            row.push_back(study.sphere && std::isfinite(place) ? fmt::format("{:.4f}", place)
                                                               : readable(place));
        }
        rows.push_back(std::move(row));
    }
    return html_table("The same in numbers", columns, rows);
}

/// A chart with its table, or why there is none.
std::string beside(const std::string& chart, const std::string& table) {
    if (chart.empty())
        return paragraph("No chart: where the proxy should be is known for surfaces and formulas, "
                         "and none of them was touched.");
    return "<div class=\"beside\">\n" + chart + table + "</div>\n";
}

std::string table(const Study& study, std::span<const StudyColumn> of, const char* caption) {
    std::vector<HtmlColumn> columns{{"", "method", false}};
    for (const StudyColumn& column : of)
        columns.push_back({column.group, column.heading});
    std::vector<std::vector<std::string>> rows;
    for (const StudyRun& run : study.runs) {
        std::vector<std::string> row{title_with_mark(run) + (run.is_the_scenes ? " *" : "")};
        for (const StudyColumn& column : of)
            row.push_back(readable(column.value(run)));
        rows.push_back(std::move(row));
    }
    return html_table(caption, columns, rows);
}

std::string table(const Study& study) {
    return table(study, study_columns(), "Each method over its range; * the scene's own setting") +
           table(study, later_study_columns(),
                 "The same methods: spread of the times, queries, and the converged proxy");
}

std::string weaknesses(const Study& study) {
    std::string html;
    for (const StudyRun& run : study.runs)
        if (run.baseline)
            html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name(*run.baseline)),
                                escape_html(weakness(*run.baseline)));
    if (html.empty())
        return paragraph("Other methods run over one level of a volume: this scene "
                         "has none, or several.");
    return "<h3>Other methods, and what they get wrong</h3>\n<dl>\n" + html + "</dl>\n" +
           paragraph(fmt::format("Each in its plainest form, with queries of the field for "
                                 "evaluations. Haptic primitives have {} N at the level and behind "
                                 "it, from nothing {} mm in front of it.",
                                 readable(kPrimitiveStrength_n), readable(1e3 * kPrimitiveRamp_m)));
}

std::string footer(const std::string& command) {
    const Machine here = this_machine();
    return fmt::format("<footer>\n<p>Palpate {}; {}, {} cores, {}</p>\n<p><code>{}</code></p>\n"
                       "</footer>\n</main>\n</body>\n</html>\n",
                       kVersion, escape_html(here.cpu), here.cores, escape_html(here.system),
                       escape_html(command));
}

} // namespace

void write_study_front(const std::filesystem::path& file, const Study& study) {
    const std::array charts{accuracy_chart(study, TradedError::position)};
    write_whole_file(file, std::string(kFrontBeginning) + "\n" +
                               series_picture(charts, ChartWidth::narrow));
}

void write_study_page(const std::filesystem::path& file, const Scene& scene, const Study& study,
                      const std::string& command) {
    const std::string heading =
        "Accuracy against time: " + scene.description().file.stem().string();
    std::string page = page_head(heading + " (Palpate study)");
    page += "<h1>" + escape_html(heading) + "</h1>\n";
    page += paragraph(fmt::format(
        "{} frames at {} Hz, computed back to back by each method with each setting. Times, "
        "evaluations and sub-steps are of the frames in contact.",
        study.time_s.size(), readable(scene.description().loop.rate_hz)));
    page += front(study) + trade_off_section(study) + cost_section(study) + error_section(study);
    page += "<h2>Distance from the surface against time</h2>\n" +
            beside(series_chart(accuracy_chart(study, TradedError::level), "accuracy"),
                   accuracy_table(study));
    page += paragraph(
        "Others: methods up to the paper's own, and one after it: more below. Letters: runs in "
        "real time, as the table names them. Distances below 0.000001 um, a "
        "picometre, are rounding and are drawn there.");
    page += table(study);
    const auto noted = std::find_if(study.runs.begin(), study.runs.end(),
                                    [](const StudyRun& run) { return !run.note.empty(); });
    if (noted != study.runs.end()) page += paragraph("Not certified: " + noted->note + ".");
    page += paragraph(
        "Inside: frames that end deeper than the certificate's tolerance. The certified proxy is "
        "that of method adaptive, which no chord takes through the surface: contact is lost in "
        "frames with less than a tenth of its force, where the probe is over 0.5 mm from it.");
    page += weaknesses(study);
    page += sweep_section(study);
    page += "<h2>The proxy over time</h2>\n" + beside(drift_chart(study), drift_table(study));
    page += footer(command);
    write_whole_file(file, page);
}

} // namespace palpate::internal
