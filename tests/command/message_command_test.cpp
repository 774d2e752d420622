// SPDX-License-Identifier: Apache-2.0
// What only the command says: names that do not exist, options without effect, paths that miss.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include <sys/stat.h>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class CommandMessages : public test::CommandRun {
protected:
    CommandMessages() {
        make("ball.toml", test::ball_scene());
        make("probe.csv", test::pressing_path());
    }

    void expect_usage(const std::vector<std::string>& arguments, const std::string& words) {
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, 2) << result.err;
        EXPECT_THAT(result.err, HasSubstr(words));
        EXPECT_EQ(result.times("\n"), 1u) << result.err;
    }
};

// They were sent to a line of a file that no editor shows.
TEST_F(CommandMessages, ARecordingOrAVolumeInPlaceOfASceneIsSaidToBeOne) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    const test::CommandResult recording = run({"trace", "t/recording.h5"});
    EXPECT_EQ(recording.exit, 3);
    EXPECT_THAT(recording.err,
                HasSubstr("t/recording.h5: is a recording, and no scene; give it to"));
    make("head.nrrd", "NRRD0004\ntype: short\n\n");
    make("head.nii", std::string("\x5c\x01\0\0\0\0", 6));
    for (const char* name : {"head.nrrd", "head.nii"}) {
        const test::CommandResult volume = run({"explain", name});
        EXPECT_EQ(volume.exit, 3);
        EXPECT_THAT(volume.err,
                    HasSubstr("is data, and no scene; make a scene of it: palpate new"));
    }
}

TEST_F(CommandMessages, AMisspeltCommandOrOptionIsToldTheNearest) {
    expect_usage({"tarce", "ball.toml"}, "unknown command \"tarce\"; did you mean \"trace\"?");
    expect_usage({"veiw", "ball.toml"}, "did you mean \"view\"?");
    expect_usage({"xyz"}, "commands: info, devices");
    expect_usage({"trace", "ball.toml", "--methd", "single"},
                 "unknown option \"--methd\"; did you mean \"--method\"?");
    expect_usage({"trace", "ball.toml", "--sub-stebs=4"}, "did you mean \"--sub-steps\"?");
    expect_usage({"trace", "--otu", "x"}, "did you mean \"--out\"?");
    expect_usage({"trace", "ball.toml", "--seconds", "nan"}, "palpate: --seconds: nan is not in [");
    expect_usage({"trace", "ball.toml", "--frames", "0"}, "palpate: --frames: ");
    expect_usage({"trace", "ball.toml", "--frames", "0100"}, "0100 has a zero in front");
    expect_usage({"trace", "ball.toml", "--sub-steps", "0x10"}, "0x10 is no whole number");
    expect_usage({"trace", "ball.toml", "--frames", "99999999999999999999"}, "is not in [1, ");
    expect_usage({"extract", "a.nrrd", "-o", "a.ply", "--iso", "1", "--facet-size", "60"},
                 "--facet-size: 60 is not in [0.01, 50]");
    expect_usage({"study", "ball.toml", "--sweep", "sped"}, "palpate: --sweep: sped not in {all,");
    expect_usage({"study", "ball.toml", "--voxel-mm", "0"}, "--voxel-mm: 0 is not in [0.05, 20]");
    expect_usage({"study", "ball.toml", "--repeat", "0"}, "palpate: --repeat: ");
    EXPECT_EQ(run({"trace", "--help"}).exit, 0);
    EXPECT_EQ(run({"--version"}).exit, 0);
}

TEST_F(CommandMessages, OptionsThatWouldChangeNothingAreRefused) {
    expect_usage({"trace", "ball.toml", "--sub-steps", "8"}, "add --method fixed");
    expect_usage({"trace", "ball.toml", "--tolerance-um", "1", "--method", "paper"},
                 "--tolerance-um: is of method adaptive");
    expect_usage({"trace", "ball.toml", "--budget-us", "100"}, "--budget-us: is of method paper");
    expect_usage({"trace", "ball.toml", "--device", "hand", "--every", "2"}, "--every: takes each");
    expect_usage({"info", "probe.csv", "--mesh-unit", "mm"}, "--mesh-unit: is for a mesh");
    expect_usage({"info", "ball.toml", "--series", "1"}, "--series: is for a volume");
    expect_usage({"extract", "a.nrrd", "-o", "a.ply", "--iso", "1", "--method", "preview",
                  "--facet-size", "1"},
                 "--facet-size: is of --method cgal");
    expect_usage(
        {"extract", "a.nrrd", "-o", "a.ply", "--iso", "1", "--iso-after-smoothing", "as_given"},
        "--iso-after-smoothing: goes with --smooth-voxels");
    expect_usage({"study", "ball.toml", "--quick", "--frames", "5", "--repeat", "2"},
                 "--quick: --frames and --repeat say all");
    make("mesh.obj", "v 0.019 -1 -1\nv 0.019 1 -1\nv 0.019 0 1\nf 1 2 3\n");
    make("mesh.toml", "[surface.s]\nmesh = \"mesh.obj\"\nmesh_unit = \"m\"\n"
                      "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n");
    expect_usage({"study", "mesh.toml", "--voxel-mm", "0.3"}, "--voxel-mm: is of formulas");
    expect_usage({"replay", "t", "--check", "--force"}, "--force: is of the files in --out");
    expect_usage({"devices", "--udev-rules", "--inverse-service", "nonsense"}, "--udev-rules");
    expect_usage({"devices", "--udev-rules", "--plugin", "none.so"}, "--udev-rules");
    for (const std::string option : {"--frames", "--limit-s", "--scene", "--path"})
        expect_usage({"validate", "driver", "hand", "--list", option, "7"}, "--list");
    expect_usage({"validate", "driver", "hand", "--list", "--forces"}, "--list");
    expect_usage({"view", "ball.toml", "--sub-steps", "0-9"},
                 "--sub-steps: ball.toml is a scene; leave it out");
    for (const std::string option : {"--port", "--device", "--listen", "--seconds", "--cpu"})
        expect_usage({"view", "run.h5", option, "1"},
                     option + ": run.h5 is a recording, which is played by a page");
    expect_usage({"view", "run.h5", "--png", "p.png", "--open"},
                 "--open: run.h5 is a recording, of which pictures are asked for");
    expect_usage({"view", ".", "--device", "hand"}, "--device: . is neither a scene nor");
    expect_usage({"info", "ball.toml", "--force"}, "--force: nothing is written without --picture");
    expect_usage({"serve", "ball.toml", "--force"}, "--force: nothing is written without --out");
    expect_usage({"view", "ball.toml", "--force"}, "--force: a scene's recordings take free names");
    EXPECT_EQ(run({"trace", "ball.toml", "--method", "fixed", "--sub-steps", "8"}).exit, 0);
    EXPECT_EQ(run({"trace", "ball.toml", "--every", "2"}).exit, 0);
}

// The page had no sub-steps, and nobody was told.
TEST_F(CommandMessages, SubStepsOfFramesThatARecordingHasNotAreToldWithThoseItHas) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    expect_usage({"view", "t", "--sub-steps", "200-210", "-o", "v.html"},
                 "--sub-steps 200-210: the recording has none of them; its frames are 0-199");
    EXPECT_FALSE(std::filesystem::exists(*this / "v.html"));
    EXPECT_EQ(run({"view", "t", "--sub-steps", "190-210", "-o", "v.html"}).exit, 0);
}

// A page told of it when its first recording was lost.
TEST_F(CommandMessages, AViewWhoseRecordingsHaveNowhereToGoIsRefused) {
    for (const char* folder : {"ball.toml", "ball.toml/here", "/dev/null/here"}) {
        const test::CommandResult result = run({"view", "ball.toml", "-o", folder});
        EXPECT_EQ(result.exit, 3) << result.err;
        EXPECT_THAT(result.err, HasSubstr("is no folder; name a folder for recordings with -o"));
    }
}

// The page's mouse began in front of a surface, and there was none.
TEST_F(CommandMessages, AViewOfASceneWithoutASurfaceHasAHand) {
    make("guide.toml", "[[effect]]\ntype = \"guide\"\npoints_mm = [[0, 0, 0], [10, 0, 0]]\n"
                       "strength_n = 2\n");
    const test::CommandResult result = run({"view", "guide.toml", "--seconds", "0.1"});
    EXPECT_EQ(result.exit, 0) << result.err;
}

// Of a variable that nobody has set, an option had the next one for its value, and made a folder of
// that name.
TEST_F(CommandMessages, AnOptionWithoutItsValueIsToldAndTakesNoOther) {
    expect_usage({"trace", "ball.toml", "--out=", "--force"}, "--out=: is followed by nothing");
    expect_usage({"trace", "ball.toml", "--out", "--force"}, "--out: is followed by --force");
    expect_usage({"trace", "ball.toml", "--out=--events"}, "--out: is followed by --events");
    EXPECT_FALSE(std::filesystem::exists(*this / "--force"));
    EXPECT_EQ(run({"trace", "ball.toml", "--out=--other"}).exit, 0) << "no option is called so";
}

TEST_F(CommandMessages, SecondsAreAsManyFramesAsTheyHave) {
    make("steady.toml", test::ball_scene() + "[loop]\nrate_hz = 5000\n");
    std::string path = "t_s,x_m,y_m,z_m\n";
    for (int i = 0; i < 400; ++i)
        path += fmt::format("{:.17g},0.022,0,0\n", 2e-4 * i);
    make("probe.csv", path);
    // 0.07 * 5000 is a hair more than 350.
    ASSERT_EQ(run({"trace", "steady.toml", "--seconds", "0.07", "--out", "t"}).exit, 0);
    const std::string frames = test::content_of(*this / "t/frames.csv");
    EXPECT_EQ(std::count(frames.begin(), frames.end(), '\n'), 351);
}

// A path in millimetres, or in RAS, gave exit 0 and no contact, without a word.
TEST_F(CommandMessages, APathThatTouchesNothingIsToldWhereItIsAndWhereItWouldBe) {
    make("probe.csv", test::pressing_path(1e3));
    const test::CommandResult result = run({"trace", "ball.toml", "--out", "t"});
    EXPECT_EQ(result.exit, 0) << result.err;
    EXPECT_EQ(result.times("nothing is touched"), 1u) << result.err;
    EXPECT_THAT(result.err, HasSubstr("the probe is within 1.802e+04 0 0 to 2.2e+04 0 0 mm"));
    EXPECT_THAT(result.err, HasSubstr("the nearest 1.8e+04 mm away"));
    EXPECT_THAT(result.err, HasSubstr("in millimetres it would be "));
    make("probe.csv", test::pressing_path());
    EXPECT_EQ(run({"trace", "ball.toml", "--out", "t"}).times("nothing is touched"), 0u);
}

TEST_F(CommandMessages, AnInterruptedTraceSaysWhatWasThrownAway) {
    make("long.toml", "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\n"
                      "volume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
                      "[device]\ntype = \"orbit\"\nduration_s = 600\n[loop]\nmethod = \"paper\"\n");
    const pid_t child = start({"trace", "long.toml", "--out", "t"});
    for (int i = 0; i < 6000 && !std::filesystem::exists(*this / "t"); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10)); // until it has begun
    std::this_thread::sleep_for(std::chrono::milliseconds(500));    // of 540 s
    ::kill(child, SIGINT);
    const test::CommandResult result = end(child);
    EXPECT_EQ(result.signal, SIGINT) << result.err;
    EXPECT_EQ(result.times("thrown away"), 1u) << result.err;
    EXPECT_FALSE(std::filesystem::exists(*this / "t")) << "an empty folder is not left behind";
}

// To open a pipe would wait for whoever writes to it; nobody does here.
TEST_F(CommandMessages, APipeIsRefusedAndNotWaitedFor) {
    for (const char* name :
         {"p.toml", "p.csv", "p.h5", "p.ply", "p.nrrd", "p.nii.gz", "p.mhd", "p.dcm", "p"}) {
        SCOPED_TRACE(name);
        ASSERT_EQ(mkfifo((*this / name).c_str(), 0600), 0);
        const std::string file = name;
        const std::vector<std::string> arguments =
            file == "p.csv"
                ? std::vector<std::string>{"trace", "ball.toml", "--device", "path:" + file}
                : std::vector<std::string>{"info", file};
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, 3) << result.err;
        EXPECT_THAT(result.err, HasSubstr(file + ": is a named pipe"));
    }
    EXPECT_EQ(run({"extract", "p.nrrd", "--iso", "1", "-o", "m.ply"}).exit, 3);
}

// /dev/zero was read without end.
TEST_F(CommandMessages, ADeviceIsNoFile) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"trace", "/dev/zero"},
          std::vector<std::string>{"info", "/dev/zero"},
          std::vector<std::string>{"trace", "ball.toml", "--device", "path:/dev/zero"}}) {
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, 3) << result.err;
        EXPECT_THAT(result.err, HasSubstr("/dev/zero: is a device and no file; name a file"));
    }
}

TEST_F(CommandMessages, AnOrbitThatMeetsNothingNamesTheSceneAndItsLine) {
    make("wall.toml", "[volume.v]\nanalytic = \"slab\"\nthickness_mm = 1e-6\n"
                      "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\n"
                      "surface = \"s\"\n[device]\ntype = \"orbit\"\n");
    const test::CommandResult result = run({"trace", "wall.toml"});
    EXPECT_EQ(result.exit, 3) << result.err;
    EXPECT_THAT(result.err, HasSubstr("wall.toml:9: [device]: surface s: orbit: "));
}

// The parser called itself for each part of a key until the process ended with a signal.
TEST_F(CommandMessages, ADeepKeyIsBadInputAndNoCrash) {
    std::string key = "a";
    for (int i = 1; i < 40000; ++i)
        key += ".a";
    make("deep.toml", "# a comment.with.dots\n" + key + " = 1\n");
    const test::CommandResult result = run({"explain", "deep.toml"});
    EXPECT_EQ(result.exit, 3) << result.signal;
    EXPECT_THAT(result.err, HasSubstr("deep.toml:2: a key of more than 16 parts"));
}

// The times that a message told were refused, and so were those of a clock that began long ago.
TEST_F(CommandMessages, TheTimesThatARecordingIsSaidToHaveAreTaken) {
    make("thirds.toml", test::ball_scene() + "[loop]\nrate_hz = 300\n");
    std::string path = "t_s,x_m,y_m,z_m\n";
    for (int i = 0; i < 201; ++i)
        path += fmt::format("{:.17g},0.022,0,0\n", i / 300.0);
    make("probe.csv", path);
    ASSERT_EQ(run({"trace", "thirds.toml", "--out", "t"}).exit, 0);
    const test::CommandResult beyond = run({"view", "t", "--png", "p", "--to", "1"});
    EXPECT_EQ(beyond.exit, 2) << beyond.err;
    const std::string words = "the recording goes from 0 to ";
    const std::size_t at = beyond.err.find(words);
    ASSERT_NE(at, std::string::npos) << beyond.err;
    const std::size_t begin = at + words.size();
    const std::string end = beyond.err.substr(begin, beyond.err.find(" s;", begin) - begin);
    ::setenv("PALPATE_BROWSER", "/nonexistent/browser", 1);
    const test::CommandResult taken = run({"view", "t", "--png", "p", "--to", end});
    ::unsetenv("PALPATE_BROWSER");
    EXPECT_EQ(taken.exit, 3) << taken.err;
    EXPECT_THAT(taken.err, HasSubstr("/nonexistent/browser: is no program"));
    EXPECT_EQ(run({"view", "none.h5", "--png", "p", "--from", "2000000"}).exit, 3)
        << "the file is missing; the time is none of the parser's business";
}

} // namespace
} // namespace palpate
