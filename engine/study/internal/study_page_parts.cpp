// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/study_page_parts.h>

#include <algorithm>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/series_chart.h>

namespace palpate::internal {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string paragraph(const std::string& text) { return "<p>" + escape_html(text) + "</p>\n"; }

std::string number(bool known, double value) {
    return readable(known ? std::optional(value) : std::nullopt);
}

/// Positions are known to what their reference is, levels to rounding.
double known_to_um(const Study& study, TradedError error) {
    const bool of_reference = error == TradedError::position && study.reference;
    return of_reference ? study.reference->own_error.rms_um : 0.0;
}

std::string trade_off_of(const Study& study, TradedError error, const char* caption) {
    const double known_um = known_to_um(study, error);
    const std::vector<TradeOff> trades = trade_offs(study.runs, error, known_um);
    if (trades.empty()) return {};
    std::vector<HtmlColumn> columns{{"", "method", false}};
    for (const double error_um : kEqualErrors_um)
        columns.push_back({"us for an error of", fmt::format("{:g} um", error_um)});
    for (const double time_us : kEqualTimes_us)
        columns.push_back({"um rms in frames of", fmt::format("{:g} us", time_us)});
    Rows rows;
    for (const TradeOff& trade : trades) {
        rows.push_back({trade.method + (trade.certified ? "" : " (not certified)")});
        for (const std::optional<double>& time_us : trade.cheapest_us)
            rows.back().push_back(readable(time_us));
        for (const std::optional<double>& error_um : trade.best_um)
            rows.back().push_back(error_um && *error_um < known_um ? "< " + readable(known_um)
                                                                   : readable(error_um));
    }
    return html_table(caption, columns, rows);
}

std::string costs_of(const Study& study, const std::string& run) {
    Rows rows;
    std::string no_instructions;
    for (const CostPart& part : study.costs) {
        if (part.run != run) continue;
        const bool counted = part.part != "rest";
        rows.push_back({part.part, number(counted, part.count), number(counted, part.each_ns),
                        readable(part.frame_us), readable(part.per_evaluation_ns)});
        no_instructions = part.no_instructions;
        if (!no_instructions.empty()) continue;
        rows.back().push_back(readable(part.frame_instructions));
        rows.back().push_back(readable(part.per_evaluation_instructions));
    }
    std::vector<HtmlColumn> columns{{"", "part", false},
                                    {"", "per frame"},
                                    {"", "ns each"},
                                    {"", "us per frame"},
                                    {"", "ns per evaluation"}};
    if (no_instructions.empty()) {
        columns.push_back({"instructions", "per frame"});
        columns.push_back({"instructions", "per evaluation"});
    }
    return html_table("Where a frame of " + run + " goes", columns, rows);
}

std::string prices_of(const Study& study) {
    Rows rows;
    for (const FramePrice& price : study.prices) {
        const bool known = price.why_not.empty();
        rows.push_back({price.what, number(known, price.price_us),
                        number(known, price.range_us.p10_us), number(known, price.range_us.p90_us),
                        number(known, price.with_us), number(known, price.without_us),
                        price.why_not});
    }
    return html_table("What an effect or another contact adds to a frame",
                      {{"", "", false},
                       {"us", "median"},
                       {"us", "p10"},
                       {"us", "p90"},
                       {"us per frame", "with"},
                       {"us per frame", "without"},
                       {"", "not known, as", false}},
                      rows);
}

enum class Whose { loops, others };

/// A line per method over the sweep's values; empty where none ran. The methods of others have a
/// chart of their own: beside `adaptive`, whose errors are a millionth of theirs, they would be one
/// line.
std::string sweep_chart(const Sweep& sweep, Whose whose) {
    const bool of_level = sweep.kind == SweepKind::voxels || sweep.kind == SweepKind::facets;
    const bool of_others = whose == Whose::others;
    SeriesChart chart{
        fmt::format("Error over {}{}", name(sweep.kind), of_others ? ", methods of others" : ""),
        {fmt::format("{}, {}", name(sweep.kind), unit(sweep.kind)), ChartScale::logarithmic, 1e-3},
        {of_level ? "distance from the surface, um rms"
                  : "distance from the converged proxy, um rms",
         ChartScale::logarithmic, 1e-6},
        {}};
    constexpr std::size_t kOthersLooks = 4; // behind those of the loop's four methods
    for (const SweepRow& row : sweep.rows) {
        const StudyRun::Error& error = of_level ? row.run.level : row.run.converged;
        if (!row.why_not.empty() || error.frames == 0) continue;
        if (row.run.baseline.has_value() != of_others) continue;
        const std::string method{method_of(row.run)};
        auto series = std::find_if(chart.series.begin(), chart.series.end(),
                                   [&](const ChartSeries& known) { return known.name == method; });
        if (series == chart.series.end()) {
            series = chart.series.insert(chart.series.end(), {method, {}, {}});
            series->look = chart.series.size() - 1 + (of_others ? kOthersLooks : 0);
        }
        series->points.push_back({row.value, error.rms_um});
    }
    return series_chart(chart,
                        fmt::format("sweep-{}{}", name(sweep.kind), of_others ? "-others" : ""));
}

/// The charts of a sweep; none of contacts, which have no order.
std::string sweep_charts(const Sweep& sweep) {
    if (sweep.kind == SweepKind::contact) return {};
    const std::string others = sweep_chart(sweep, Whose::others);
    return sweep_chart(sweep, Whose::loops) +
           (others.empty() ? "" : paragraph("The methods of others:") + others);
}

std::string sweep_html(const Sweep& sweep) {
    const std::string what = fmt::format("{} {}", name(sweep.kind), unit(sweep.kind));
    std::vector<HtmlColumn> columns{{"", what, false}, {"", "method", false}};
    const bool has_size = std::any_of(sweep.rows.begin(), sweep.rows.end(),
                                      [](const SweepRow& row) { return row.size > 0.0; });
    if (has_size) columns.push_back({"", sweep.kind == SweepKind::voxels ? "voxels" : "facets"});
    for (const char* heading : {"median", "p10", "p90"})
        columns.push_back({"us per frame", heading});
    columns.push_back({"um rms", "from the surface"});
    columns.push_back({"um rms", "from the converged proxy"});
    Rows rows;
    for (const SweepRow& row : sweep.rows) {
        const bool ran = row.why_not.empty();
        const StudyRun& run = row.run;
        const bool felt = ran && run.frames_in_contact > 0;
        rows.push_back(
            {sweep.kind == SweepKind::contact ? row.contact : fmt::format("{:g}", row.value),
             ran ? title(run) : "not known: " + row.why_not});
        if (has_size) rows.back().push_back(number(row.size > 0.0, row.size));
        rows.back().push_back(number(felt, run.spent_p50_us));
        rows.back().push_back(number(felt, run.spent_p50_range_us.p10_us));
        rows.back().push_back(number(felt, run.spent_p50_range_us.p90_us));
        rows.back().push_back(number(ran && run.level.frames > 0, run.level.rms_um));
        rows.back().push_back(number(ran && run.converged.frames > 0, run.converged.rms_um));
    }
    std::string html = "<h3>" + escape_html(name(sweep.kind)) + "</h3>\n" + sweep_charts(sweep) +
                       html_table("Over " + what, columns, rows);
    if (sweep.fits.empty()) return html;
    Rows fits;
    for (const PowerFit& fit : sweep.fits)
        fits.push_back({fit.of, fmt::format("{:.2f}", fit.exponent),
                        fmt::format("{:.2f}", fit.standard_error), readable(fit.points)});
    return html +
           html_table("Fitted exponents",
                      {{"", "", false}, {"", "exponent"}, {"", "standard error"}, {"", "points"}},
                      fits);
}

} // namespace

std::string trade_off_section(const Study& study) {
    const std::string position =
        trade_off_of(study, TradedError::position,
                     "Equal error and equal time: distance from the converged proxy");
    const std::string level =
        trade_off_of(study, TradedError::level, "The same for the distance from the surface");
    if (position.empty() && level.empty()) return {};
    std::string html = position;
    if (study.reference && study.reference->along.frames > 0)
        html += paragraph(fmt::format(
            "At the converged proxy, {} um rms of the way to the probe lie along the surface: at "
            "the point nearest to the probe there would be none, whichever method found it.",
            readable(study.reference->along.rms_um)));
    if (study.reference)
        html += paragraph(fmt::format(
            "The converged proxy is that of the same scene with {}. It is known to {} um rms. A "
            "proxy may be on the surface and yet far from where it should be on it: then its "
            "distance from the surface is small and its position is wrong.",
            study.reference->method, readable(study.reference->own_error.rms_um)));
    return html + level;
}

std::string cost_section(const Study& study) {
    if (study.costs.empty() && study.prices.empty()) return {};
    std::string html = "<h2>What a frame costs, and why</h2>\n";
    std::string last;
    for (const CostPart& part : study.costs) {
        if (part.run == last) continue;
        last = part.run;
        html += costs_of(study, part.run);
    }
    if (!study.costs.empty())
        html += paragraph("Counters of the frames, times prices measured beside them: no clock is "
                          "read within a frame. The parts need not add up, and the rest is what is "
                          "left. Below 0 it says that the parts overlap within a frame.");
    if (!study.costs.empty() && !study.costs.front().no_instructions.empty())
        html +=
            paragraph("Instructions are not known: " + study.costs.front().no_instructions + ".");
    return study.prices.empty() ? html : html + prices_of(study);
}

std::string error_section(const Study& study) {
    if (study.errors.empty()) return {};
    Rows rows;
    for (const ErrorPart& part : study.errors) {
        const bool known = part.position.frames > 0;
        const bool of_level = part.level.frames > 0;
        rows.push_back({part.source, number(known, part.position.rms_um),
                        number(known, part.position.p99_um), number(known, part.position.max_um),
                        number(known, part.known_to_um), number(of_level, part.level.rms_um),
                        number(of_level, part.level.max_um),
                        part.why_not.empty() ? part.how : "not known: " + part.why_not});
    }
    return "<h2>Where the error comes from</h2>\n" +
           html_table("Each source alone, all others made exact, um",
                      {{"", "source", false},
                       {"position", "rms"},
                       {"position", "p99"},
                       {"position", "max"},
                       {"position", "known to"},
                       {"distance from the surface", "rms"},
                       {"distance from the surface", "max"},
                       {"", "how", false}},
                      rows);
}

std::string sweep_section(const Study& study) {
    if (study.sweeps.empty()) return {};
    std::string html = "<h2>What it depends on</h2>\n";
    for (const Sweep& sweep : study.sweeps)
        html += sweep_html(sweep);
    return html;
}

} // namespace palpate::internal
