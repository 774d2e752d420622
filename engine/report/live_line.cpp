// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/live_line.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/report/run_events.h>
#include <palpate/engine/text/plain_text.h>

namespace palpate {
namespace {

std::string bar(double share, std::size_t width) {
    const auto full = static_cast<std::size_t>(
        std::lround(std::clamp(share, 0.0, 1.0) * static_cast<double>(width)));
    return std::string(full, '#') + std::string(width - full, '.');
}

/// At most so many bytes, and not an end in the middle of a letter.
std::string cut(std::string line, std::size_t columns) {
    if (line.size() > columns) {
        std::size_t end = columns;
        while (end > 0 && (static_cast<unsigned char>(line[end]) & 0xC0) == 0x80)
            --end;
        line.resize(end);
    }
    return line;
}

} // namespace

LiveLine::LiveLine(const Scene& scene, const LabelProbe& labels)
    : scene_(scene), probe_label_(labels), felt_names_(felt_names(scene)) {}

void LiveLine::add(const RunFrame& run) {
    last_ = run;
    ++frames_;
    sub_steps_ += run.frame.sub_steps;
    overruns_ += run.overrun != Overrun::none ? 1 : 0;
    strongest_n_ = std::max(strongest_n_, glm::length(run.frame.force));
    felt_ |= run.frame.surfaces_felt;
    probe_label_.add(run.frame.time_s, run.frame.probe);
}

double LiveLine::rate_hz(double seconds) const {
    return seconds > 0.0 ? static_cast<double>(frames_) / seconds : 0.0;
}

double LiveLine::depth_mm() const {
    return last_.frame.contacts > 0
               ? 1e3 * glm::distance(last_.frame.probe, place_on_surface(last_.frame))
               : 0.0;
}

std::string LiveLine::felt() const { return plain_text(felt_in_words(felt_, felt_names_)); }

void LiveLine::begin_anew() {
    frames_ = sub_steps_ = felt_ = 0;
    strongest_n_ = 0.0;
}

std::string LiveLine::text(double seconds, std::size_t columns) {
    constexpr std::size_t kBar = 20; // letters
    const double sub_steps =
        frames_ > 0 ? static_cast<double>(sub_steps_) / static_cast<double>(frames_) : 0.0;
    std::string line = fmt::format(
        "{:8.1f} s {:5.0f} Hz {:4} overruns {:4.1f} sub-steps [{}] {:4.1f} N {:5.2f} mm",
        last_.frame.time_s, rate_hz(seconds), overruns_, sub_steps,
        bar(strongest_n_ / scene_.description().limits.force_n, kBar), strongest_n_, depth_mm());
    if (last_.silence != Silence::none) line += " SILENT";
    if (const std::string what = felt(); !what.empty()) line += " feels " + what;
    if (const auto name = probe_label_.name(); !name.empty())
        line += " probe in " + plain_text(name);
    begin_anew();
    return cut(std::move(line), columns);
}

std::string LiveLine::brief(double seconds, std::size_t columns) {
    // What matters most comes first: of four hands each has 19 of 80 columns.
    std::string line = last_.silence != Silence::none ? "SILENT " : "";
    line += fmt::format("{:3.1f} N {:4.2f} mm", strongest_n_, depth_mm());
    if (const std::string what = felt(); !what.empty()) line += " " + what;
    line += fmt::format(" {:.0f} Hz {} late", rate_hz(seconds), overruns_);
    begin_anew();
    return cut(std::move(line), columns);
}

} // namespace palpate
