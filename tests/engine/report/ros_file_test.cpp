// SPDX-License-Identifier: Apache-2.0
// What a recording leaves for ROS 2. tests/command/mcap_file.py reads whole files by their
// specification; here is what a run of the command does not come to.
#include <palpate/engine/report/ros_file.h>

#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/text_count.h"

namespace palpate {
namespace {

Recording hand(const std::string& name, std::uint64_t frames) {
    Recording run;
    run.hand = name;
    for (std::uint64_t n = 0; n < frames; ++n) {
        FrameReport frame;
        frame.frame = n;
        frame.time_s = 1e-3 * static_cast<double>(n);
        frame.probe = Vec3(0.25, -0.5, static_cast<double>(n));
        frame.proxy = Vec3(0.125, -0.5, static_cast<double>(n));
        frame.force = Vec3(1.0, 2.0, static_cast<double>(n));
        run.frames.push_back(frame);
        run.inputs.emplace_back();
    }
    return run;
}

std::string doubles(std::initializer_list<double> numbers) {
    std::string bytes;
    for (const double number : numbers)
        for (int n = 0; n < 8; ++n)
            bytes += static_cast<char>(std::bit_cast<std::uint64_t>(number) >> (8 * n) & 0xFF);
    return bytes;
}

/// seconds, nanoseconds, and the frame: what a message of the patient begins with.
std::string beginning(std::uint32_t s, std::uint32_t ns) {
    std::string bytes("\0\1\0\0", 4);
    for (const std::uint32_t number : {s, ns, 12U})
        for (int n = 0; n < 4; ++n)
            bytes += static_cast<char>(number >> (8 * n) & 0xFF);
    return bytes + "patient_lps" + std::string(1, '\0');
}

TEST(RosFile, AMessageIsTimeFramePlaceAndTurn) {
    Recording run = hand("", 2);
    run.inputs[1].orientation = {0.5, 0.5, -0.5, 0.5}; // w, x, y, z
    const std::string file = recording_as_mcap({&run, 1});
    // Doubles are at multiples of 8 behind the first 4 bytes: 24 bytes are before them.
    const auto has = [&](const std::string& bytes) { return test::count_of(file, bytes); };
    EXPECT_EQ(has(beginning(0, 1000000) + doubles({0.25, -0.5, 1.0, 0.5, -0.5, 0.5, 0.5})), 1U);
    EXPECT_EQ(has(beginning(0, 1000000) + doubles({0.125, -0.5, 1.0, 0.5, -0.5, 0.5, 0.5})), 1U);
    EXPECT_EQ(has(beginning(0, 0) + doubles({0.25, -0.5, 0.0, 0, 0, 0, 1})), 1U) << "no turn";
    EXPECT_EQ(has(beginning(0, 1000000) + doubles({1.0, 2.0, 1.0, 0, 0, 0})), 1U) << "no torque";
    run.inputs.clear(); // of before orientations were recorded
    EXPECT_EQ(test::count_of(recording_as_mcap({&run, 1}), doubles({0, 0, 0, 1})), 4U);
}

TEST(RosFile, WhatIsNoNumberIsLeftOut) {
    Recording run = hand("", 3);
    run.frames[1].probe.y = std::nan("");
    run.frames[2].force.z = std::numeric_limits<double>::infinity();
    run.inputs[0].orientation.w = std::nan("");
    const std::string file = recording_as_mcap({&run, 1});
    EXPECT_EQ(test::count_of(file, beginning(0, 0)), 3U);
    EXPECT_EQ(test::count_of(file, beginning(0, 1000000)), 2U);
    EXPECT_EQ(test::count_of(file, beginning(0, 2000000)), 2U);
    EXPECT_EQ(test::count_of(file, doubles({std::nan("")})), 0U);
}

TEST(RosFile, TimeDoesNotGoBackAndIsOneThatRosKnows) {
    Recording run = hand("", 4);
    run.frames[0].time_s = 1.5;
    run.frames[1].time_s = 1.75;
    run.frames[2].time_s = 0.25; // a trial
    run.frames[3].time_s = 0.5;
    const std::string file = recording_as_mcap({&run, 1});
    for (const auto& [s, ns] :
         {std::pair{1U, 500000000U}, {1U, 750000000U}, {2U, 0U}, {2U, 250000000U}})
        EXPECT_EQ(test::count_of(file, beginning(s, ns)), 3U) << s << ", " << ns;
    for (const double time_s :
         {-1.0, 2147483648.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        run.frames[0].time_s = time_s;
        EXPECT_THROW(recording_as_mcap({&run, 1}), std::invalid_argument) << time_s;
    }
    run.frames = {run.frames[1]};
    run.frames[0].time_s = 2147483647.0;
    EXPECT_EQ(test::count_of(recording_as_mcap({&run, 1}), beginning(2147483647U, 0)), 3U);
}

TEST(RosFile, EachHandHasTopicsThatRosTakes) {
    const std::vector<Recording> hands{hand("left-1", 2), hand("left_1", 3), hand("2nd", 1),
                                       hand("none", 0)};
    const std::string file = recording_as_mcap(hands);
    for (const char* topic : {"/palpate/left_1/probe", "/palpate/left_1_2/force",
                              "/palpate/hand_2nd/proxy", "/palpate/none/probe"})
        EXPECT_EQ(test::count_of(file, topic), 2U) << topic << ", and once in the summary";
    EXPECT_EQ(test::count_of(file, beginning(0, 0)), 9U);
    EXPECT_EQ(test::count_of(file, beginning(0, 2000000)), 3U);
    EXPECT_FALSE(recording_as_mcap({}).empty()) << "a file without hands is a file";
}

} // namespace
} // namespace palpate
