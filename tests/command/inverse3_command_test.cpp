// SPDX-License-Identifier: Apache-2.0
// The command with an Inverse3, whose service is simulated in the tests' own process.
#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/command/check_outcomes.h"
#include "tests/command/command_run.h"
#include "tests/support/simulated_inverse_service.h"

namespace palpate {
namespace {

constexpr const char* kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                              "[surface.skin]\nvolume = \"ball\"\n"
                              "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";

#define EXPECT_PART(text, part)                                                                    \
    EXPECT_NE(std::string(text).find(part), std::string::npos) << std::string(text)

class Inverse3Command : public test::CommandRun {
protected:
    /// Waits until a run has said some hundred forces; false after a minute.
    bool is_felt() {
        std::size_t heard = 0;
        for (int i = 0; i < 6000 && heard < 200; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            heard += service.heard().size();
        }
        return heard >= 200;
    }

    test::SimulatedInverseService service;
    std::string at = "127.0.0.1:" + std::to_string(service.port());
};

TEST_F(Inverse3Command, DevicesListsWhatTheServiceHasAndWhyTellsTheRest) {
    const test::CommandResult listed = run({"devices", "--inverse-service", at});
    EXPECT_EQ(listed.exit, 0) << listed.err;
    EXPECT_PART(listed.out, at +
                                "  Haply inverse3 049D (right): three-dimensional force  "
                                "inverse3:049D" +
                                service.options());
    service.greet_with(R"({"inverse3":[]})");
    EXPECT_PART(run({"devices", "--why", "--inverse-service", at}).out, "it has no device");
    EXPECT_PART(run({"devices", "--why", "--inverse-service", at}).out, "is not plugged in");
    service.stop();
    EXPECT_PART(run({"devices", "--why", "--inverse-service", at}).out, "it does not answer");
    EXPECT_PART(run({"devices", "--inverse-service", at}).out, at + "  Haply Inverse Service: it "
                                                                    "does not answer");
    EXPECT_EQ(run({"devices", "--inverse-service", "127.0.0.1:0"}).exit, 2);
    EXPECT_PART(run({"devices", "--inverse-service", "nowhere"}).err, "give one in digits");
}

TEST_F(Inverse3Command, ARunOverItIsReplayed) {
    make("scene.toml", kBall);
    const test::CommandResult trace =
        run({"trace", "scene.toml", "--pace", "realtime", "--seconds", "1", "--out", "out",
             "--device", "inverse3" + service.options()});
    ASSERT_EQ(trace.exit, 0) << trace.err;
    EXPECT_EQ(run({"replay", "out/recording.h5", "--check"}).exit, 0);
    const auto heard = service.heard();
    ASSERT_GT(heard.size(), 10u);
    EXPECT_EQ(heard.back().force, Vec3(0.0));
}

TEST_F(Inverse3Command, WithoutAServiceARunSaysWhatToDo) {
    service.stop();
    make("scene.toml", kBall + ("[device]\ntype = \"inverse3" + service.options() + "\"\n"));
    const test::CommandResult trace = run({"trace", "scene.toml", "--pace", "realtime"});
    EXPECT_EQ(trace.exit, 4);
    EXPECT_PART(trace.err, "inverse3: no Inverse Service answers at " + at);
    EXPECT_EQ(run({"explain", "scene.toml"}).exit, 0) << "a scene can be looked at without it";
    EXPECT_EQ(run({"trace", "scene.toml"}).exit, 2) << "a hand moves by the clock";
}

TEST_F(Inverse3Command, AnAddressThatCannotBeIsAWrongOptionOrAWrongScene) {
    make("scene.toml", kBall);
    for (const char* wrong :
         {"inverse3:?nonsense=1", "inverse3?nonsense=1", "inverse3?port=0", "inverse3?force_n=11",
          "inverse3:049D?force_n", "plugin:a.so?x=1&x=2"}) {
        const test::CommandResult trace =
            run({"trace", "scene.toml", "--pace", "realtime", "--device", wrong});
        EXPECT_EQ(trace.exit, 2) << wrong << "\n" << trace.err;
        EXPECT_EQ(trace.times("\n"), 1u) << trace.err;
        make("of.toml", kBall + ("[device]\ntype = \"" + std::string(wrong) + "\"\n"));
        const test::CommandResult of_scene = run({"trace", "of.toml", "--pace", "realtime"});
        EXPECT_EQ(of_scene.exit, 3) << wrong << "\n" << of_scene.err;
        EXPECT_PART(of_scene.err, "of.toml:10: ");
    }
    const test::CommandResult evil = run({"trace", "scene.toml", "--pace", "realtime", "--device",
                                          "inverse3:\x1b]0;title\a\n?port=0"});
    EXPECT_EQ(evil.exit, 2);
    EXPECT_PART(evil.err, "inverse3:?]0;title???port=0: ");
    EXPECT_EQ(evil.times("\n"), 1u) << evil.err;
}

// It ended with exit code 0 as if it had been felt to its end.
TEST_F(Inverse3Command, ALostDeviceIsAFailedRunWithAllThatWasRecorded) {
    make("scene.toml", kBall);
    const pid_t child = start({"trace", "scene.toml", "--pace", "realtime", "--seconds", "5",
                               "--out", "out", "--device", "inverse3" + service.options()});
    ASSERT_TRUE(is_felt());
    service.stop();
    const test::CommandResult trace = end(child);
    EXPECT_EQ(trace.exit, 4) << trace.err;
    EXPECT_PART(trace.err, "gave no state in the last ");
    EXPECT_PART(trace.err, " times the service was lost"); // where the machine is slow, twice
    EXPECT_PART(trace.out, "written to out: ");
    EXPECT_EQ(run({"replay", "out/recording.h5", "--check"}).exit, 0);
}

TEST_F(Inverse3Command, ADeviceThatComesBackIsNoFailedRun) {
    make("scene.toml", kBall);
    test::CommandResult trace; // where the service stands still at the end, once more
    for (int trial = 0; trial < 3 && trace.exit != 0; ++trial) {
        service.heard();
        const pid_t child = start({"trace", "scene.toml", "--pace", "realtime", "--seconds", "6",
                                   "--out", "out", "--device", "inverse3" + service.options()});
        ASSERT_TRUE(is_felt());
        service.hang_up();
        trace = end(child);
    }
    EXPECT_EQ(trace.exit, 0) << trace.err;
    EXPECT_PART(trace.err, "the service was lost");
}

// It was taken for a service that had said nothing for as long.
TEST_F(Inverse3Command, ACommandThatIsStoppedForAWhileLosesNoDevice) {
    make("scene.toml", kBall);
    bool was_lost = true; // on a loaded machine the service may be late: one run of three is not
    std::string said;
    for (int trial = 0; trial < 3 && was_lost; ++trial) {
        service.heard(); // of the trial before
        const int before = service.connections();
        const pid_t child =
            start({"trace", "scene.toml", "--pace", "realtime", "--seconds", "4", "--out",
                   "out" + std::to_string(trial), "--device", "inverse3" + service.options()});
        ASSERT_TRUE(is_felt());
        ASSERT_EQ(::kill(child, SIGSTOP), 0);
        std::this_thread::sleep_for(std::chrono::milliseconds(1200));
        ASSERT_EQ(::kill(child, SIGCONT), 0);
        const test::CommandResult trace = end(child);
        said = trace.err;
        was_lost = trace.exit != 0 || service.connections() > before + 1;
    }
    EXPECT_FALSE(was_lost) << said;
}

TEST_F(Inverse3Command, TheDriverPassesTheChecksOfDrivers) {
    const test::CommandResult result = test::passed_in_three([&] {
        return run(
            {"validate", "driver", "inverse3" + service.options(), "--json", "--frames", "2000"});
    });
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(test::checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
}

} // namespace
} // namespace palpate
