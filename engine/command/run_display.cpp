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
    return shown == Shown::events || shows_line(shown) ? LabelProbe(scene.description())
                                                       : LabelProbe(std::vector<LabelVolume>{});
}

} // namespace

RunDisplay::RunDisplay(const Scene& scene, Shown shown)
    : shown_(shown), labels_(labels_of(scene, shown)) {
    if (shown == Shown::events) events_.emplace(scene, labels_);
    if (shows_line(shown)) line_.emplace(scene, labels_);
}

RunDisplay::~RunDisplay() {
    if (events_) show(events_->end());
    if (is_drawn_) tell("\r{:{}}\r", "", columns());
}

RunWatch RunDisplay::watch() {
    RunWatch watch;
    watch.warning = [](const std::string& warning) { tell("palpate: warning: {}\n", warning); };
    if (shown_ == Shown::bar) {
        watch.progress = progress_bar();
        return watch;
    }
    watch.frame = [this](const RunFrame& run) { add(run); };
    watch.progress = [this](double, std::string_view) {
        if (line_) draw();
        return !stop_wanted();
    };
    return watch;
}

void RunDisplay::add(const RunFrame& run) {
    // The time before the first frame is not the loop's.
    if (!std::exchange(has_begun_, true)) drawn_at_ = std::chrono::steady_clock::now();
    if (line_) line_->add(run);
    if (events_) show(events_->add(run));
}

void RunDisplay::show(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
        if (!is_read_ || try_print(line)) continue;
        is_read_ = false;
        tell("palpate: warning: events cannot be written to stdout any more; the run goes on\n");
    }
}

void RunDisplay::draw() {
    const auto now = std::chrono::steady_clock::now();
    if (!has_begun_ || now - drawn_at_ < kBetweenLines) return;
    const double seconds = std::chrono::duration<double>(now - drawn_at_).count();
    drawn_at_ = now;
    is_drawn_ = true;
    const std::size_t width = columns();
    tell("\r{:<{}}", line_->text(seconds, width), width);
    std::fflush(stderr);
}

} // namespace palpate::command
