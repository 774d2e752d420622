// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include <fmt/format.h>

#include <palpate/engine/internal/html.h>
#include <palpate/engine/internal/machine.h>
#include <palpate/engine/internal/report_style.h>
#include <palpate/engine/internal/series_chart.h>
#include <palpate/engine/internal/study_columns.h>
#include <palpate/engine/internal/whole_file.h>
#include <palpate/engine/scene_file.h>
#include <palpate/version.h>

namespace palpate::internal {
namespace {

constexpr double kSmallestError_um = 1e-6; // a picometre: what is below is rounding, drawn as one
constexpr double kSmallestTime_us = 1e-2;
constexpr std::size_t kMostPoints = 600; // of a line over time: more would share a pixel

std::string paragraph(const std::string& text) { return "<p>" + escape_html(text) + "</p>\n"; }

/// One line per method: where its settings lie between time and error.
std::string accuracy_chart(const Study& study) {
    SeriesChart chart{
        "Error against time",
        {"median us per frame in contact", ChartScale::logarithmic, kSmallestTime_us},
        {"distance from the surface, um rms", ChartScale::logarithmic, kSmallestError_um},
        {}};
    for (const StudyRun& run : study.runs) {
        if (run.baseline || !run.pace.empty()) continue;
        if (run.level.frames == 0 || run.frames_in_contact == 0) continue;
        const std::string method{name(run.loop.method)};
        if (chart.series.empty() || chart.series.back().name != method)
            chart.series.push_back({method, {}});
        chart.series.back().points.push_back({run.spent_p50_us, run.level.rms_um});
    }
    return series_chart(chart, "accuracy");
}

std::string drift_chart(const Study& study) {
    SeriesChart chart{"The proxy over time",
                      {"s", ChartScale::linear, 0.0},
                      {study.sphere ? "distance from the centre, mm" : "distance inside, um",
                       ChartScale::linear, 0.0},
                      {}};
    const std::size_t frames = study.time_s.size();
    const std::size_t every = frames / kMostPoints + 1;
    for (const StudyRun* run : runs_over_time(study)) {
        ChartSeries series{title(*run), {}};
        for (std::size_t i = 0; i < frames; i += every)
            series.points.push_back({study.time_s[i], place_of(study, *run, i)});
        chart.series.push_back(std::move(series));
    }
    return series_chart(chart, "drift");
}

std::string table(const Study& study) {
    std::vector<HtmlColumn> columns{{"", "method", false}};
    for (const StudyColumn& column : study_columns())
        columns.push_back({column.group, column.heading});
    std::vector<std::vector<std::string>> rows;
    for (const StudyRun& run : study.runs) {
        std::vector<std::string> row{title(run) + (run.is_the_scenes ? " *" : "")};
        for (const StudyColumn& column : study_columns())
            row.push_back(readable(column.value(run)));
        rows.push_back(std::move(row));
    }
    return html_table("Each method over its range; * the scene's own setting", columns, rows);
}

std::string weaknesses(const Study& study) {
    std::string html;
    for (const StudyRun& run : study.runs)
        if (run.baseline)
            html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name(*run.baseline)),
                                escape_html(weakness(*run.baseline)));
    if (html.empty()) return {};
    return "<h3>Methods from before the paper, and what they get wrong</h3>\n<dl>\n" + html +
           "</dl>\n" +
           paragraph("Their evaluations are queries of the field; single is the linear yielding "
                     "frame that the paper starts from.");
}

std::string footer(const std::string& command) {
    const Machine here = this_machine();
    return fmt::format("<footer>\n<p>Palpate {}; {}, {} cores, {}</p>\n<p><code>{}</code></p>\n"
                       "</footer>\n</main>\n</body>\n</html>\n",
                       kVersion, escape_html(here.cpu), here.cores, escape_html(here.system),
                       escape_html(command));
}

std::string or_unknown(const std::string& chart) {
    return chart.empty() ? paragraph("No chart: where the proxy should be is known for surfaces "
                                     "and formulas, and none of them was touched.")
                         : chart;
}

} // namespace

void write_study_page(const std::filesystem::path& file, const Scene& scene, const Study& study,
                      const std::string& command) {
    std::string page = kReportHead;
    page += fmt::format("<h1>Accuracy against time: {}</h1>\n",
                        escape_html(scene.description().file.stem().string()));
    page += paragraph(fmt::format(
        "{} frames at {} Hz, computed back to back by each method with each setting. Times, "
        "evaluations and sub-steps are of the frames in contact.",
        study.time_s.size(), readable(scene.description().loop.rate_hz)));
    page += "<h2>Error against time</h2>\n" + or_unknown(accuracy_chart(study));
    page +=
        paragraph("Distances below 0.000001 um, a picometre, are rounding and are drawn there.");
    page += table(study) + weaknesses(study);
    page += "<h2>The proxy over time</h2>\n" + or_unknown(drift_chart(study));
    page += footer(command);
    write_whole_file(file, page);
}

} // namespace palpate::internal
