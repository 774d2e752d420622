// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/trace_summary_reader.h>
#include <palpate/engine/report/report_page.h>

namespace palpate {
namespace {

using internal::Number;
using internal::readable;
using internal::SurfaceSummary;

/// Characters of UTF-8 text as a terminal counts them, combining and wide ones aside.
std::size_t width_of(const std::string& text) {
    return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
        return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;
    }));
}

Number sum(Number a, Number b, Number c) {
    if (!a && !b && !c) return std::nullopt;
    return a.value_or(0.0) + b.value_or(0.0) + c.value_or(0.0);
}

std::vector<std::string> row_of(const ReportTrace& trace) {
    const internal::TraceSummary s = internal::read_trace_summary(trace.title, trace.summary);
    const auto pair = [](Number a, Number b) { return readable(a) + " / " + readable(b); };
    const auto most = [&](Number (*number)(const SurfaceSummary&)) {
        return largest(s.surfaces, number);
    };
    return {trace.title,
            readable(s.frames),
            readable(s.frames_in_contact),
            pair(s.sub_steps.mean, s.sub_steps.max),
            pair(s.spent_us.p50, s.spent_us.p99),
            readable(sum(s.field_samples, s.roots, s.surface_queries)),
            pair(s.force_n.p50, s.force_n.max),
            pair(most([](const SurfaceSummary& of) { return of.distance_um.rms; }),
                 most([](const SurfaceSummary& of) { return of.distance_um.p99; })),
            pair(most([](const SurfaceSummary& of) { return of.position_um.rms; }),
                 most([](const SurfaceSummary& of) { return of.position_um.p99; })),
            readable(most([](const SurfaceSummary& of) { return of.chord_depth_mm; }))};
}

} // namespace

std::string report_table(const std::vector<ReportSubject>& subjects) {
    std::vector<std::vector<std::string>> rows{
        {"", "frames", "in", "sub-steps", "us/frame", "queries", "force N", "off surface um",
         "off place um", "deepest"},
        {"trace", "", "contact", "mean / max", "p50 / p99", "per frame", "p50 / max", "rms / p99",
         "rms / p99", "chord mm"}};
    for (const ReportSubject& subject : subjects)
        for (const ReportTrace& trace : subject.traces)
            rows.push_back(row_of(trace));

    std::vector<std::size_t> widths(rows.front().size(), 0);
    for (const auto& row : rows)
        for (std::size_t i = 0; i < row.size(); ++i)
            widths[i] = std::max(widths[i], width_of(row[i]));

    std::string table;
    for (const auto& row : rows) {
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string room(widths[i] - width_of(row[i]), ' ');
            table += i == 0 ? row[i] + room : "  " + room + row[i];
        }
        table += '\n';
    }
    return table;
}

std::string path_in_words(const ReportTrace& trace) {
    const internal::TraceSummary s = internal::read_trace_summary(trace.title, trace.summary);
    if (s.path.type.empty()) return {};
    std::string text = "depth of the " + s.path.type + "'s probe behind what held it, mm: median " +
                       readable(s.depth_mm.p50) + ", 99 % " + readable(s.depth_mm.p99) + ", max " +
                       readable(s.depth_mm.max) + "; deeper than asked for in " +
                       readable(s.path.deeper_frames) + " frames\n";
    for (const internal::CoverageSummary& one : s.path.coverage)
        text += "covered: " + readable(one.felt_percent) + " % of " + one.surface + " (" +
                readable(one.area_cm2) + " cm2), within " + readable(one.within_mm) +
                " mm of where it was felt\n";
    return text;
}

} // namespace palpate
