// SPDX-License-Identifier: Apache-2.0
// The command with an Inverse3, whose service is simulated in the tests' own process.
#include <string>
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
    service.stop();
    EXPECT_PART(run({"devices", "--why", "--inverse-service", at}).out, "it does not answer");
    EXPECT_EQ(run({"devices", "--inverse-service", "127.0.0.1:0"}).exit, 2);
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

TEST_F(Inverse3Command, TheDriverPassesTheChecksOfDrivers) {
    const test::CommandResult result =
        run({"validate", "driver", "inverse3" + service.options(), "--json", "--frames", "2000"});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(test::checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
}

} // namespace
} // namespace palpate
