// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>

#include <palpate/volume/label_volume.h>

#include "tests/stability/random/random_case.h"
#include "tests/stability/random/run_case.h"

namespace palpate::stability {

/// What a long run is of.
struct LongRun {
    std::uint64_t from = 0, to = 1000000; ///< seeds, the last one too
    long frames = 20000;                  ///< it ends with the case in which these are reached
    int path_frames = 400;                ///< of each path, without a hold at its end
    double watchdog_s = 60.0;             ///< processor time of a set-up, or of the frames
    std::filesystem::path out = "stability-failures"; ///< where failures are written
    bool each_seed = false;                           ///< a line for each seed
    bool soft = false;                                ///< only scenes in which a soft one is felt
    bool only_first = false; ///< ends with the first failure, which is not made small
    std::shared_ptr<const LabelVolume> atlas; ///< as make_case() takes it
};

/// Tries a case in a folder of its own; where it fails, makes it small and writes it to `keep`.
/// Returns what became of it; of a failure, what is left of it there.
Outcome try_case(const RandomCase& made, const std::filesystem::path& work,
                 const std::filesystem::path& keep, const RunOptions& options = {});

/// Runs seed after seed in a process of its own, which is ended where it hangs; writes each
/// failure, a progress and at the end a table. Returns how many seeds failed, hung or crashed.
/// Throws std::runtime_error where it cannot go on, and where run.out has cases already.
int run_long(const LongRun& run, std::ostream& out);

} // namespace palpate::stability
