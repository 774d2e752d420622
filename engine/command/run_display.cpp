// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/run_display.h>

#include <cstdio>
#include <utility>

#include <sys/ioctl.h>
#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>

namespace palpate::command {
namespace {

constexpr std::chrono::milliseconds kBetweenLines{100};

/// Columns of the terminal, without the last one, which would wrap.
std::size_t columns() {
    winsize size{};
    const bool is_known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
    return is_known ? size.ws_col - 1u : 79u;
}

bool shows_line(Shown shown) { return shown == Shown::line && isatty(STDERR_FILENO) != 0; }

LabelProbe labels_of(const Scene& scene, Shown shown) {
    return shown == Shown::events || shows_line(shown) ? LabelProbe(scene)
                                                       : LabelProbe(std::vector<LabelVolume>{});
}

} // namespace

RunDisplay::RunDisplay(const Scene& scene, Shown shown)
    : shown_(shown), labels_(labels_of(scene, shown)) {
    hands_.reserve(1);
    show_hand(scene, "");
}

RunDisplay::RunDisplay(const std::vector<std::shared_ptr<const Scene>>& hands, Shown shown)
    : shown_(shown), labels_(labels_of(*hands.front(), shown)) {
    hands_.reserve(hands.size()); // those who watch refer to them
    for (const auto& scene : hands)
        show_hand(*scene, hands.size() > 1 ? scene->description().device.name : "");
}

RunDisplay::~RunDisplay() {
    for (Hand& hand : hands_)
        if (hand.events) show(hand, hand.events->end());
    if (is_drawn_) tell("\r{:{}}\r", "", columns());
}

void RunDisplay::show_hand(const Scene& scene, std::string name) {
    Hand& hand = hands_.emplace_back();
    hand.name = std::move(name);
    if (shown_ == Shown::events) hand.events.emplace(scene, labels_);
    if (shows_line(shown_)) hand.line.emplace(scene, labels_);
}

RunWatch RunDisplay::watch(std::size_t of) {
    Hand& hand = hands_.at(of);
    RunWatch watch;
    watch.warning = [&hand](const std::string& warning) {
        tell("palpate: warning: {}{}\n", hand.name.empty() ? "" : "hand " + hand.name + ": ",
             warning);
    };
    if (shown_ == Shown::bar) {
        watch.progress = progress_bar();
        return watch;
    }
    watch.frame = [this, &hand](const RunFrame& run) { add(hand, run); };
    watch.progress = [this](double, std::string_view) {
        draw();
        return !stop_wanted();
    };
    return watch;
}

void RunDisplay::add(Hand& hand, const RunFrame& run) {
    // The time before the first frame is not the loop's.
    if (!std::exchange(has_begun_, true)) drawn_at_ = std::chrono::steady_clock::now();
    if (hand.line) hand.line->add(run);
    if (hand.events) show(hand, hand.events->add(run));
}

void RunDisplay::show(const Hand& hand, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
        if (!is_read_ || try_print(hand.name.empty() ? line : hand.name + ": " + line)) continue;
        is_read_ = false;
        tell("palpate: warning: events cannot be written to stdout any more; the run goes on\n");
    }
}

void RunDisplay::draw() {
    const auto now = std::chrono::steady_clock::now();
    if (!has_begun_ || !hands_.front().line || now - drawn_at_ < kBetweenLines) return;
    const double seconds = std::chrono::duration<double>(now - drawn_at_).count();
    drawn_at_ = now;
    is_drawn_ = true;
    const std::size_t width = columns();
    std::string line;
    if (hands_.size() == 1) {
        line = hands_.front().line->text(seconds, width);
    } else {
        const std::size_t share = width / hands_.size();
        for (Hand& hand : hands_) {
            const std::string name = hand.name.substr(0, share / 3);
            const std::size_t named = name.size() + 2; // and what is between two hands
            const std::string brief = hand.line->brief(seconds, share > named ? share - named : 0);
            const std::string part = fmt::format("{} {}", name, brief);
            line += fmt::format("{:<{}}", part, share);
        }
    }
    tell("\r{:<{}}", line, width);
    std::fflush(stderr);
}

} // namespace palpate::command
