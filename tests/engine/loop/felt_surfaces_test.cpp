// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/report/trace_summary.h>

#include <algorithm>
#include <cmath>
#include <memory>
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
TEST(FeltSurfaces, ASlowOrSilentDeviceDoesNotLengthenTheContact) {
    std::vector<FrameReport> frames(33); // 1 kHz, of a device that reports every 8 ms
    for (std::size_t i = 0; i < frames.size(); ++i) {
        frames[i].frame = i;
        frames[i].time_s = 8e-3 * static_cast<double>(i / 8);
        frames[i].surfaces_felt = 1;
    }
    EXPECT_NEAR(felt_surfaces(kNames, frames, 1e-3)[0].contact_s, 33e-3, 1e-12);
    std::vector<FrameReport> silent(3);
    for (std::size_t i = 0; i < silent.size(); ++i)
        silent[i].frame = i;
    silent[0].surfaces_felt = silent[2].surfaces_felt = 1;
    silent[1].flags = kDeviceStale;
    silent[2].time_s = 5.0;
    EXPECT_NEAR(felt_surfaces(kNames, silent, 1e-3)[0].contact_s, 2e-3, 1e-12);
}

TEST(FeltSurfaces, HaveTheWholeForceOnTheHandWhereSeveralAreFelt) {
    std::vector<FrameReport> frames(1);
    frames[0].surfaces_felt = 0b11;
    frames[0].force = {0.0, 3.0, 4.0};
    const std::vector<FeltSurface> felt = felt_surfaces(kNames, frames, 1e-3);
    EXPECT_DOUBLE_EQ(felt[0].force_max_n, 5.0);
    EXPECT_DOUBLE_EQ(felt[1].force_max_n, 5.0);
}

TEST(FeltSurfaces, FramesThatWereNotComputedAreNotPressed) {
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 40\n[surface.s]\n"
                    "volume = \"v\"\nstiffness_n_per_mm = 0.2\n[[effect]]\ntype = \"surface\"\n"
                    "surface = \"s\"\n",
                    "x.toml"));
    std::vector<DeviceState> inputs(200);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const double way = 3e-5 * static_cast<double>(std::min<std::size_t>(i, 150));
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
        inputs[i].position = {0.0, 0.0, 41e-3 - way};
        if (i >= 160) inputs[i].freshness = Freshness::stale;
    }
    test::ScriptedClock clock(1.0);
    const auto summary = nlohmann::json::parse(summarize(*scene, run_trace(scene, inputs, clock)));
    EXPECT_GT(summary["felt"][0]["frames"], 100);
    EXPECT_EQ(summary["pressed"][0]["indentation_mm"]["frames"], summary["felt"][0]["frames"]);
}

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
