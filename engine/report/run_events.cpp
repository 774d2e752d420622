// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/run_events.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/haptics/effects/effect.h>

#include <fmt/format.h>

namespace palpate {
namespace {

std::string words_of(Silence silence) {
    switch (silence) {
    case Silence::none:
        return "device speaks again";
    case Silence::device:
        return "device silent, force to zero";
    case Silence::loop:
        return "loop was late, force to zero";
    case Silence::ending:
        break;
    }
    return "run ends, force to zero";
}

constexpr int kButtons = 32; // bits of DeviceState::buttons

} // namespace

RunEvents::RunEvents(const Scene& scene, const LabelProbe& labels)
    : scene_(scene), has_labels_(!labels.empty()), probe_label_(labels) {}

/// What a matter is now. The first time, `unsaid` is what needs no words.
void RunEvents::set(const std::string& matter, std::string now, std::string_view unsaid) {
    const auto [entry, is_new] = matters_.try_emplace(matter);
    if (is_new) entry->second.said = unsaid;
    entry->second.now = std::move(now);
}

std::vector<std::string> RunEvents::add(const RunFrame& run) {
    const FrameReport& frame = run.frame;
    time_s_ = frame.time_s;
    ++frames_;
    missed_ += run.missed;

    const std::string first = fmt::format("trial {} begins", 0);
    set("trial", fmt::format("trial {} begins", frame.trial), first);
    for (std::size_t i = 0; i < scene_.surfaces().size() && i < kFeltBits; ++i) {
        const std::string name = plain_text(scene_.surfaces()[i].name);
        const bool is_felt = (frame.surfaces_felt & felt_bit(i)) != 0;
        set("surface " + name, (is_felt ? "contact " : "left ") + name, "left " + name);
    }
    if (has_labels_) {
        probe_label_.add(frame.time_s, frame.probe);
        const std::string name = plain_text(probe_label_.name());
        set("label", name.empty() ? "probe in no label" : "probe in " + name, "probe in no label");
    }
    set("limit", frame.flags & kForceClamped ? "force limit reached" : "force below its limit",
        "force below its limit");
    set("silence", words_of(run.silence), words_of(Silence::none));
    set("probe",
        frame.flags & kProbeNotFinite ? "device gives no position, force to zero"
                                      : "device gives its position",
        "device gives its position");
    for (int i = 0; i < kButtons; ++i) {
        const bool is_down = (run.input.buttons >> i & 1) != 0;
        const std::string button = fmt::format("button {}", i);
        if (is_down || matters_.contains(button))
            set(button, button + (is_down ? " down" : " up"), button + " up");
    }
    if (missed_ > 0) set("overruns", fmt::format("{} periods missed so far", missed_));

    std::vector<std::string> lines;
    for (auto& [name, matter] : matters_) {
        const bool is_quiet =
            matter.is_said && time_s_ >= matter.said_at_s && time_s_ - matter.said_at_s < kQuiet_s;
        if (matter.now == matter.said || is_quiet) continue;
        matter.said = matter.now;
        matter.said_at_s = time_s_;
        matter.is_said = true;
        lines.push_back(fmt::format("{:.3f} s {}", time_s_, matter.now));
    }
    return lines;
}

std::vector<std::string> RunEvents::end() {
    std::vector<std::string> lines;
    for (auto& [name, matter] : matters_)
        if (matter.now != matter.said)
            lines.push_back(fmt::format("{:.3f} s {}", time_s_, matter.now));
    lines.push_back(fmt::format("{:.3f} s end after {} frames", time_s_, frames_));
    return lines;
}

} // namespace palpate
