// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/report/live_line.h>
#include <palpate/engine/report/run_events.h>
#include <palpate/engine/run/run_watch.h>

namespace palpate::command {

/// What a user is shown of a run while it goes on.
enum class Shown {
    bar,   ///< how far it is: a bar on stderr, where that is a terminal
    line,  ///< one line there about what is felt, ten times a second
    events ///< events on stdout, a line each as it happens, and nothing else
};

/// Shows a run, or those of several hands, in the thread that started it.
class RunDisplay {
public:
    /// The scene must outlive it. Reads the scene's labels where something is shown.
    RunDisplay(const Scene& scene, Shown shown);
    /// Of hands over one scene, with their names where there are several; the scenes must outlive
    /// it.
    RunDisplay(const std::vector<std::shared_ptr<const Scene>>& hands, Shown shown);
    ~RunDisplay();
    RunDisplay(const RunDisplay&) = delete;
    RunDisplay& operator=(const RunDisplay&) = delete;

    /// Warnings, frames, and whether a signal has asked to stop; of a hand, counted from 0. This
    /// must outlive it.
    RunWatch watch(std::size_t of = 0);

private:
    /// What is shown of one hand.
    struct Hand {
        std::string name; ///< empty: there is one
        std::optional<RunEvents> events;
        std::optional<LiveLine> line;
    };
    void show_hand(const Scene& scene, std::string name);
    void add(Hand& hand, const RunFrame& run);
    void show(const Hand& hand, const std::vector<std::string>& lines);
    void draw();

    Shown shown_;
    LabelProbe labels_;
    std::vector<Hand> hands_;
    std::chrono::steady_clock::time_point drawn_at_{};
    bool has_begun_ = false;
    bool is_drawn_ = false;
    bool is_read_ = true; ///< stdout has taken all events so far
};

} // namespace palpate::command
