// SPDX-License-Identifier: Apache-2.0
// A run in real time with a plug-in that does everything wrong in turn: it blocks, gives garbage,
// states that are stale, out of order or there already, fails, and refuses forces. For seconds at
// 1 kHz; PALPATE_CHAOS_SECONDS=258 for so long at 4 kHz, which is a million frames.
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "tests/command/command_run.h"
#include "tests/command/frame_table.h"

namespace palpate {
namespace {

constexpr double kLimit_n = 5.0;    // the scene's
constexpr double kSilence_s = 0.05; // the plug-in's stale_after_s
constexpr double kFade_s = 4e-3;    // docs/device_plugins.md
constexpr double kRounding = 1e-12;

/// The plug-in's handle comes through the ball once in 2 s.
std::string ball(int rate_hz) {
    return "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 15\n[surface.s]\nvolume = \"v\"\n"
           "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[loop]\nrate_hz = " +
           std::to_string(rate_hz) +
           "\n[device]\norigin_mm = [0, -25, -25]\ntype = \"plugin:" PALPATE_PLUGINS
           "/seeded_device.so?defect=CHAOS\"\n";
}

class PluginChaos : public test::CommandRun {};

TEST_F(PluginChaos, ForcesAreBoundedEndInTheStatedTimeAndComeBack) {
    const char* wanted = std::getenv("PALPATE_CHAOS_SECONDS");
    const int rate_hz = wanted != nullptr ? 4000 : 1000;
    make("ball.toml", ball(rate_hz));
    const test::CommandResult trace = run({"trace", "ball.toml", "--pace", "realtime", "--seconds",
                                           wanted != nullptr ? wanted : "8", "--out", "out"});
    ASSERT_EQ(trace.exit, 0) << trace.err;
    for (const char* told : {"reads failed", "writes failed", "states with numbers out of range",
                             "states not later", "took longer than it says"})
        EXPECT_NE(trace.err.find(told), std::string::npos) << told << "\n" << trace.err;

    auto table = test::frame_table(folder() / "out/frames.csv");
    const std::vector<double>&times = table["time_s"], forces = test::force_lengths(table);
    ASSERT_GT(forces.size(), 100u);
    // As many frames with one and the same state are at least that long, however late some came.
    const long silent = std::lround((kSilence_s + kFade_s + 2e-3) * rate_hz);
    long same = 0, ended = 0, felt = 0, returned = 0;
    for (std::size_t i = 0; i < forces.size(); ++i) {
        ASSERT_TRUE(forces[i] <= kLimit_n + kRounding) << i;
        same = i > 0 && times[i] == times[i - 1] ? same + 1 : 0;
        if (same > silent) {
            ASSERT_EQ(forces[i], 0.0) << i;
            ++ended;
        }
        felt += forces[i] > 0.1;
        returned += i > 0 && forces[i] > 0.0 && forces[i - 1] == 0.0;
    }
    std::cout << forces.size() << " frames, " << felt << " with force, " << returned
              << " times it began, " << ended << " frames after a silence\n";
    EXPECT_GT(ended, 0);
    // A machine that is so busy that the recorder did not come for 2 s has lost frames. That is
    // told by the run and by the replay, and is no other recording's fault.
    const bool is_whole = trace.err.find("felt and not recorded") == std::string::npos;
    const test::CommandResult replay = run({"replay", "out/recording.h5", "--check"});
    EXPECT_EQ(replay.exit, is_whole ? 0 : 3) << replay.out << replay.err;
    if (!is_whole) {
        EXPECT_NE(replay.err.find("is missing, as the recorder could not keep up"),
                  std::string::npos)
            << replay.err;
    }
}

} // namespace
} // namespace palpate
