// SPDX-License-Identifier: Apache-2.0
// Random scenes whose surfaces are labels of a real atlas, every invariant in every frame
// (tests/stability/random). The long run:
//   palpate_stability --seed 0-1000000 --frames 1000000 --atlas aal.nii.gz
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include <palpate/volume/formats/label_file.h>

#include "tests/stability/random/long_run.h"
#include "tests/stability/random/path_maker.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

TEST(RandomAnatomy, EveryInvariantHoldsWhereLabelsOfAnAtlasMeet) {
    const char* const data = std::getenv("PALPATE_REAL_DATA");
    const std::filesystem::path file =
        data == nullptr ? "" : std::filesystem::path(data) / "aal.nii.gz";
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "PALPATE_REAL_DATA names no folder with aal.nii.gz (mricron-data)";
    const LabelVolume atlas = read_label_volume(file);
    const test::TemporaryFolder folder;
    constexpr long kFrames = 4000;
    long frames = 0, touched = 0, chords = 0;
    for (std::uint64_t seed = 0; frames < kFrames; ++seed) {
        const stability::Outcome outcome = stability::try_case(
            stability::make_case(seed, 200, &atlas), folder / "case", folder / "small");
        frames += outcome.frames;
        touched += outcome.touched;
        const auto found = outcome.checks.find("certificate");
        chords += found == outcome.checks.end() ? 0 : found->second;
        if (outcome.failure)
            FAIL() << "seed " << seed << ", " << outcome.failure->invariant << " in frame "
                          << outcome.failure->frame << ": " << outcome.failure->words << "\n"
                          << test::content_of(folder / "small" / "scene.toml");
    }
    EXPECT_GT(touched, kFrames / 4) << "it is about contact";
    EXPECT_GT(chords, kFrames / 4) << "of hard surfaces";
}

} // namespace
} // namespace palpate
