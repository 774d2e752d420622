// SPDX-License-Identifier: Apache-2.0
// Random scenes without end, for who has changed a contact, the solver or an effect, and for
// docs/stability.md. Not installed.
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include <palpate/volume/formats/label_file.h>

#include "tests/stability/random/long_run.h"
#include "tests/stability/random/wedge_table.h"

namespace {

constexpr const char* kUsage =
    R"(palpate_stability --seed FROM-TO [--frames N] [--path N] [--watchdog S] [--out FOLDER] [--each]
                  [--soft] [--atlas FILE] [--first]
    random scenes of these seeds, until N frames have been felt (20000); each path has --path
    frames (400); a set-up or frames that take S seconds (60) hang; failures are made small and
    written to FOLDER (stability-failures); --each: a line for each seed;
    --soft: only scenes in which a soft surface is felt;
    --atlas: every surface is of labels that meet somewhere in this label volume;
    --first: ends with the first failure, which is not made small
palpate_stability --replay FOLDER
    one case that was written there, with its events and all invariants
palpate_stability --wedges [--each]
    the table of wedges and grooves; --each: with a row for each angle
)";

int replay(const std::string& folder) {
    const palpate::stability::Outcome outcome = palpate::stability::run_case(folder);
    if (!outcome.refused.empty()) std::cout << "refused: " << outcome.refused << "\n";
    std::cout << fmt::format("{} frames, {} in contact\n", outcome.frames, outcome.touched);
    if (!outcome.failure) return 0;
    std::cout << fmt::format("{} in frame {}: {}\n", outcome.failure->invariant,
                             outcome.failure->frame, outcome.failure->words);
    return 1;
}

int run(int argc, char** argv) {
    palpate::stability::LongRun run;
    bool chosen = false;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        const auto value = [&]() -> std::string {
            if (i + 1 >= argc) throw std::invalid_argument(option + " needs a value");
            return argv[++i];
        };
        if (option == "--replay") return replay(value());
        if (option == "--wedges") {
            const bool each = i + 1 < argc && std::string(argv[i + 1]) == "--each";
            (each ? palpate::stability::write_wedges_by_angle
                  : palpate::stability::write_wedge_table)(std::cout);
            return 0;
        }
        if (option == "--seed") {
            const std::string seeds = value();
            const std::size_t dash = seeds.find('-');
            run.from = std::stoull(seeds);
            run.to = dash == std::string::npos ? run.from : std::stoull(seeds.substr(dash + 1));
            chosen = true;
        } else if (option == "--frames") {
            run.frames = std::stol(value());
        } else if (option == "--path") {
            run.path_frames = std::stoi(value());
        } else if (option == "--watchdog") {
            run.watchdog_s = std::stod(value());
        } else if (option == "--out") {
            run.out = value();
        } else if (option == "--each") {
            run.each_seed = true;
        } else if (option == "--soft") {
            run.soft = true;
        } else if (option == "--first") {
            run.only_first = true;
        } else if (option == "--atlas") {
            run.atlas =
                std::make_shared<const palpate::LabelVolume>(palpate::read_label_volume(value()));
        } else {
            throw std::invalid_argument("no such option: " + option);
        }
    }
    if (!chosen) throw std::invalid_argument("which seeds? --seed FROM-TO");
    return palpate::stability::run_long(run, std::cout) == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::cerr << "palpate_stability: " << error.what() << "\n" << kUsage;
        return 2;
    }
}
