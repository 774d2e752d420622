// SPDX-License-Identifier: Apache-2.0
// `palpate validate effect` finds each fault of effect_plugins/seeded_effect.cpp by the check that
// is meant, and none in Palpate's own kinds.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/command/check_outcomes.h"
#include "tests/command/command_run.h"

namespace palpate {
namespace {

using test::checks;

const std::string kFolder = PALPATE_EFFECTS;

/// Faults that the environment chooses, and the check that finds each.
const std::map<std::string, std::string> kFoundBy{
    {"THROWS", "make"},
    {"NULL", "make"},
    {"SAYS_NEGATIVE", "promises"},
    {"NAN", "finite"},
    {"NEGATIVE", "finite"},
    {"LONG_AXIS", "unit_vectors"},
    {"MANY", "room"},
    {"FAR", "far"},
    {"CRASHES_ON_LEAP", "far"},
    {"PERIOD", "rates"},
    {"CLOCK", "same_bits"},
    {"DIES_IN_ANOTHER_PROCESS", "same_bits"},
    {"STATIC", "independent"},
    {"NO_RESTART", "restart"},
    {"GATHER_MOVES", "gather_keeps"},
    {"NOT_FELT", "felt"},
    {"COUNTS_IN_BEGIN", "gain_zero"},
    {"RESTARTS_CRASH", "gains"},
    {"CRASHES_AFTER_SILENCE", "odd_probes"},
    {"ASKED_ONCE", "methods"},
    {"REMEMBERS_TOUCH", "new_trial"},
    {"FORGETS", "save_restore"},
    {"OWN_STATE", "restore_other"},
    {"SHAKES", "rest"},
    {"PUSHES", "unasked"},
    {"DRIVES", "passivity"},
    {"SLOW", "cost"},
    {"ALLOCATES", "allocation"},
    {"LOCKS", "locks"},
    {"LOCKS_SHARED", "locks"},
    {"SLEEPS", "system_calls"},
    {"LEAKS_MEMORY", "memory"},
    {"LEAKS_LARGE", "memory"},
    {"LEAKS_THREAD", "memory"},
};

/// Faults that are compiled in.
const std::map<std::string, std::string> kFilesFoundBy{
    {"NO_ENTRY", "entry"}, {"WRONG_VERSION", "version"}, {"WRONG_LAYOUT", "layout"}};

/// Checks that count calls, which a sanitizer has its own of.
bool is_watched(const std::string& check) {
    return check != "allocation" && check != "locks" && check != "system_calls" &&
           check != "memory";
}

class ValidateEffect : public test::CommandRun {
protected:
    test::CommandResult run_with(const char* defect, std::vector<std::string> words) {
        ::setenv("PALPATE_DEFECT", defect, 1);
        const test::CommandResult result = run(words);
        ::unsetenv("PALPATE_DEFECT");
        return result;
    }
};

TEST_F(ValidateEffect, AnEffectWithoutAFaultPassesEveryCheck) {
    const test::CommandResult result =
        run({"validate", "effect", kFolder + "/seeded_effect.so", "--json"});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
    EXPECT_GE(checks(result, "PASS").size(), 29u) << result.out;
}

TEST_F(ValidateEffect, TheExampleOfTheDocumentsPasses) {
    const test::CommandResult result = run({"validate", "effect", kFolder + "/wave.so", "--json"});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_GE(checks(result, "PASS").size(), 27u) << result.out;
}

/// One test each, so that they share the cores.
class SeededEffect : public ValidateEffect,
                     public testing::WithParamInterface<std::pair<const std::string, std::string>> {
};

/// With all checks where PALPATE_ALL_CHECKS is set: the others must not fail, but of what is slow,
/// which the others wait for. Else the check that is meant, and those that it needs.
TEST_P(SeededEffect, IsFoundByItsCheck) {
    const auto& [defect, check] = GetParam();
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    if (!is_watched(check)) GTEST_SKIP() << "a sanitizer allocates and calls in its own way";
#else
    static_cast<void>(is_watched);
#endif
    std::vector<std::string> words{"validate", "effect", kFolder + "/seeded_effect.so", "--json"};
    if (std::getenv("PALPATE_ALL_CHECKS") == nullptr || defect == "SLOW") {
        words.push_back("--only");
        words.push_back(check);
    }
    const test::CommandResult result = run_with(defect.c_str(), words);
    EXPECT_EQ(result.exit, 1) << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{check}) << result.out;
}

INSTANTIATE_TEST_SUITE_P(Effect, SeededEffect, testing::ValuesIn(kFoundBy.begin(), kFoundBy.end()),
                         [](const auto& fault) { return fault.param.first; });

/// Each kind of the engine's own, by the name that scenes know it by.
class OwnKind : public ValidateEffect, public testing::WithParamInterface<const char*> {};

TEST_P(OwnKind, PassesEveryCheck) {
    const test::CommandResult result = run({"validate", "effect", GetParam(), "--json"});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
    EXPECT_GE(checks(result, "PASS").size(), 18u) << result.out;
}

constexpr const char* kKinds[] = {
    "surface",     "gradient_surface", "constant_force", "gradient_force",
    "viscosity",   "vector_force",     "vector_follow",  "fibre_follow",
    "front_shape", "vortex",           "friction",       "stick_slip",
    "guide",       "workspace",        "vibration",      "gravity_compensation",
    "magnet",      "texture"};

INSTANTIATE_TEST_SUITE_P(Effect, OwnKind, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param); });

TEST_F(ValidateEffect, FaultsOfTheFileAreFound) {
    for (const auto& [defect, check] : kFilesFoundBy) {
        const test::CommandResult result =
            run({"validate", "effect", kFolder + "/" + defect + ".so", "--json"});
        EXPECT_EQ(result.exit, 1) << result.err;
        EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{check}) << result.out;
    }
}

TEST_F(ValidateEffect, EveryCheckHasAFaultThatItFinds) {
    std::set<std::string> checks{"file", "converges"}; // a file that is none; a warning
    for (const auto& faults : {kFoundBy, kFilesFoundBy})
        for (const auto& [defect, check] : faults)
            checks.insert(check);
    EXPECT_EQ(checks, test::listed_checks(run({"validate", "effect", "guide", "--list"})));
}

TEST_F(ValidateEffect, AnEffectThatFindsNoBalanceIsAWarning) {
    const test::CommandResult result =
        run_with("BENDS", {"validate", "effect", kFolder + "/seeded_effect.so", "--json", "--only",
                           "converges"});
    EXPECT_EQ(result.exit, 0) << result.out;
    EXPECT_EQ(checks(result, "WARN"), std::vector<std::string>{"converges"}) << result.out;
}

TEST_F(ValidateEffect, AProcessThatEndsEarlyIsNotWaitedFor) {
    const test::CommandResult result =
        run_with("DIES_IN_ANOTHER_PROCESS",
                 {"validate", "effect", kFolder + "/seeded_effect.so", "--only", "same_bits"});
    EXPECT_EQ(result.exit, 1);
    EXPECT_NE(result.out.find("a process with it ends early"), std::string::npos) << result.out;
}

TEST_F(ValidateEffect, APushThatIsSaidOnceAFrameHasBegunIsSaid) {
    const test::CommandResult result =
        run_with("SAYS_AS_IT_PUSHES", {"validate", "effect", kFolder + "/seeded_effect.so",
                                       "--json", "--only", "unasked"});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    const std::vector<std::string> passed = checks(result, "PASS");
    EXPECT_EQ(std::count(passed.begin(), passed.end(), "unasked"), 1) << result.out;
}

/// What a scene does by itself is not the effect's fault.
class EffectInScene
    : public ValidateEffect,
      public testing::WithParamInterface<std::pair<const std::string, std::string>> {};

TEST_P(EffectInScene, PassesTheCheck) {
    const auto& [check, tables] = GetParam();
    make("scene.toml", "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n"
                       "[surface.ball]\nvolume = \"ball\"\n"
                       "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n" +
                           tables);
    const test::CommandResult result = run({"validate", "effect", kFolder + "/seeded_effect.so",
                                            "--scene", "scene.toml", "--json", "--only", check});
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    const std::vector<std::string> passed = checks(result, "PASS");
    EXPECT_EQ(std::count(passed.begin(), passed.end(), check), 1) << result.out;
}

/// Frames that are shorter than what a method may spend; a force that comes late from one trial to
/// the next; a push of the scene's own.
const std::map<std::string, std::string> kScenes{
    {"methods", "[loop]\nrate_hz = 20000\n"},
    {"new_trial", "[limits]\nslew_n_per_s = 100\n"},
    {"unasked", "[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, 0.6]\n"}};

INSTANTIATE_TEST_SUITE_P(Effect, EffectInScene, testing::ValuesIn(kScenes.begin(), kScenes.end()),
                         [](const auto& scene) { return scene.param.first; });

TEST_F(ValidateEffect, WhatIsAskedWronglyIsSaid) {
    const test::CommandResult kind = run({"validate", "effect", "guid"});
    EXPECT_EQ(kind.exit, 2);
    EXPECT_NE(kind.err.find("validate effect guid: there is no such kind"), std::string::npos)
        << kind.err;
    for (const char* name : kKinds)
        EXPECT_NE(run({"validate", "effect", "x"}).err.find(name), std::string::npos) << name;
    EXPECT_EQ(run({"validate", "effect"}).exit, 2);
    EXPECT_EQ(run({"validate", "effect", "guide", "--scene", "x.toml"}).exit, 2);
    EXPECT_EQ(run({"validate", "effect", "guide", "--forces"}).exit, 2);
    EXPECT_EQ(run({"validate", "driver", "hand", "--path", "x.csv"}).exit, 2);
    for (const char* option : {"--scene", "--path"}) {
        const test::CommandResult none =
            run({"validate", "effect", kFolder + "/wave.so", option, "none.toml"});
        EXPECT_EQ(none.exit, 3) << none.out;
        EXPECT_NE(none.err.find("none.toml: cannot be read"), std::string::npos) << none.err;
    }
    const test::CommandResult file = run({"validate", "effect", "./none.so", "--only", "file"});
    EXPECT_EQ(file.exit, 1);
    EXPECT_NE(file.out.find("none.so: there is no such file; give the effect's shared library"),
              std::string::npos)
        << file.out;
    const test::CommandResult folder = run({"validate", "effect", "./", "--only", "file"});
    EXPECT_NE(folder.out.find(": is no file; give the effect's"), std::string::npos) << folder.out;
}

TEST_F(ValidateEffect, TimeThatTheKernelTellsIsNoFault) {
    const test::CommandResult result =
        run_with("TIME_OF_KERNEL", {"validate", "effect", kFolder + "/seeded_effect.so", "--json",
                                    "--only", "system_calls"});
    EXPECT_EQ(result.exit, 0) << result.out;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
}

} // namespace
} // namespace palpate
