// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/report_page.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

#include <palpate/engine/picture/internal/force_colors.h>
#include <palpate/engine/picture/picture.h>
#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/report_style.h>
#include <palpate/engine/report/internal/time_chart.h>
#include <palpate/engine/report/internal/trace_summary_reader.h>
#include <palpate/engine/text/base64.h>
#include <palpate/engine/text/url.h>
#include <palpate/engine/text/whole_file.h>

namespace palpate {
namespace {

using internal::escape_html;
using internal::html_table;
using internal::HtmlColumn;
using internal::Number;
using internal::readable;
using internal::SurfaceSummary;
using internal::TraceSummary;

/// A trace with its summary read.
struct Entry {
    const ReportTrace* trace;
    TraceSummary summary;
};
using Cells = std::vector<std::string>;

std::vector<Entry> entries_of(const std::vector<ReportSubject>& subjects) {
    std::vector<Entry> entries;
    for (const ReportSubject& subject : subjects)
        for (const ReportTrace& trace : subject.traces)
            entries.push_back({&trace, internal::read_trace_summary(trace.title, trace.summary)});
    return entries;
}

std::string paragraph(const std::string& text) { return "<p>" + escape_html(text) + "</p>\n"; }

/// What a term means, a line each.
std::string definitions(const std::vector<std::array<std::string, 2>>& terms) {
    std::string html = "<dl>\n";
    for (const auto& [term, meaning] : terms)
        html += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", escape_html(term),
                            escape_html(meaning));
    return html + "</dl>\n";
}

std::string main_table(const std::vector<Entry>& entries) {
    const std::vector<HtmlColumn> columns{
        {"", "Trace", false},
        {"Frames", "all"},
        {"Frames", "in contact"},
        {"Frames", "overruns"},
        {"Sub-steps per frame", "mean"},
        {"Sub-steps per frame", "max"},
        {"Time per frame, \u00b5s", "median"},
        {"Time per frame, \u00b5s", "99 %"},
        {"Queries per frame", "samples"},
        {"Queries per frame", "roots"},
        {"Queries per frame", "surface"},
        {"Force, N", "median"},
        {"Force, N", "max"},
        {"Distance, \u00b5m", "rms"},
        {"Distance, \u00b5m", "99 %"},
        {"", "Deepest chord, mm"},
    };
    std::vector<Cells> rows;
    for (const auto& [trace, s] : entries) {
        const Number rms =
            largest(s.surfaces, [](const SurfaceSummary& of) { return of.distance_um.rms; });
        const Number p99 =
            largest(s.surfaces, [](const SurfaceSummary& of) { return of.distance_um.p99; });
        const Number chord =
            largest(s.surfaces, [](const SurfaceSummary& of) { return of.chord_depth_mm; });
        Cells row{trace->title};
        for (const Number& number :
             {s.frames, s.frames_in_contact, s.overruns, s.sub_steps.mean, s.sub_steps.max,
              s.spent_us.p50, s.spent_us.p99, s.field_samples, s.roots, s.surface_queries,
              s.force_n.p50, s.force_n.max, rms, p99, chord})
            row.push_back(readable(number));
        rows.push_back(row);
    }
    return html_table("Traces", columns, rows) +
           definitions({
               {"Frames",
                "One for each position of the hand, usually 1000 per second. In contact: something "
                "pushed back at the frame's end. Overruns: frames that took longer than their "
                "period; in real time, late or long frames by which a period was missed."},
               {"Sub-steps",
                "Movements of the proxy within a frame. The proxy is the point that stays on the "
                "surface while the hand presses through it."},
               {"Time per frame",
                "Measured around the computation of a frame; half of the frames are faster "
                "than the median, 99 of 100 faster than the last column."},
               {"Queries",
                "Values or gradients read from the volume (samples), exact searches for where a "
                "line first meets the level (roots), rays and closest points of the mesh "
                "(surface)."},
               {"Force", "What the device was sent, after its limits: the median of all frames and "
                         "the largest."},
               {"Distance",
                "How far the proxy was from the surface's level while in contact, or from the "
                "mesh where it alone is felt; 0 is exact. With several surfaces: the worst one."},
               {"Deepest chord",
                "How deep the proxy's straight movements led into the material at most, "
                "corners of the surface being cut."},
           });
}

std::string surfaces_table(const std::vector<Entry>& entries) {
    const std::vector<HtmlColumn> columns{
        {"", "Trace", false},
        {"", "Surface", false},
        {"", "Contact", false},
        {"", "Level"},
        {"Shift by smoothing, mm", "mean"},
        {"Shift by smoothing, mm", "sd"},
        {"Distance, \u00b5m", "mean"},
        {"Distance, \u00b5m", "rms"},
        {"Distance, \u00b5m", "median"},
        {"Distance, \u00b5m", "99 %"},
        {"Distance, \u00b5m", "max"},
        {"Deepest chord", "above level"},
        {"Deepest chord", "allowed"},
        {"Deepest chord", "mm"},
        {"Deepest chord", "frame"},
        {"Mesh", "passed through"},
        {"Mesh", "held, frames"},
        {"Mesh", "held, events"},
    };
    std::vector<Cells> rows;
    for (const auto& [trace, summary] : entries)
        for (const SurfaceSummary& s : summary.surfaces) {
            Cells row{trace->title, s.name, s.contact};
            const internal::SpreadSummary& d = s.distance_um;
            for (const Number& number :
                 {s.level, s.shift_mean_mm, s.shift_sd_mm, d.mean, d.rms, d.p50, d.p99, d.max,
                  s.chord_value, s.chord_tolerance, s.chord_depth_mm, s.chord_frame,
                  s.chords_through_mesh, s.guarded_frames, s.guarded_events})
                row.push_back(readable(number));
            rows.push_back(row);
        }
    if (rows.empty()) return {};
    return "<h2>Surfaces</h2>\n" +
           paragraph(
               "Level: the value of the volume, in its own unit, where the surface is. "
               "Smoothing moves a "
               "surface a little: mean and standard deviation say by how much. The deepest "
               "chord is the "
               "movement whose value rose most above the level; it must not exceed what is "
               "allowed. Where the mesh alone is felt, no movement may pass through it. Where "
               "it guards a volume, it held the proxy back in so many frames, of so many "
               "events: the scan is ambiguous there.") +
           html_table("Surfaces", columns, rows);
}

std::string felt_table(const std::vector<Entry>& entries) {
    std::vector<Cells> rows;
    for (const auto& [trace, summary] : entries)
        for (const internal::FeltSummary& felt : summary.felt)
            rows.push_back({trace->title, felt.name, readable(felt.frames),
                            readable(felt.contact_s), readable(felt.force_mean_n),
                            readable(felt.force_max_n), readable(felt.path_mm)});
    if (rows.empty()) return {};
    return "<h2>What was felt</h2>\n" +
           paragraph("Each surface while it pushed back at a frame's end: for how long, with which "
                     "force, and how far the proxy went on it. Where several are felt at once, "
                     "each has the force of all of them.") +
           html_table("What was felt",
                      {{"", "Trace", false},
                       {"", "Surface", false},
                       {"In contact", "frames"},
                       {"In contact", "s"},
                       {"Force, N", "mean"},
                       {"Force, N", "max"},
                       {"", "Path, mm"}},
                      rows);
}

std::string pressed_table(const std::vector<Entry>& entries) {
    std::vector<Cells> rows;
    for (const auto& [trace, summary] : entries)
        for (const internal::PressedSummary& pressed : summary.pressed)
            rows.push_back({trace->title, pressed.name, readable(pressed.indentation_mm.frames),
                            readable(pressed.indentation_mm.p50),
                            readable(pressed.indentation_mm.max),
                            readable(pressed.stiffness_n_per_mm.p50),
                            readable(pressed.stiffness_n_per_mm.max)});
    if (rows.empty()) return {};
    return "<h2>What gave way</h2>\n" +
           paragraph("Each soft surface, in the frames in which it was the one that was pressed in "
                     "farthest: how far, and the stiffness that the hand felt.") +
           html_table("What gave way",
                      {{"", "Trace", false},
                       {"", "Surface", false},
                       {"", "Frames"},
                       {"Indentation, mm", "median"},
                       {"Indentation, mm", "max"},
                       {"Stiffness, N/mm", "median"},
                       {"Stiffness, N/mm", "max"}},
                      rows);
}

std::string paths_table(const std::vector<Entry>& entries) {
    std::vector<Cells> rows;
    for (const auto& [trace, s] : entries) {
        if (s.path.type.empty()) continue;
        Cells row{trace->title, s.path.type};
        for (const Number& number :
             {s.depth_mm.p50, s.depth_mm.p99, s.depth_mm.max, s.path.deeper_frames})
            row.push_back(readable(number));
        std::string covered;
        for (const internal::CoverageSummary& one : s.path.coverage)
            covered += (covered.empty() ? "" : ", ") + one.surface + " " +
                       readable(one.felt_percent) + " % within " + readable(one.within_mm) + " mm";
        row.push_back(covered.empty() ? readable(Number{}) : covered);
        rows.push_back(row);
    }
    if (rows.empty()) return {};
    return "<h2>Where the probe was led</h2>\n" +
           paragraph("Depth: how far the probe was behind the proxy while in contact (of a soft "
                     "surface: behind its front), and in how "
                     "many frames farther than the path was asked to be. Covered: the share of a "
                     "surface's area that is near a place where it was felt.") +
           html_table("Where the probe was led",
                      {{"", "Trace", false},
                       {"", "Path", false},
                       {"Depth, mm", "median"},
                       {"Depth, mm", "99 %"},
                       {"Depth, mm", "max"},
                       {"", "Deeper, frames"},
                       {"", "Covered", false}},
                      rows);
}

std::string truth_table(const std::vector<Entry>& entries) {
    std::vector<Cells> rows;
    for (const auto& [trace, summary] : entries) {
        const std::array<std::pair<const char*, const internal::SpreadSummary*>, 2> errors{
            {{"level", &summary.truth_level_um}, {"position", &summary.truth_position_um}}};
        for (const auto& [what, spread] : errors)
            if (spread->mean || spread->max)
                rows.push_back({trace->title, what, readable(spread->mean), readable(spread->rms),
                                readable(spread->p99), readable(spread->max)});
    }
    if (rows.empty()) return {};
    return "<h2>Error against the exact solution</h2>\n" +
           paragraph("Where a surface is a formula, the exact answer is known: the proxy's "
                     "distance from the "
                     "surface (level) and from where it should be (position).") +
           html_table("Error against the exact solution",
                      {{"", "Trace", false},
                       {"", "Of", false},
                       {"Error, \u00b5m", "mean"},
                       {"Error, \u00b5m", "rms"},
                       {"Error, \u00b5m", "99 %"},
                       {"Error, \u00b5m", "max"}},
                      rows);
}

std::string flags_table(const std::vector<Entry>& entries) {
    std::vector<Cells> rows;
    for (const auto& [trace, summary] : entries)
        for (const internal::FlagSummary& flag : summary.flags) {
            const bool known = flag.frames && summary.frames && *summary.frames > 0.0;
            const Number percent =
                known ? Number(100.0 * *flag.frames / *summary.frames) : std::nullopt;
            rows.push_back(
                {flag.name, trace->title, readable(flag.frames), readable(percent), flag.meaning});
        }
    // The same flags of several traces stand together.
    std::stable_sort(rows.begin(), rows.end(),
                     [](const Cells& a, const Cells& b) { return a[0] < b[0]; });
    const std::string title = "<h2>Flags</h2>\n";
    if (rows.empty()) return title + paragraph("No frame reported anything out of the ordinary.");
    return title + paragraph("What frames reported besides their numbers.") +
           html_table("Flags",
                      {{"", "Flag", false},
                       {"", "Trace", false},
                       {"", "Frames"},
                       {"", "% of all"},
                       {"", "Meaning", false}},
                      rows);
}

std::string effects_table(const std::vector<Entry>& entries) {
    std::vector<Cells> rows;
    for (const auto& [trace, summary] : entries)
        for (const internal::EffectSummary& effect : summary.effects)
            rows.push_back({trace->title, effect.type, effect.of, readable(effect.cost_us)});
    if (rows.empty()) return {};
    return "<h2>Effects</h2>\n" +
           paragraph(
               "What the scene makes felt and what one evaluation of it costs on this machine.") +
           html_table("Effects",
                      {{"", "Trace", false},
                       {"", "Type", false},
                       {"", "Of", false},
                       {"", "Cost, \u00b5s"}},
                      rows);
}

/// One line for each machine that the traces ran on.
std::string machine_lines(const std::vector<Entry>& entries) {
    std::set<std::string> lines;
    for (const auto& [trace, s] : entries) {
        const auto known = [](const std::string& text) { return text.empty() ? "\u2013" : text; };
        lines.insert(fmt::format("Computed by Palpate {} on {}, {} cores, {}.", known(s.version),
                                 known(s.cpu), readable(s.cores), known(s.system)));
    }
    std::string html;
    for (const std::string& line : lines)
        html += paragraph(line);
    return html;
}

std::string legend(std::span<const FrameReport> frames) {
    const double scale_n = internal::force_scale_n(frames);
    constexpr int kSteps = 40;
    std::string bars;
    for (int i = 0; i < kSteps; ++i) {
        const internal::Color color = internal::force_color((i + 0.5) / kSteps);
        // One pixel wider than its step, so that no seams show.
        bars += fmt::format(
            "<rect x=\"{}\" y=\"4\" width=\"7\" height=\"14\" fill=\"rgb({:.0f},{:.0f},{:.0f})\"/>",
            10 + 6 * i, 255.0 * color[0], 255.0 * color[1], 255.0 * color[2]);
    }
    const bool clipped = internal::largest_of(internal::kForce, frames) > scale_n * (1.0 + 1e-9);
    return fmt::format(
        "<svg class=\"legend\" viewBox=\"0 0 420 40\" role=\"img\" aria-label=\"Colours of the "
        "path: dark blue is "
        "0 N, purple and red are between, orange is {0} N{1}; thin grey is free motion\">{2}"
        "<text x=\"10\" y=\"34\" text-anchor=\"middle\">0</text>"
        "<text x=\"130\" y=\"34\" text-anchor=\"middle\">{3}</text>"
        "<text x=\"250\" y=\"34\" text-anchor=\"middle\">{4}{0} N</text>"
        "<path class=\"free\" d=\"M300 11h30\"/><text x=\"338\" y=\"15\">no contact</text></svg>\n",
        readable(scale_n), clipped ? " or more" : "", bars, readable(0.5 * scale_n),
        clipped ? "\u2265 " : "");
}

struct NamedView {
    Vec3 towards;
    const char* name;
};

std::string picture(const SurfaceScene& scene, const ReportSubject& subject,
                    const NamedView& from) {
    const ReportTrace& trace = subject.traces.front();
    PictureView view;
    view.towards = from.towards;
    const auto contacts =
        std::count_if(trace.frames.begin(), trace.frames.end(),
                      [](const FrameReport& frame) { return frame.contacts > 0; });
    const std::string alt =
        fmt::format("{}, {}, with the proxy\u2019s path of {} on it: {} of {} frames in contact, "
                    "forces up to {} N",
                    subject.title, from.name, trace.title, contacts, trace.frames.size(),
                    readable(internal::largest_of(internal::kForce, trace.frames)));
    return fmt::format(
        "<figure><img width=\"{}\" height=\"{}\" alt=\"{}\" src=\"data:image/png;base64,{}\">"
        "<figcaption>{}</figcaption></figure>\n",
        view.width, view.height, escape_html(alt), base64(render_png(scene, trace.frames, view)),
        escape_html(from.name));
}

std::string pictures(const ReportSubject& subject) {
    if (subject.mesh == nullptr || subject.mesh->triangles.empty() || subject.traces.empty())
        return paragraph("No picture: there is no mesh of this surface.");
    const SurfaceScene scene(subject.mesh);
    std::string html = "<div class=\"pictures\">\n";
    html +=
        picture(scene, subject, {Vec3(0.0, 1.0, 0.0), "seen along +y (a patient from the front)"});
    html +=
        picture(scene, subject, {Vec3(1.0, 0.0, 0.0), "seen along +x (a patient from the right)"});
    html += "</div>\n";
    const std::string which =
        subject.traces.size() > 1 ? " The path is that of the first trace." : "";
    return html + legend(subject.traces.front().frames) +
           paragraph("Colours show the force along the proxy\u2019s path, in newtons; parts behind "
                     "the surface "
                     "are hidden." +
                     which);
}

std::string playbacks(const ReportSubject& subject) {
    std::string html;
    for (const ReportTrace& trace : subject.traces)
        if (!trace.playback.empty())
            html +=
                fmt::format("<p><a href=\"{}\">Play {} again</a>: frame by frame, from every side, "
                            "in a browser with WebGL 2.</p>\n",
                            percent_encoded(trace.playback), escape_html(trace.title));
    return html;
}

/// The same quantity of all traces of a subject, on one scale.
std::string charts_of(const internal::FrameQuantity& quantity, const ReportSubject& subject,
                      const std::string& id) {
    double largest = 0.0;
    for (const ReportTrace& trace : subject.traces)
        largest = std::max(largest, internal::largest_of(quantity, trace.frames));
    const double top = internal::round_up(largest);
    std::string html;
    for (std::size_t i = 0; i < subject.traces.size(); ++i) {
        const ReportTrace& trace = subject.traces[i];
        const std::string chart = internal::chart_over_time(
            quantity, trace.frames, top, trace.title, fmt::format("{}{}", id, i));
        if (chart.empty()) continue;
        html += fmt::format("<h3>{} over time: {}</h3>\n{}", quantity.name,
                            escape_html(trace.title), chart);
    }
    return html;
}

std::string charts(const ReportSubject& subject, const std::string& id) {
    const std::string html = charts_of(internal::kForce, subject, id + "-chart");
    if (html.empty()) return {};
    std::string all =
        html + paragraph("Magnitude of the force in newtons over seconds, on one scale for all "
                         "charts of a surface; a column of the chart spans the smallest to the "
                         "largest force in it.");
    if (std::any_of(subject.traces.begin(), subject.traces.end(),
                    [](const ReportTrace& trace) { return presses_a_soft_surface(trace.frames); }))
        all += charts_of(internal::kIndentation, subject, id + "-indentation") +
               charts_of(internal::kStiffness, subject, id + "-stiffness") +
               paragraph("How far a soft surface is pressed in, in mm, and the stiffness that the "
                         "hand feels of it there, in N/mm; 0 where none is.");
    return all;
}

std::string subject_section(const ReportSubject& subject, std::size_t number) {
    return fmt::format("<section>\n<h2>{}</h2>\n", escape_html(subject.title)) + pictures(subject) +
           playbacks(subject) + charts(subject, fmt::format("subject{}", number)) + "</section>\n";
}

} // namespace

void write_report_page(const std::filesystem::path& file,
                       const std::vector<ReportSubject>& subjects,
                       const std::vector<std::string>& notes) {
    const std::vector<Entry> entries = entries_of(subjects);
    std::string page = internal::page_head("Palpate report");
    page += "<h1>Palpate report</h1>\n";
    for (const std::string& note : notes)
        page += paragraph(note);
    page += main_table(entries);
    for (std::size_t i = 0; i < subjects.size(); ++i)
        page += subject_section(subjects[i], i);
    page += felt_table(entries) + pressed_table(entries) + paths_table(entries) +
            surfaces_table(entries) + truth_table(entries) + flags_table(entries) +
            effects_table(entries);
    page += "<footer>\n" + machine_lines(entries) + "</footer>\n</main>\n</body>\n</html>\n";
    write_whole_file(file, page);
}

} // namespace palpate
