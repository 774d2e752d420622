// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/report/trace_summary.h>

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

const std::vector<std::string> kNames{"a", "b", "c"};

TEST(FeltSurfaces, AreNamedInTheOrderOfTheirBits) {
    EXPECT_EQ(felt_in_words(0, kNames), "");
    EXPECT_EQ(felt_in_words(0b110, kNames), "b+c");
    EXPECT_EQ(felt_in_words(~std::uint64_t{0}, kNames), "a+b+c") << "bits without a name";
}

TEST(FeltSurfaces, HaveTimeForceAndPathOfTheFramesInWhichTheyAreFelt) {
    std::vector<FrameReport> frames(6);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        frames[i].time_s = 2e-3 * static_cast<double>(i);
        frames[i].proxy = {1e-3 * static_cast<double>(i * i), 0.0, 0.0};
        frames[i].force = {0.0, static_cast<double>(i), 0.0};
    }
    frames[1].surfaces_felt = 0b01;
    frames[2].surfaces_felt = 0b11;
    frames[4].surfaces_felt = 0b01; // after a gap
    frames[5].surfaces_felt = 0b01; // in another trial
    frames[5].trial = 1;
    frames[5].time_s = frames[4].time_s; // a time that stands still
    const std::vector<FeltSurface> felt = felt_surfaces(kNames, frames, 1e-3);
    ASSERT_EQ(felt.size(), 3u);
    EXPECT_EQ(felt[0].name, "a");
    EXPECT_EQ(felt[0].frames, 4u);
    EXPECT_DOUBLE_EQ(felt[0].contact_s, 3 * 2e-3 + 1e-3);
    EXPECT_DOUBLE_EQ(felt[0].force_mean_n, 0.25 * (1 + 2 + 4 + 5));
    EXPECT_DOUBLE_EQ(felt[0].force_max_n, 5.0);
    EXPECT_DOUBLE_EQ(felt[0].path_m, 3e-3) << "from the second frame to the third alone";
    EXPECT_EQ(felt[1].frames, 1u);
    EXPECT_DOUBLE_EQ(felt[1].force_mean_n, 2.0);
    EXPECT_EQ(felt[2].frames, 0u);
    EXPECT_EQ(felt[2].force_mean_n, 0.0);
}

// Two balls, one after the other.
TEST(FeltSurfaces, ASummaryTellsThemApart) {
    std::string text;
    for (const char* name : {"left", "right"})
        text += std::string("[volume.") + name +
                "]\nanalytic = \"solid_sphere\"\nradius_mm = " + (name[0] == 'l' ? "10" : "20") +
                "\n[surface." + name + "]\nvolume = \"" + name +
                "\"\n[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
    const auto scene = std::make_shared<const Scene>(parse_scene(text, "x.toml"));
    EXPECT_EQ(felt_names(*scene), (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(felt_warning(*scene), "");
    // From outside onto the greater one, which hides the other.
    std::vector<DeviceState> inputs(100);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
        inputs[i].position = {0.0, 0.0, 22e-3 - 5e-5 * static_cast<double>(i)};
    }
    test::ScriptedClock clock(1.0);
    const Trace trace = run_trace(scene, inputs, clock);
    const nlohmann::json summary = nlohmann::json::parse(summarize(*scene, trace));
    ASSERT_EQ(summary["felt"].size(), 2u);
    EXPECT_EQ(summary["felt"][0]["name"], "left");
    EXPECT_EQ(summary["felt"][0]["frames"], 0);
    EXPECT_EQ(summary["felt"][1]["name"], "right");
    EXPECT_EQ(summary["felt"][1]["bit"], 1);
    // 50 um a frame from 2 mm in front: behind the surface from frame 41 on, pressed 2.95 mm at
    // the end by 500 N/m.
    const double frames = summary["felt"][1]["frames"];
    EXPECT_NEAR(frames, 59.0, 1.0);
    EXPECT_NEAR(summary["felt"][1]["contact_s"], 1e-3 * frames, 1e-9);
    EXPECT_NEAR(summary["felt"][1]["force_max_n"], 500.0 * 2.95e-3, 500.0 * 1e-7);
}

} // namespace
} // namespace palpate
