// SPDX-License-Identifier: Apache-2.0
// Frames without a place of the hand, in a study.
#include <palpate/engine/study/study.h>

#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/run/trace.h>

#include "tests/engine/study/study_fixture.h"

namespace palpate {
namespace {

using namespace test::study;

TEST(Study, ATrialThatBeginsWithNoPlaceIsJudgedFromItsFirstPlace) {
    for (const bool silent : {false, true}) {
        std::vector<DeviceState> inputs = along_the_wall(1e-4);
        DeviceState nowhere = inputs.front();
        if (silent) {
            nowhere.freshness = Freshness::stale;
            nowhere.position *= 1.1; // within the wall
        } else {
            nowhere.position.x = std::numeric_limits<double>::quiet_NaN();
        }
        for (DeviceState& state : inputs)
            state.time_s += 1e-3;
        inputs.insert(inputs.begin(), nowhere);
        test::ScriptedClock clock(1.0);
        const Study study = run_study(gradient_cavity("[[-1e-9, 0], [0, 1.05], [1e-4, 0]]"), inputs,
                                      {fixed(1), fixed(64)}, clock);
        EXPECT_GT(*study.runs[0].lost_contact, kFrames / 4) << silent;
        EXPECT_EQ(*study.runs[1].lost_contact, 0u) << silent;
    }
}

TEST(Study, NothingIsInsideWhatASilentDeviceDoesNotFeel) {
    std::vector<DeviceState> inputs = along_the_wall(-1e-3); // begun inside: it is not felt
    for (std::size_t i = inputs.size() - 20; i < inputs.size(); ++i)
        inputs[i].freshness = Freshness::stale;
    test::ScriptedClock clock(1.0);
    EXPECT_EQ(run_trace(surface_cavity(), inputs, clock).audits.front().frames_inside(), 0u);
    const Study study = run_study(surface_cavity(), inputs, {fixed(4), LoopDescription{}}, clock);
    for (const StudyRun& run : study.runs) { // in which no frame can be judged
        EXPECT_EQ(run.frames_inside.value_or(0), 0u) << title(run);
        EXPECT_EQ(run.deepest_um.value_or(0.0), 0.0) << title(run);
    }
}

// A baseline stands still while its device is silent, as the loops do, and begins a trial where the
// device is first heard.
TEST(Study, BaselinesAreNotJudgedWhereTheDeviceIsSilent) {
    std::vector<DeviceState> inputs = along_the_wall(1e-4);
    StudyExtent extent;
    extent.baselines = true;
    const auto lost = [&](const Study& study) {
        std::vector<std::uint64_t> frames;
        for (const StudyRun& run : study.runs)
            if (run.baseline) frames.push_back(run.lost_contact.value_or(0));
        return frames;
    };
    const auto scene = surface_cavity();
    test::ScriptedClock clock(1.0);
    const auto heard = lost(run_study(scene, inputs, {fixed(64)}, clock, {}, extent));
    ASSERT_FALSE(heard.empty());
    DeviceState nowhere = inputs.front();
    nowhere.freshness = Freshness::stale;
    nowhere.position *= 1.1; // within the wall
    inputs.insert(inputs.begin(), nowhere);
    const DeviceState last = inputs.back();
    for (int i = 0; i < 500; ++i) { // a hand that goes away, unheard
        DeviceState state = last;
        state.freshness = Freshness::stale;
        state.position *= 1.0 - 1e-3 * i;
        inputs.push_back(state);
    }
    for (std::size_t i = 0; i < inputs.size(); ++i)
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
    EXPECT_EQ(lost(run_study(scene, inputs, {fixed(64)}, clock, {}, extent)), heard);
}

} // namespace
} // namespace palpate
