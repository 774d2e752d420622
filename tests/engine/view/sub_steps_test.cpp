// SPDX-License-Identifier: Apache-2.0
// The sub-steps of frames, computed again, are those of the frames that were recorded.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/view/sub_steps.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

/// Along the wall of a ball, half a millimetre further in each frame.
Trace along_a_ball(const std::shared_ptr<const Scene>& scene) {
    std::vector<DeviceState> inputs(60);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const double angle = 0.01 * static_cast<double>(i);
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
        inputs[i].position = (i == 0 ? 0.055 : 0.048) * Vec3(std::sin(angle), 0.0, std::cos(angle));
    }
    SteadyClock clock;
    return run_trace(scene, inputs, clock);
}

std::shared_ptr<const Scene> ball(const char* method) {
    return std::make_shared<const Scene>(
        parse_scene(std::string("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                                "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\n"
                                "surface = \"s\"\n[loop]\nmethod = \"") +
                        method + "\"\n",
                    "ball.toml"));
}

TEST(SubSteps, AreThoseOfTheFramesThatWereRecorded) {
    for (const char* method : {"adaptive", "fixed", "paper"}) {
        SCOPED_TRACE(method);
        const auto scene = ball(method);
        const Trace trace = along_a_ball(scene);
        const std::array<std::uint64_t, 4> wanted{30, 7, 59, 1000};
        const std::vector<ViewFrameSteps> found = sub_steps_of(scene, trace, wanted);
        ASSERT_EQ(found.size(), 3u) << "there is no frame 1000";
        EXPECT_EQ(found[0].frame, 7u) << "in the order of the run";
        for (const ViewFrameSteps& frame : found) {
            const FrameReport& report = trace.frames[frame.frame];
            ASSERT_EQ(frame.steps.size(), report.evaluations);
            EXPECT_EQ(frame.steps.front().from, trace.frames[frame.frame - 1].proxy);
            EXPECT_EQ(frame.steps.back().to, report.proxy);
            for (const ViewSubStep& step : frame.steps) {
                ASSERT_EQ(step.planes.size(), 1u);
                const ViewPlane& plane = step.planes.front();
                EXPECT_EQ(plane.structure, 0);
                EXPECT_TRUE(plane.active);
                // The level of a ball at the proxy is across the way from its centre.
                EXPECT_NEAR(glm::dot(plane.normal, glm::normalize(step.from)), 1.0, 1e-12);
                EXPECT_NEAR(glm::dot(plane.normal, plane.at), 0.05, 1e-12);
                // The candidate is on the plane: a hard surface.
                EXPECT_NEAR(glm::dot(plane.normal, step.candidate - plane.at), 0.0, 1e-12);
            }
        }
    }
}

TEST(SubSteps, OfNoFrameAreNone) {
    const auto scene = ball("single");
    EXPECT_TRUE(sub_steps_of(scene, along_a_ball(scene), {}).empty());
}

TEST(HardFrames, AreThoseWithAFlagThenThoseWithTheMostEvaluations) {
    palpate::Run run;
    for (std::uint64_t i = 0; i < 6; ++i) {
        FrameReport frame;
        frame.frame = 100 + i;
        frame.evaluations = i == 2 ? 0 : static_cast<std::uint32_t>(1 + i % 3);
        run.frames.push_back(frame);
    }
    run.frames[3].flags = kStalled;
    run.frames[0].flags = kLiveGain; // says nothing of its solution
    using Frames = std::vector<std::uint64_t>;
    EXPECT_EQ(hard_frames(run, 0), Frames());
    EXPECT_EQ(hard_frames(run, 1), Frames({103}));
    EXPECT_EQ(hard_frames(run, 2), Frames({103, 105}));
    EXPECT_EQ(hard_frames(run, 3), Frames({101, 103, 105})) << "of two alike, the earlier";
    EXPECT_EQ(hard_frames(run, 9), Frames({100, 101, 103, 104, 105})) << "without the empty one";
}

} // namespace
} // namespace palpate
