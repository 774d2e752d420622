// SPDX-License-Identifier: Apache-2.0
// `palpate validate driver` finds each fault of plugins/seeded_device.c by the check that is meant,
// and nothing in a plug-in without one.
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <sys/statvfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/command/check_outcomes.h"
#include "tests/command/command_run.h"

namespace palpate {
namespace {

using test::checks;

const std::string kFolder = PALPATE_PLUGINS;

/// Faults that an option chooses, and the check that finds each.
const std::map<std::string, std::string> kFoundBy{
    {"ANY_OPTION", "unknown_option"},
    {"SILENT_OPEN", "open"},
    {"NEEDS_FILE", "open_without_device"},
    {"RATE_NAN", "properties"},
    {"PROPERTIES_CHANGE", "properties_stay"},
    {"SECOND_OPEN_CRASHES", "open_twice"},
    {"CRASH_BEFORE_START", "before_start"},
    {"FORCE_BEFORE_START", "before_start"},
    {"START_FAILS", "start"},
    {"START_EXITS", "start"},
    {"NO_STATE", "first_state"},
    {"NAN_POSITION", "finite"},
    {"TIME_BACK", "time_forward"},
    {"TIME_MS", "time_unit"},
    {"SAME_TIME", "time_unit"},
    {"POSITION_MM", "position_unit"},
    {"SLOW_STATES", "rate"},
    {"OUTSIDE", "workspace"},
    {"WRONG_VELOCITY", "velocity"},
    {"WRONG_BUTTONS", "buttons"},
    {"ALWAYS_STALE", "fresh"},
    {"SLOW_READ", "read_time"},
    {"SLOW_WRITE", "write_time"},
    {"BLOCKS", "blocking"},
    {"ALLOCATES", "allocation"},
    {"HOLDS_LOCK", "locks"},
    {"HOLDS_RWLOCK", "locks"},
    {"REFUSES_FORCE", "force_taken"},
    {"TOO_STRONG", "force_limit"},
    {"NAN_FORCE", "force_not_finite"},
    {"WRONG_SIGN", "force_sign"},
    {"DELAYED", "passivity"},
    {"FORCE_AFTER_STOP", "zero_at_stop"},
    {"FORCE_AFTER_STOP_READ_FAILS", "zero_at_stop"},
    {"SECOND_STOP_CRASHES", "stop_twice"},
    {"NO_RESTART", "restart"},
    {"STUCK_AFTER_STOP", "restart"},
    {"TAKES_SIGNALS", "signals"},
    {"CRASH_LATE", "endurance"},
    {"DIES_LATE", "endurance"},
    {"DIES_OTHERWISE", "endurance"},
    {"DIES_SILENT", "endurance"},
    {"DIES_FROZEN", "endurance"},
    {"SLOW_STOP", "stop_twice"},
    {"WRONG_VELOCITY_FINE", "velocity"},
    {"FORCE_AFTER_STOP_NOTHING_NEW", "zero_at_stop"},
    {"CRASH_IN_CLOSE", "close"},
    {"CRASH_UNSTARTED", "close_unstarted"},
    {"NO_REOPEN", "reopen"},
    {"LEAKS_FILE", "descriptors"},
    {"LEAKS_THREAD", "threads"},
    {"LEAKS_MEMORY", "memory"},
    {"LEAKS_LARGE", "memory"},
};

/// Faults that are compiled in.
const std::map<std::string, std::string> kFilesFoundBy{
    {"UNDEFINED_SYMBOL", "file"}, {"NO_ENTRY", "entry"},   {"NULL_TABLE", "entry"},
    {"WRONG_ABI", "version"},     {"SHORT_TABLE", "size"}, {"NULL_READ", "functions"}};

constexpr const char* kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                              "[surface.skin]\nvolume = \"ball\"\n"
                              "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";

/// The ball, felt with a plug-in.
std::string ball_with(const std::string& plugin) {
    return kBall + ("[device]\ntype = \"plugin:" + plugin + "\"\n");
}

class ValidateCommand : public test::CommandRun {
protected:
    /// With all checks where PALPATE_ALL_CHECKS is set: the others must not fail. That takes some
    /// minutes; else the check that is meant, and those that it needs.
    void expect_found(const std::string& driver, const std::string& check) {
        SCOPED_TRACE(driver);
        std::vector<std::string> words{"validate",  "driver", driver,     "--json",
                                       "--limit-s", "30",     "--frames", "25000"};
        if (std::getenv("PALPATE_ALL_CHECKS") == nullptr) {
            words.push_back("--only");
            words.push_back(check);
        }
        const test::CommandResult result = run(words);
        EXPECT_EQ(result.exit, 1) << result.err;
        EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{check}) << result.out;
    }
};

TEST_F(ValidateCommand, AFileThatIsCalledAsADriverOfOursBeginsIsAPlugIn) {
    const test::CommandResult result =
        run({"validate", "driver", "inverse3_none.so", "--json", "--only", "file"});
    EXPECT_EQ(result.exit, 1);
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{"file"}) << result.out;
}

TEST_F(ValidateCommand, APluginWithoutAFaultPassesEveryCheck) {
    const test::CommandResult result =
        run({"validate", "driver", kFolder + "/seeded_device.so", "--json", "--frames", "20000"});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
    EXPECT_EQ(checks(result, "WARN"), std::vector<std::string>{}) << result.out;
    std::vector<std::string> skipped = checks(result, "SKIP");
    EXPECT_LE(skipped.size(), 2u) << "allocations and locks are not counted under sanitizers";
    EXPECT_GE(checks(result, "PASS").size(), 40u);
}

/// Runs a hand in Python beside what it is given.
class PythonHand {
public:
    explicit PythonHand(const std::string& port) : process_(::fork()) {
        if (process_ != 0) return;
        ::execl(PALPATE_PYTHON, PALPATE_PYTHON, "-B", PALPATE_HAND, port.c_str(), "120", nullptr);
        ::_exit(127);
    }
    ~PythonHand() {
        ::kill(process_, SIGKILL);
        ::waitpid(process_, nullptr, 0);
    }
    PythonHand(const PythonHand&) = delete;
    PythonHand& operator=(const PythonHand&) = delete;

private:
    pid_t process_;
};

TEST_F(ValidateCommand, TheUdpExampleWithAHandInPythonPassesAndIsReplayed) {
    const std::string port = std::to_string(20000 + ::getpid() % 20000);
    const std::string plugin = kFolder + "/udp_device.so?port=" + port;
    const PythonHand hand(port);
    const test::CommandResult result = test::passed_in_three([&] {
        return run({"validate", "driver", plugin, "--json", "--frames", "20000"});
    });
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
    EXPECT_GE(checks(result, "PASS").size(), 38u) << result.out;

    make("scene.toml", kBall);
    const test::CommandResult trace = test::passed_in_three([&] {
        return run({"trace", "scene.toml", "--pace", "realtime", "--seconds", "3", "--out", "out",
                    "--device", "plugin:" + plugin});
    });
    ASSERT_EQ(trace.exit, 0) << trace.err;
    EXPECT_EQ(run({"replay", "out/recording.h5", "--check"}).exit, 0);
}

TEST_F(ValidateCommand, TheSimulatedHandPasses) {
    const test::CommandResult result = test::passed_in_three([&] {
        return run({"validate", "driver", "hand", "--json", "--frames", "20000"});
    });
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_GE(checks(result, "PASS").size(), 30u) << result.out;
}

TEST_F(ValidateCommand, EnduranceEndsWithinTheTimeForACheck) {
    const test::CommandResult result =
        run({"validate", "driver", "hand", "--json", "--only", "endurance", "--frames",
             "1000000000", "--limit-s", "6"}); // of which a quarter is left for what comes between
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
}

TEST_F(ValidateCommand, APathOfAFilePasses) {
    std::string path = "t_s,x_m,y_m,z_m\n"; // to and fro, 20 mm in a second; 2 s
    for (int i = 0; i < 2000; ++i)
        path += fmt::format("{},{},0,0\n", 1e-3 * i, 0.01 * std::sin(2.0 * M_PI * 1e-3 * i));
    make("probe.csv", path);
    test::expect_passed_without_force(test::passed_in_three([&] {
        return run({"validate", "driver", "path:probe.csv", "--json"});
    }));
}

TEST_F(ValidateCommand, FaultsOfTheFileAreFound) {
    for (const auto& [defect, check] : kFilesFoundBy)
        expect_found(kFolder + "/seeded_" + defect + ".so", check);
}

TEST_F(ValidateCommand, AnExceptionOfAPluginIsNamedWithItsFunction) {
    const test::CommandResult result =
        run({"validate", "driver", kFolder + "/throwing_device.so", "--only", "open"});
    EXPECT_EQ(result.exit, 1);
    EXPECT_NE(result.out.find("an exception leaves open (no such port); catch it there"),
              std::string::npos)
        << result.out;
}

/// One test each, so that they share the cores.
class SeededFault : public ValidateCommand,
                    public testing::WithParamInterface<std::pair<const std::string, std::string>> {
};

TEST_P(SeededFault, IsFoundByItsCheck) {
    const auto& [defect, check] = GetParam();
    expect_found(kFolder + "/seeded_device.so?defect=" + defect, check);
}

INSTANTIATE_TEST_SUITE_P(Plugin, SeededFault, testing::ValuesIn(kFoundBy.begin(), kFoundBy.end()),
                         [](const auto& fault) { return fault.param.first; });

TEST_F(ValidateCommand, EveryCheckHasAFaultThatItFinds) {
    std::set<std::string> checks{"watchdog"}; // a warning
    for (const auto& faults : {kFoundBy, kFilesFoundBy})
        for (const auto& [defect, check] : faults)
            checks.insert(check);
    EXPECT_EQ(checks, test::listed_checks(run({"validate", "driver", "hand", "--list"})));
}

TEST_F(ValidateCommand, ADriverThatHangsIsEndedAndTheOtherChecksAreSkipped) {
    for (const char* defect : {"OPEN_HANGS", "HANG_IN_CLOSE"}) {
        const test::CommandResult result =
            run({"validate", "driver", kFolder + "/seeded_device.so?defect=" + defect, "--only",
                 "reopen", "--limit-s", "5"});
        EXPECT_EQ(result.exit, 1);
        EXPECT_NE(result.out.find("does not return within 5 s; let no call wait"),
                  std::string::npos)
            << result.out;
    }
}

TEST_F(ValidateCommand, AForceThatNobodyEndsIsAWarning) {
    const test::CommandResult result =
        run({"validate", "driver", kFolder + "/seeded_device.so?defect=HOLDS_FOREVER", "--json",
             "--only", "watchdog"});
    EXPECT_EQ(result.exit, 0);
    EXPECT_EQ(checks(result, "WARN"), std::vector<std::string>{"watchdog"}) << result.out;
}

TEST_F(ValidateCommand, WhatIsAskedWronglyIsSaid) {
    const test::CommandResult none = run({"validate", "driver", "hand", "--only", "times"});
    EXPECT_EQ(none.exit, 2);
    EXPECT_NE(none.err.find("--only times: there is no such check; "), std::string::npos)
        << none.err;
    EXPECT_EQ(run({"validate", "driver"}).exit, 2);
    const test::CommandResult file = run({"validate", "driver", "none.so", "--only", "file"});
    EXPECT_EQ(file.exit, 1);
    EXPECT_NE(file.out.find("none.so: there is no such file; give the plug-in's"),
              std::string::npos)
        << file.out;
    EXPECT_EQ(run({"validate", "driver", "x.so?port", "--list"}).exit, 0);
    EXPECT_EQ(run({"validate", "driver", "x.so?port"}).exit, 3);
}

TEST_F(ValidateCommand, ARunWithAPluginIsReplayedToTheLastBit) {
    make("scene.toml", ball_with(kFolder + "/seeded_device.so"));
    const test::CommandResult trace =
        run({"trace", "scene.toml", "--pace", "realtime", "--seconds", "1", "--out", "out"});
    ASSERT_EQ(trace.exit, 0) << trace.err;
    EXPECT_NE(trace.err.find("device"), std::string::npos);
    const test::CommandResult replay = run({"replay", "out/recording.h5", "--check"});
    EXPECT_EQ(replay.exit, 0) << replay.out << replay.err;

    const test::CommandResult asap = run({"trace", "scene.toml"});
    EXPECT_EQ(asap.exit, 2);
    EXPECT_NE(asap.err.find("use --pace realtime"), std::string::npos) << asap.err;
}

TEST_F(ValidateCommand, ARunThatHangsInThePluginEndsAndSaysSo) {
    make("scene.toml", ball_with(kFolder + "/seeded_device.so?defect=HANG_IN_READ"));
    const test::CommandResult trace =
        run({"trace", "scene.toml", "--pace", "realtime", "--seconds", "1", "--out", "out"});
    EXPECT_EQ(trace.exit, 0) << trace.err;
    EXPECT_NE(trace.err.find("stop did not return"), std::string::npos) << trace.err;
    EXPECT_EQ(run({"replay", "out/recording.h5", "--check"}).exit, 0);
}

TEST_F(ValidateCommand, APluginThatIsNotThereIsADeviceError) {
    make("scene.toml", ball_with(folder().string() + "/none.so"));
    const test::CommandResult trace = run({"trace", "scene.toml", "--pace", "realtime"});
    EXPECT_EQ(trace.exit, 4);
    EXPECT_NE(trace.err.find("none.so: there is no such file; give the plug-in's shared library"),
              std::string::npos)
        << trace.err;
    EXPECT_EQ(run({"explain", "scene.toml"}).exit, 0) << "a scene can be looked at without it";
}

TEST_F(ValidateCommand, PluginsAreListedWhereTheyAreNamed) {
    const test::CommandResult listed =
        run({"devices", "--plugin", kFolder + "/seeded_device.so", kFolder + "/none.so"});
    EXPECT_EQ(listed.exit, 0) << listed.err;
    EXPECT_NE(listed.out.find("seeded_device.so  seeded 1.0: plug-in  plugin:"), std::string::npos)
        << listed.out;
    EXPECT_NE(listed.out.find("none.so: there is no such file"), std::string::npos) << listed.out;
}

// It closed what its check speaks through, and was waited for without an end.
TEST_F(ValidateCommand, ADriverThatClosesAllFilesAndHangsIsEnded) {
    const pid_t child =
        start({"validate", "driver", kFolder + "/seeded_device.so?defect=CLOSES_FILES", "--only",
               "open", "--limit-s", "5"});
    siginfo_t ended{};
    for (int i = 0; i < 300 && ended.si_pid == 0; ++i) {
        ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT),
                  0);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_EQ(ended.si_pid, child) << "it hangs";
    if (ended.si_pid == 0) ::kill(child, SIGKILL);
    const test::CommandResult result = end(child);
    EXPECT_EQ(result.exit, 1);
    EXPECT_NE(result.out.find("FAIL  open"), std::string::npos) << result.out;
}

// docs/realtime.md gives the command its rights by setcap. The loader then takes LD_PRELOAD away,
// and the command began anew for ever.
TEST_F(ValidateCommand, ACommandWithCapabilitiesEndsAndSaysThatItCannotCount) {
    const std::string nobody = "setpriv --reuid 65534 --regid 65534 --clear-groups ";
    const std::string there = "cd '" + folder().string() + "' && ";
    const std::string build = std::filesystem::path(PALPATE_COMMAND).parent_path().string();
    const std::string made = there + "chmod 755 . && cp '" + PALPATE_COMMAND + "' palpate && cp '" +
                             build +
                             "/palpate_call_watch.so' . && setcap cap_sys_nice+ep palpate && " +
                             nobody + "./palpate --version >version.txt 2>&1";
    struct statvfs disk {};
    const bool gives_none = // as /tmp of Debian 13
        ::statvfs(folder().c_str(), &disk) != 0 || (disk.f_flag & ST_NOSUID) != 0;
    if (::geteuid() != 0 || gives_none || std::system(made.c_str()) != 0)
        GTEST_SKIP() << "needs root, setcap, setpriv, a folder for temporary files that is not "
                        "mounted nosuid, and a build that everybody may read";
    const std::string checked = there + "timeout 60 " + nobody +
                                "./palpate validate driver hand --only allocation >said.txt 2>&1";
    EXPECT_EQ(std::system(checked.c_str()), 0) << test::content_of(*this / "said.txt");
    EXPECT_NE(test::content_of(*this / "said.txt").find("SKIP  allocation"), std::string::npos);
}

} // namespace
} // namespace palpate
