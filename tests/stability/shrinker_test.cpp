// SPDX-License-Identifier: Apache-2.0
// A random case that fails gets small, and fails still.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>

#include "tests/stability/random/long_run.h"
#include "tests/stability/random/path_maker.h"
#include "tests/stability/random/shrinker.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using stability::Outcome;
using stability::RandomCase;
using stability::RunOptions;
using stability::SceneTable;

bool has_effect(const RandomCase& of, const std::string& type) {
    return std::any_of(of.tables.begin(), of.tables.end(), [&](const SceneTable& table) {
        return table.value("type") == "\"" + type + "\"";
    });
}

TEST(Shrinker, LeavesWhatAFailureNeedsAndRoundsIt) {
    const auto fails = [](const RandomCase& of) {
        return has_effect(of, "viscosity") &&
               std::any_of(of.steps.begin(), of.steps.end(),
                           [](const auto& step) { return step.probe.x > 1.234e-3; });
    };
    int shrunk = 0;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        const RandomCase whole = stability::make_case(seed, 100);
        if (!fails(whole) || whole.size_m < 5e-3 || whole.size_m > 0.05) continue;
        const RandomCase small = stability::shrink(whole, fails, 3000);
        ASSERT_TRUE(fails(small));
        EXPECT_EQ(small.tables.size(), 1U) << stability::scene_text(small);
        EXPECT_EQ(small.tables.front().keys.size(), 1U) << stability::scene_text(small);
        EXPECT_EQ(small.steps.size(), 1U);
        EXPECT_TRUE(small.events.empty());
        EXPECT_TRUE(small.meshes.empty() && small.volumes.empty() && small.vectors.empty());
        const double mm = 1e3 * small.steps.front().probe.x;
        EXPECT_NEAR(mm, std::round(10.0 * mm) / 10.0, 1e-9) << "not round";
        ++shrunk;
    }
    EXPECT_GT(shrunk, 3);
}

// From a seed to a folder that fails in the same way, and is a scene as users write them.
TEST(Shrinker, WritesACaseThatFailsAgain) {
    const test::TemporaryFolder folder;
    RunOptions broken;
    broken.spoil_first = [](FrameReport& report, std::vector<Vec3>&) {
        if (report.surfaces_felt != 0 && report.probe.y > 1e-3)
            report.force.y = std::numeric_limits<double>::infinity();
    };
    std::uint64_t seed = 0;
    Outcome small;
    while (!small.failure)
        small = stability::try_case(stability::make_case(seed++, 60), folder / "case",
                                    folder / "small", broken);
    EXPECT_EQ(small.failure->invariant, "finite");
    EXPECT_LE(small.frames, 3);
    const SceneDescription scene = read_scene(folder / "small" / "scene.toml");
    EXPECT_EQ(scene.effects.size(), 1U) << "the surface that is felt";
    const Outcome again = stability::run_case(folder / "small", broken);
    ASSERT_TRUE(again.failure);
    EXPECT_EQ(again.failure->words, small.failure->words);
    EXPECT_FALSE(stability::run_case(folder / "small").failure) << "the loop itself is sound";
}

} // namespace
} // namespace palpate
