// SPDX-License-Identifier: Apache-2.0
// The sub-steps of frames, computed again, are those of the frames that were recorded.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

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
            ASSERT_EQ(std::ranges::count_if(frame.steps,
                                            [](const ViewSubStep& step) {
                                                return step.kind != SubStep::Kind::settle;
                                            }),
                      report.evaluations);
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

/// A ball through a slab: round the ball's equator their levels meet in a crease.
std::shared_ptr<const Scene> ball_and_slab(const std::string& effects) {
    return std::make_shared<const Scene>(
        parse_scene("[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                    "[volume.slab]\nanalytic = \"slab\"\nthickness_mm = 10\n"
                    "[surface.ball]\nvolume = \"ball\"\n[surface.slab]\nvolume = \"slab\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = [\"ball\", \"slab\"]\n" +
                        effects,
                    "crease.toml"));
}

/// Down onto the ball, into the crease, out onto the slab and back, 0.7 mm a frame.
Trace through_the_crease(const std::shared_ptr<const Scene>& scene) {
    std::vector<DeviceState> inputs(60);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const double along = 0.7e-3 * static_cast<double>(i < 30 ? i : 60 - i);
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
        inputs[i].position = {0.008 + along, 0.3e-3 * static_cast<double>(i % 7),
                              i == 0 ? 0.03 : 0.004};
    }
    SteadyClock clock;
    return run_trace(scene, inputs, clock);
}

std::vector<ViewFrameSteps> all_steps(const std::shared_ptr<const Scene>& scene,
                                      const Trace& trace) {
    std::vector<std::uint64_t> frames;
    for (const FrameReport& frame : trace.frames)
        frames.push_back(frame.frame);
    return sub_steps_of(scene, trace, frames);
}

/// The point in front of all planes that is nearest to `pull`, by trying every set of at most
/// three of them to lie on.
Vec3 nearest_in_front(const std::vector<ViewPlane>& planes, const Vec3& pull) {
    constexpr double kRounding_m = 1e-12;
    Vec3 best{0.0};
    double nearest = std::numeric_limits<double>::infinity();
    for (unsigned chosen = 0; chosen < 1u << planes.size(); ++chosen) {
        std::vector<Vec3> axes; // orthonormal, of the chosen normals
        Vec3 at = pull;
        for (std::size_t i = 0; i < planes.size(); ++i) {
            if (!(chosen >> i & 1u)) continue;
            Vec3 axis = planes[i].normal;
            for (const Vec3& other : axes)
                axis -= glm::dot(axis, other) * other;
            const double length = glm::length(axis);
            if (length < 1e-6) continue; // it is one of the others
            axis /= length;
            // Along what the others leave free, onto this plane.
            at += glm::dot(planes[i].normal, planes[i].at - at) / glm::dot(planes[i].normal, axis) *
                  axis;
            axes.push_back(axis);
        }
        const bool in_front = std::ranges::all_of(planes, [&](const ViewPlane& plane) {
            return glm::dot(plane.normal, at - plane.at) > -kRounding_m;
        });
        if (!in_front || glm::length(at - pull) >= nearest) continue;
        nearest = glm::length(at - pull);
        best = at;
    }
    return best;
}

TEST(SubSteps, TheirPlanesAreThoseThatSolveTheFrame) {
    const auto scene = ball_and_slab("");
    const Trace trace = through_the_crease(scene);
    std::size_t in_the_crease = 0;
    for (const ViewFrameSteps& frame : all_steps(scene, trace))
        for (const ViewSubStep& step : frame.steps) {
            ASSERT_EQ(step.pull, trace.frames[frame.frame].probe) << "nothing else draws it";
            const Vec3 twin = nearest_in_front(step.planes, step.pull);
            // Planes that meet at an angle of 30 degrees or more: rounding grows by a few.
            ASSERT_NEAR(glm::length(step.candidate - twin), 0.0, 1e-12) << frame.frame;
            in_the_crease += step.planes.size() > 1 && step.planes.front().active &&
                             step.planes.back().active &&
                             step.planes.front().structure != step.planes.back().structure;
        }
    EXPECT_GT(in_the_crease, 10u);
}

/// How many moves were ended by what.
struct Stops {
    std::size_t met = 0, blocked = 0;
};

/// Checks stops by how far they are behind the exact levels: depth_m(structure, place). The slope
/// of these fields is 1.
template <class Depth>
Stops check_stops(const std::shared_ptr<const Scene>& scene, const Trace& trace,
                  const Depth& depth_m) {
    constexpr double kTau_m = 25e-6; // of the certificate
    constexpr double kRounding_m = 1e-12;
    Stops stops;
    for (const ViewFrameSteps& frame : all_steps(scene, trace)) {
        EXPECT_EQ(frame.steps.back().to, trace.frames[frame.frame].proxy);
        for (const ViewSubStep& step : frame.steps) {
            EXPECT_EQ(step.way.front(), step.from);
            EXPECT_EQ(step.way.back(), step.to);
            const ViewStop& stop = step.stop;
            if (stop.by == ViewStop::By::nothing) {
                EXPECT_TRUE(step.to == step.wanted || step.kind == SubStep::Kind::none);
                continue;
            }
            EXPECT_NEAR(glm::length(stop.at - step.from) + glm::length(step.wanted - stop.at),
                        glm::length(step.wanted - step.from), kRounding_m);
            const double depth = depth_m(stop.structure, stop.at);
            if (stop.by == ViewStop::By::contact) {
                EXPECT_NEAR(depth, 0.0, kRounding_m);
                EXPECT_EQ(step.to, stop.at);
                ++stops.met;
            } else {
                EXPECT_EQ(stop.by, ViewStop::By::certificate);
                EXPECT_NEAR(depth, std::max(kTau_m, depth_m(stop.structure, step.from)),
                            kRounding_m);
                EXPECT_LE(glm::length(step.to - step.from), glm::length(stop.at - step.from));
                ++stops.blocked;
            }
        }
    }
    return stops;
}

TEST(SubSteps, WhatIsMetIsMetOnItsLevel) {
    const auto scene = ball_and_slab("");
    const Stops stops =
        check_stops(scene, through_the_crease(scene), [](int structure, const Vec3& at) {
            return structure == 0 ? 0.02 - glm::length(at) : 0.005 - std::abs(at.z);
        });
    EXPECT_GT(stops.met, 3u);
}

// In a cavity the way along a plane leads behind the level.
TEST(SubSteps, WhatIsBlockedEndsAtTheCertificatesEdge) {
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n"
                    "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\n"
                    "surface = \"s\"\n[loop]\nmethod = \"fixed\"\nsub_steps = 4\n",
                    "cavity.toml"));
    std::vector<DeviceState> inputs(40);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const double angle = 0.3 * static_cast<double>(i); // 15 mm a frame
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
        inputs[i].position = (i == 0 ? 0.04 : 0.052) * Vec3(std::sin(angle), 0.0, std::cos(angle));
    }
    SteadyClock clock;
    const Stops stops = check_stops(scene, run_trace(scene, inputs, clock),
                                    [](int, const Vec3& at) { return glm::length(at) - 0.05; });
    EXPECT_GT(stops.blocked, 30u);
}

// One plane that rubs is solved in closed form: what draws the proxy is in the cone, or the proxy
// is dragged along until it is on the cone's rim.
TEST(SubSteps, FrictionHoldsWhatIsInItsCone) {
    constexpr double kMu = 0.3;
    const auto scene = std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
        "[[effect]]\ntype = \"friction\"\nsurface = \"s\"\nstatic = 0.3\n",
        "rough.toml"));
    const Trace trace = along_a_ball(scene);
    std::size_t held = 0, slipped = 0;
    for (const ViewFrameSteps& frame : all_steps(scene, trace))
        for (const ViewSubStep& step : frame.steps) {
            if (step.friction.empty()) continue;
            ASSERT_EQ(step.friction.size(), 1u);
            const ViewFriction& friction = step.friction.front();
            const ViewPlane& plane = step.planes[friction.plane];
            ASSERT_EQ(friction.axis, plane.normal);
            ASSERT_EQ(friction.coefficient, kMu);
            const Vec3 drawn = step.pull - friction.apex;
            const double depth_m = -glm::dot(friction.axis, drawn);
            const Vec3 aside = drawn + depth_m * friction.axis;
            const double k = step.stiffness_n_per_m;
            ASSERT_NEAR(friction.normal_n, k * depth_m, 1e-9) << "what presses is how deep it is";
            const double aside_m = glm::length(aside), most_m = kMu * depth_m;
            ASSERT_EQ(friction.holds, aside_m <= most_m) << aside_m << " " << most_m;
            const Vec3 twin =
                friction.holds ? friction.apex : friction.apex + (1.0 - most_m / aside_m) * aside;
            // The rounds of the fixed point end at 1e-10 of the multiplier (CoulombFriction).
            ASSERT_NEAR(glm::length(step.candidate - twin), 0.0, 1e-10 * depth_m + 1e-12);
            (friction.holds ? held : slipped) += 1;
            if (friction.holds) {
                ASSERT_NEAR(friction.force_n, k * aside_m, 1e-9);
            } else {
                ASSERT_NEAR(friction.force_n, friction.most_n, 1e-12);
                ASSERT_NEAR(friction.most_n, kMu * friction.normal_n, 1e-9);
            }
        }
    EXPECT_GT(held, 0u);
    EXPECT_GT(slipped, 10u);
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
