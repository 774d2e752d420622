// SPDX-License-Identifier: Apache-2.0
// Scenes that once did not come to rest, as they were found: each moved for ever while the probe
// was held.
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/stability/random/path_maker.h"
#include "tests/stability/random/run_case.h"

#include "tests/support/temporary_folder.h"

namespace palpate::stability {
namespace {

using Tables = std::vector<SceneTable>;

void hold(RandomCase& of, const Vec3& probe) {
    of.steps.resize(of.steps.size() + kHeldFrames, {probe, of.steps.empty()});
}

Outcome outcome_of(const RandomCase& made) {
    const test::TemporaryFolder folder;
    write_case(made, folder / "case");
    return run_case(folder / "case");
}

/// Fibres in circles about z, (-y, x, 3 mm), on a grid of 1 mm.
std::shared_ptr<const VectorVolume> circles() {
    constexpr int kVoxels = 40;
    constexpr double kFirst_mm = -19.5;
    auto volume = std::make_shared<VectorVolume>();
    volume->size = {kVoxels, kVoxels, kVoxels};
    volume->index_to_scene = {Mat3(1e-3), Vec3(1e-3 * kFirst_mm)};
    for (int k = 0; k < kVoxels; ++k)
        for (int j = 0; j < kVoxels; ++j)
            for (int i = 0; i < kVoxels; ++i)
                for (const double component : {-(j + kFirst_mm), i + kFirst_mm, 3.0})
                    volume->values.push_back(static_cast<float>(0.1 * component));
    return volume;
}

// Effects that look where the frame will end, and a workspace that looks at the pull: they chased
// each other. The proxy jumped 0.98 mm and the force 0.22 N in every frame.
TEST(Reproduction, FibresAGuideAndAWorkspaceUnderAConstantForceComeToRest) {
    RandomCase made;
    made.vectors["vec.nrrd"] = circles();
    made.tables = Tables{
        {"[volume.vec]", {{"file", "\"vec.nrrd\""}}, 1},
        {"[[effect]]",
         {{"type", "\"fibre_follow\""}, {"volume", "\"vec\""}, {"strength_n", "0.540970294"}},
         2},
        {"[[effect]]",
         {{"type", "\"constant_force\""}, {"force_n", "[-0.7280353, 16.074708, -0.599014955]"}},
         3},
        {"[[effect]]",
         {{"type", "\"guide\""},
          {"strength_n", "4.39523438"},
          {"points_mm",
           "[[-9.49066133, 9.61625681, -1.31234047], [-13.2382662, -14.0528456, 6.7212848]]"}},
         4},
        {"[[effect]]",
         {{"type", "\"workspace\""},
          {"radius_mm", "3.89996066"},
          {"center_mm", "[-3.32492819, 0, 1]"},
          {"strength_n", "5.34260498"}},
         5}};
    hold(made, {8e-3, 4e-3, -3e-3});
    const Tables as_found = made.tables;
    for (const bool with_room : {false, true}) { // for more evaluations, and longer forces
        made.tables = as_found;
        if (with_room) {
            made.tables.push_back({"[loop]", {{"evaluation_cap", "41"}}, 6});
            made.tables.push_back({"[limits]", {{"force_n", "21"}, {"slew_n_per_s", "15000"}}, 7});
        }
        const Outcome outcome = outcome_of(made);
        EXPECT_EQ(outcome.refused, "");
        EXPECT_FALSE(outcome.failure) << outcome.failure->words;
        EXPECT_FALSE(outcome.restless) << "to the bit";
    }
}

// A hard ring in a stream that is followed: where the probe was held beside it, the proxy crept by
// 1e-11 to 1e-9 m a frame.
TEST(Reproduction, AHardRingInAStreamThatIsFollowedHoldsStill) {
    RandomCase made;
    made.tables = Tables{
        {"[volume.helix]", {{"analytic", "\"helix\""}, {"radius_mm", "9"}, {"pitch_mm", "20"}}, 1},
        {"[volume.ring]",
         {{"analytic", "\"torus\""}, {"radius_mm", "11"}, {"tube_mm", "3.08843412"}},
         2},
        {"[surface.ring]", {{"volume", "\"ring\""}}, 3},
        {"[[effect]]", {{"type", "\"surface\""}, {"surface", "\"ring\""}}, 4},
        {"[[effect]]",
         {{"type", "\"vector_follow\""}, {"volume", "\"helix\""}, {"strength_n", "3.88880163"}},
         5},
        {"[loop]", {{"rate_hz", "4000"}}, 6}};
    const Vec3 begin{-10.2e-3, 8.6e-3, 2.6e-3}, inside{-4e-3, 3.5e-3, 2e-3};
    const Vec3 end{-6.2635503319348213e-3, 7.688344756755108e-3, 6.0700387332099596e-3};
    constexpr int kWay = 400; // frames
    for (const auto& [from, to] : {std::pair{begin, inside}, {inside, end}})
        for (int i = 0; i < kWay; ++i)
            made.steps.push_back(
                {from + (i / static_cast<double>(kWay)) * (to - from), made.steps.empty()});
    hold(made, end);
    const Outcome outcome = outcome_of(made);
    EXPECT_EQ(outcome.refused, "");
    EXPECT_FALSE(outcome.failure) << outcome.failure->words;
    EXPECT_FALSE(outcome.restless) << "to the bit";
    EXPECT_GT(outcome.touched, 50) << "also while it is held";
}

} // namespace
} // namespace palpate::stability
