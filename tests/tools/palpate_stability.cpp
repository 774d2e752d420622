// SPDX-License-Identifier: Apache-2.0
// Random scenes without end, for who has changed a contact, the solver or an effect, and for
// docs/stability.md. Not installed.
#include <charconv>
#include <cstdint>
#include <exception>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <palpate/volume/formats/label_file.h>

#include "tests/stability/random/long_run.h"
#include "tests/stability/random/wedge_table.h"

namespace {

using palpate::stability::LongRun;

constexpr int kFailed = 1, kWrongInput = 2;

/// The part of a text that is a number, all of it; else CLI11's error.
std::uint64_t seed_of(std::string_view text, const std::string& all) {
    std::uint64_t seed = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), seed);
    if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size())
        throw CLI::ValidationError("--seed", "\"" + all + "\" is no FROM-TO, as 0-1000");
    return seed;
}

void take_seeds(const std::string& text, LongRun& run) {
    const std::size_t dash = text.find('-');
    run.from = seed_of(std::string_view(text).substr(0, dash), text);
    run.to = dash == std::string::npos ? run.from
                                       : seed_of(std::string_view(text).substr(dash + 1), text);
    if (run.to < run.from)
        throw CLI::ValidationError("--seed", "\"" + text + "\" goes backwards; give FROM-TO");
}

int replay(const std::string& folder) {
    const palpate::stability::Outcome outcome = palpate::stability::run_case(folder);
    if (!outcome.refused.empty()) {
        std::cerr << "palpate_stability: " << folder << ": " << outcome.refused << "\n";
        return kWrongInput;
    }
    std::cout << fmt::format("{} frames, {} in contact\n", outcome.frames, outcome.touched);
    if (!outcome.failure) return 0;
    std::cout << fmt::format("{} in frame {}: {}\n", outcome.failure->invariant,
                             outcome.failure->frame, outcome.failure->words);
    return kFailed;
}

int run(int argc, char** argv) {
    CLI::App app{"Random scenes with the path of a probe, and what must hold in every frame of "
                 "them (docs/stability.md). Ends with 1 where something does not, with 2 on wrong "
                 "input."};
    LongRun run;
    std::string seeds, replayed, atlas;
    bool wedges = false, each = false;
    const auto seed = app.add_option("--seed", seeds,
                                     "FROM-TO or one number: random scenes of these seeds, until "
                                     "--frames have been computed");
    app.add_option("--replay", replayed,
                   "a folder: one case that was written there, with its events and all invariants")
        ->check(CLI::ExistingDirectory)
        ->excludes(seed);
    app.add_flag("--wedges", wedges, "the table of wedges and grooves")->excludes(seed);
    app.add_flag("--each", each, "a line for each seed, or a row for each angle of --wedges");
    app.add_option("--frames", run.frames, "of all scenes")
        ->check(CLI::Range(1L, 1'000'000'000'000L))
        ->needs(seed)
        ->capture_default_str();
    app.add_option("--path", run.path_frames, "frames of each path")
        ->check(CLI::Range(2, 1'000'000))
        ->needs(seed)
        ->capture_default_str();
    app.add_option("--watchdog", run.watchdog_s,
                   "s of processor time: a set-up or frames that take more hang; of the clock, ten "
                   "times as long")
        ->check(CLI::Range(1.0, 1e6))
        ->needs(seed)
        ->capture_default_str();
    app.add_option("--out", run.out, "a folder for what fails, made small")
        ->needs(seed)
        ->capture_default_str();
    app.add_flag("--soft", run.soft, "only scenes in which a soft surface is felt")->needs(seed);
    app.add_option("--atlas", atlas,
                   "a label volume: every surface is of labels that meet somewhere in it")
        ->check(CLI::ExistingFile)
        ->needs(seed);
    app.add_flag("--first", run.only_first, "ends with the first failure, which is not made small")
        ->needs(seed);
    try {
        app.parse(argc, argv);
        if (seeds.empty() && replayed.empty() && !wedges)
            throw CLI::RequiredError("one of --seed, --replay, --wedges");
        if (!seeds.empty()) take_seeds(seeds, run);
        if (wedges && !replayed.empty()) throw CLI::ExcludesError("--wedges", "--replay");
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : kWrongInput;
    }
    if (!replayed.empty()) return replay(replayed);
    run.each_seed = each;
    if (wedges) {
        (each ? palpate::stability::write_wedges_by_angle
              : palpate::stability::write_wedge_table)(std::cout);
        return 0;
    }
    if (!atlas.empty())
        run.atlas = std::make_shared<const palpate::LabelVolume>(palpate::read_label_volume(atlas));
    return palpate::stability::run_long(run, std::cout) == 0 ? 0 : kFailed;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::cerr << "palpate_stability: " << error.what() << "\n";
        return kWrongInput;
    }
}
