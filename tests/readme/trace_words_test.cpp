// SPDX-License-Identifier: Apache-2.0
// What the command says at the end of a trace, and of a scene in which nothing can be certified.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/record/recording.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/readme/command_folder.h"

namespace palpate {
namespace {

using test::content_of;
using test::make_file;
using test::Outcome;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kBall = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                              "[surface.ball]\nvolume = \"v\"\n"
                              "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

std::size_t count_of(const std::string& text, const std::string& what) {
    std::size_t count = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
        ++count;
    return count;
}

TEST(TraceWords, FlagsAreToldOnceAtTheEndWithCountAndRemedy) {
    const test::CommandFolder folder;
    // 2 mm deep at 1000 N/m is more than a limit of 1 N.
    make_file(folder / "s.toml", std::string(kBall) +
                                     "[coupling]\nstiffness_n_per_m = 1000\n[limits]\nforce_n = 1\n"
                                     "[device]\ntype = \"tour\"\nspacing_mm = 10\n");
    const Outcome done = folder.run("palpate trace s.toml --out t");
    ASSERT_EQ(done.status, 0) << done.errors;
    EXPECT_EQ(count_of(done.errors, "flag force_clamped in "), 1u) << done.errors;
    EXPECT_THAT(done.errors, HasSubstr("raise the limit"));
    EXPECT_THAT(done.output, HasSubstr("covered: 100 % of ball ("));
    EXPECT_THAT(done.output, HasSubstr("depth of the tour's probe"));
}

TEST(TraceWords, EveryFlagHasARemedy) {
    for (const FrameFlagText& text : kFrameFlagTexts)
        EXPECT_THAT(std::string(text.meaning), HasSubstr("; ")) << text.name;
}

TEST(TraceWords, ReplayComparesWhatIsFelt) {
    const test::CommandFolder folder;
    make_file(folder / "s.toml",
              std::string(kBall) + "[device]\ntype = \"tour\"\nspacing_mm = 20\n");
    ASSERT_EQ(folder.run("palpate trace s.toml --out t").status, 0);
    EXPECT_THAT(content_of(folder / "t/frames.csv"), HasSubstr(",ball\n"));
    EXPECT_EQ(folder.run("palpate replay t/recording.h5 --check").status, 0);
    Recording recording = read_recording(folder / "t/recording.h5");
    EXPECT_EQ(recording.felt_names, std::vector<std::string>{"ball"});
    ASSERT_GT(recording.touches.size(), 10u);
    Recording another = recording;
    another.touches[10].force.x += 1.0;
    write_recording(folder / "t/recording.h5", another);
    EXPECT_THAT(folder.run("palpate replay t/recording.h5 --check").output,
                HasSubstr("first difference: frame " + std::to_string(another.touches[10].frame)));
    recording.frames[7].surfaces_felt ^= 1;
    write_recording(folder / "t/recording.h5", recording);
    const Outcome changed = folder.run("palpate replay t/recording.h5 --check");
    EXPECT_EQ(changed.status, 1);
    EXPECT_THAT(changed.output, HasSubstr("first difference: frame 7"));
    // One of an older version, which did not know what was felt, is read and compared without.
    recording.felt_names.clear();
    write_recording(folder / "t/recording.h5", recording);
    EXPECT_EQ(folder.run("palpate replay t/recording.h5 --check").status, 0);
}

TEST(TraceWords, AdaptiveIsNotOfferedAsCertifiedWhereThereIsNoLevel) {
    const test::CommandFolder folder;
    const std::string why = "no surface with a level is felt";
    EXPECT_THAT(folder.run("palpate explain examples/paper_cavity.toml").output,
                HasSubstr("with --method adaptive not certified: " + why));
    const std::string trace = "palpate trace examples/paper_cavity.toml --frames 50 --out t";
    EXPECT_THAT(folder.run(trace + " --method adaptive").errors, HasSubstr("warning: "));
    EXPECT_THAT(folder.run(trace + " --method adaptive").errors, HasSubstr(why));
    EXPECT_THAT(folder.run(trace).errors, Not(HasSubstr(why))) << "the scene's method is paper";
    EXPECT_THAT(folder.run("palpate explain examples/cavity.toml").output, Not(HasSubstr(why)));
}

} // namespace
} // namespace palpate
