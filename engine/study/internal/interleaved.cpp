// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/interleaved.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/report/internal/spread.h>
#include <palpate/engine/study/internal/baseline_contestant.h>
#include <palpate/engine/study/internal/study_tally.h>
#include <palpate/engine/truth/frame_truth.h>

namespace palpate::internal {
namespace {

// Long enough that the first frames of a turn, whose data other entries have pushed out of the
// cache, do not reach its median; short enough that a slow second of the machine meets all.
constexpr std::size_t kFramesPerTurn = 250;

class LoopContestant final : public Contestant {
public:
    LoopContestant(const StudyEntry& entry, Clock& clock) : loop_(entry.scene, clock, entry.loop) {}
    FrameReport frame(const DeviceState& input) noexcept override { return loop_.frame(input); }
    std::span<const Vec3> path() const noexcept override { return loop_.path(); }

private:
    HapticLoop loop_;
};

FrameTruth truth_of(const StudyEntry& entry) {
    // Rows of one table are measured alike: the methods of others go over the level.
    const bool of_levels = entry.truth || the_felt_level(*entry.scene);
    return FrameTruth(entry.truth ? *entry.truth : *entry.scene,
                      of_levels ? FrameTruth::Measure::levels : FrameTruth::Measure::what_is_felt);
}

/// An entry on its way.
class Row {
public:
    explicit Row(const StudyEntry& entry)
        : entry_(entry), truth_(truth_of(entry)), of_frames_us_(entry.inputs.size()) {}

    void begin(Clock& clock) {
        contestant_ = make_contestant(entry_, clock);
        spent_us_.clear();
    }

    /// One turn of so many.
    void run(std::size_t turn, std::size_t turns, bool is_first) {
        const std::size_t from = entry_.inputs.size() * turn / turns;
        const std::size_t to = entry_.inputs.size() * (turn + 1) / turns;
        frames_.clear();
        for (std::size_t i = from; i < to; ++i) {
            frames_.push_back(contestant_->frame(entry_.inputs[i]));
            if (is_first) tally_.add_way(frames_.back(), contestant_->path());
        }
        for (std::size_t i = from; i < to; ++i) {
            const FrameReport& frame = frames_[i - from];
            const bool counts = entry_.timed.empty() ? frame.contacts > 0 : entry_.timed[i] != 0;
            if (!counts) continue;
            spent_us_.push_back(frame.spent_us);
            of_frames_us_[i].push_back(frame.spent_us);
        }
        if (!is_first) return;
        // The truth is asked after the turn: its samples would push out those of the next frame.
        for (std::size_t i = from; i < to; ++i)
            compare(frames_[i - from], i);
    }

    void end() { repetitions_.push_back(spread_of(spent_us_)); }

    double median_us() const { return repetitions_.back().p50; } // of the last repetition

    StudyRun conclude() && {
        StudyRun run = std::move(tally_).conclude(entry_.loop);
        run.baseline = entry_.baseline;
        run.is_the_scenes = false;
        run.repetitions = repetitions_.size();
        run.spent_mean_us = mean_without_interrupts();
        const auto over_all = [&](double Spread::*number) {
            std::vector<double> values;
            for (const Spread& repetition : repetitions_)
                values.push_back(repetition.*number);
            return values;
        };
        run.spent_p50_us = median_of(over_all(&Spread::p50));
        run.spent_p99_us = median_of(over_all(&Spread::p99));
        run.spent_max_us = spread_of(over_all(&Spread::max)).max;
        run.spent_p50_each_us = over_all(&Spread::p50);
        run.spent_p50_range_us = range_of(run.spent_p50_each_us);
        run.spent_p99_range_us = range_of(over_all(&Spread::p99));
        return run;
    }

private:
    /// A frame that was interrupted in one repetition was not in most others.
    double mean_without_interrupts() {
        std::vector<double> medians_us;
        for (std::vector<double>& times : of_frames_us_)
            if (!times.empty()) medians_us.push_back(median_of(std::move(times)));
        return trimmed_mean(std::move(medians_us));
    }
    void compare(const FrameReport& frame, std::size_t i) {
        tally_.add_frame(frame, entry_.loop);
        tally_.add_truth(truth_.of(frame));
        if (!entry_.certified.empty()) tally_.add_certified(frame, entry_.certified[i]);
        if (!entry_.converged) return;
        tally_.add_converged(frame, entry_.converged->proxies[i],
                             entry_.converged->in_contact[i] != 0);
    }

    const StudyEntry& entry_;
    FrameTruth truth_;
    StudyTally tally_;
    std::unique_ptr<Contestant> contestant_;
    std::vector<FrameReport> frames_; // of a turn
    std::vector<double> spent_us_;    // of a repetition
    std::vector<Spread> repetitions_;
    std::vector<std::vector<double>> of_frames_us_; // of each frame, its repetitions
};

} // namespace

StudyRun::Range range_of(std::vector<double> values) {
    if (values.size() < 2) return {};
    std::sort(values.begin(), values.end());
    const auto rank = [&](double share) {
        const double last = static_cast<double>(values.size() - 1);
        return values[static_cast<std::size_t>(std::lround(share * last))];
    };
    return {rank(0.1), rank(0.9)};
}

double median_of(std::vector<double> values) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

std::unique_ptr<Contestant> make_contestant(const StudyEntry& entry, Clock& clock) {
    if (entry.baseline) return make_baseline_contestant(entry, clock);
    return std::make_unique<LoopContestant>(entry, clock);
}

std::vector<StudyRun> run_interleaved(std::span<const StudyEntry> entries, int repetitions,
                                      Clock& clock, std::string_view doing,
                                      const Progress& progress, double most_repeated_us) {
    std::vector<Row> rows;
    std::size_t longest = 1;
    for (const StudyEntry& entry : entries) {
        rows.emplace_back(entry);
        longest = std::max(longest, entry.inputs.size());
    }
    const std::size_t turns = (longest + kFramesPerTurn - 1) / kFramesPerTurn;
    const double all = static_cast<double>(repetitions) * static_cast<double>(turns) *
                       static_cast<double>(rows.size());
    double done = 0.0;
    for (int repetition = 0; repetition < repetitions; ++repetition) {
        std::vector<Row*> on; // in this repetition
        for (Row& row : rows)
            if (repetition == 0 || row.median_us() <= most_repeated_us) on.push_back(&row);
        for (Row* row : on)
            row->begin(clock);
        for (std::size_t turn = 0; turn < turns; ++turn)
            for (Row* row : on) {
                if (progress && !progress(done++ / all, doing))
                    throw std::runtime_error("cancelled");
                row->run(turn, turns, repetition == 0);
            }
        for (Row* row : on)
            row->end();
    }
    std::vector<StudyRun> runs;
    runs.reserve(rows.size());
    for (Row& row : rows)
        runs.push_back(std::move(row).conclude());
    return runs;
}

} // namespace palpate::internal
