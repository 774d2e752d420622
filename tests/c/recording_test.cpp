// SPDX-License-Identifier: Apache-2.0
// What a loop of C kept is a recording as any other: its frames come out again to the last bit.
#include <palpate/palpate_c.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/record/recorded_run.h>

#include "tests/c/c_data.h"
#include "tests/support/memory_scenes.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using test::sized;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kBall = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 10\n"
                          "[surface.ball]\nvolume = \"v\"\n"
                          "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";
const std::string kVoxelBall = "[volume.ct]\n[surface.ball]\nvolume = \"ct\"\niso_value = 500\n"
                               "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

palpate_loop_options keeping(std::uint64_t frames) {
    auto options = sized<palpate_loop_options>();
    options.recorded_frames = frames;
    return options;
}

class RecordingInC : public testing::Test {
protected:
    /// Frames of the hand around the ball.
    static void run(const test::LoopPtr& loop) {
        for (const DeviceState& hand : test::around_ball())
            test::frame_of(loop.get(), test::probe_of(hand));
    }

    void write(const test::LoopPtr& loop) const {
        palpate_error error = test::no_error();
        ASSERT_EQ(palpate_loop_write_recording(loop.get(), file_.c_str(), &error), PALPATE_OK)
            << error.message;
    }

    palpate_check checked(const test::ScenePtr& scene) const {
        palpate_error error = test::no_error();
        auto check = sized<palpate_check>();
        EXPECT_EQ(palpate_recording_check(file_.c_str(), scene.get(), &check, &error), PALPATE_OK)
            << error.message;
        return check;
    }

    void expect_the_same_again(const test::ScenePtr& scene, std::uint64_t frames) const {
        const palpate_check check = checked(scene);
        EXPECT_EQ(check.frames, frames);
        EXPECT_EQ(check.different, 0u) << "first: " << check.first_different;
    }

    std::string refusal(const test::ScenePtr& scene) const {
        palpate_error error = test::no_error();
        auto check = sized<palpate_check>();
        EXPECT_EQ(palpate_recording_check(file_.c_str(), scene.get(), &check, &error),
                  PALPATE_BAD_INPUT);
        return error.message;
    }

    test::TemporaryFolder folder_;
    std::filesystem::path file_ = folder_ / "recording.h5";
};

test::ScenePtr voxel_ball(float more = 0.0F) {
    VoxelVolume voxels = test::ball_voxels();
    voxels.values[voxels.index(15, 15, 15)] += more;
    const palpate_voxels given = test::in_c(voxels);
    const test::DataPtr data = test::no_data();
    EXPECT_EQ(palpate_data_add_voxels(data.get(), "ct", &given, nullptr), PALPATE_OK);
    return test::parsed(kVoxelBall, data);
}

TEST_F(RecordingInC, OfDataInMemoryIsTheSameAgainAndRefusesOtherData) {
    const test::ScenePtr scene = voxel_ball();
    const palpate_loop_options options = keeping(1000);
    const test::LoopPtr loop = test::made(scene, &options);
    EXPECT_EQ(palpate_loop_recorded_frames(loop.get()), 0u);
    run(loop);
    EXPECT_EQ(palpate_loop_recorded_frames(loop.get()), 400u);
    write(loop);
    expect_the_same_again(scene, 400);
    expect_the_same_again(voxel_ball(), 400); // elsewhere in memory
    const std::string message = refusal(voxel_ball(0.5F));
    EXPECT_THAT(message, StartsWith(file_.string() + ": volumes[\"ct\"].voxels, 30 x 30 x 30 is "
                                                     "not what it was"));
    EXPECT_THAT(message, HasSubstr("SHA-256"));
}

TEST_F(RecordingInC, OfATextIsReadByTheCppInterface) {
    for (const palpate_method method : {PALPATE_METHOD_OF_SCENE, PALPATE_SINGLE, PALPATE_PAPER}) {
        const test::ScenePtr scene = test::parsed(kBall);
        palpate_loop_options options = keeping(400);
        options.method = method;
        options.tolerance_um = method == PALPATE_METHOD_OF_SCENE ? 0.5 : 0.0;
        const test::LoopPtr loop = test::made(scene, &options);
        run(loop);
        std::filesystem::remove(file_);
        write(loop);
        expect_the_same_again(scene, 400);
        const Recording recording = read_recording(file_);
        EXPECT_EQ(recording.steps_left.empty(), method != PALPATE_PAPER);
        EXPECT_GT(recording.touches.size(), 200u);
        const Trace again =
            run_again(recorded_scene(recording, file_, SceneResources{}), recording);
        EXPECT_EQ(difference(recording, again).frames, 0u);
    }
}

// A loop's options are in the ranges of a scene: whoever reads the recording takes them, too.
TEST_F(RecordingInC, OptionsAtTheEndOfTheirRangeAreReadAgain) {
    const test::ScenePtr scene = test::parsed(kBall);
    for (const bool is_paper : {false, true}) {
        palpate_loop_options options = keeping(400);
        if (is_paper) {
            options.method = PALPATE_PAPER;
            options.budget_us = 1e-4;
        } else {
            options.tolerance_um = 1e-7;
        }
        const test::LoopPtr loop = test::made(scene, &options);
        run(loop);
        std::filesystem::remove(file_);
        write(loop);
        expect_the_same_again(scene, 400);
        const Recording recording = read_recording(file_);
        EXPECT_NO_THROW(recorded_scene(recording, file_, SceneResources{}));
    }
}

TEST_F(RecordingInC, OfADeviceWithMotorsIsTheSameAgain) {
    const test::ScenePtr scene = test::parsed(kBall);
    auto device = sized<palpate_device>();
    device.force_n = 0.8;
    device.damping_n_s_per_m = 0.1;
    device.scale = 4.0;
    palpate_loop_options options = keeping(400);
    options.device = &device;
    const test::LoopPtr loop = test::made(scene, &options);
    run(loop);
    write(loop);
    EXPECT_EQ(read_recording(file_).device.scale, 4.0);
    expect_the_same_again(scene, 400);
}

TEST_F(RecordingInC, OfSeveralHandsAllAreCounted) {
    const test::ScenePtr scene =
        test::parsed(kBall + "[[device]]\nname = \"left\"\ntype = \"orbit\"\n"
                             "[[device]]\nname = \"right\"\ntype = \"orbit\"\n");
    const palpate_loop_options options = keeping(400);
    std::vector<Recording> hands;
    for (const char* hand : {"left", "right"}) {
        const test::LoopPtr loop = test::made(scene, &options);
        run(loop);
        std::filesystem::remove(file_);
        write(loop);
        hands.push_back(read_recording(file_));
        hands.back().hand = hand;
    }
    write_recordings(file_, hands);
    expect_the_same_again(scene, 800);
    hands[1].frames[7].proxy.x += 1e-9;
    write_recordings(file_, hands);
    const palpate_check check = checked(scene);
    EXPECT_EQ(check.different, 1u);
    EXPECT_EQ(check.first_different, 407u);
}

TEST_F(RecordingInC, AnotherSceneGivesOtherFramesAndSaysWhichIsTheFirst) {
    const palpate_loop_options options = keeping(400);
    const test::LoopPtr loop = test::made(test::parsed(kBall), &options);
    run(loop);
    write(loop);
    const palpate_check check =
        checked(test::parsed(kBall + "[coupling]\nstiffness_n_per_m = 499\n"));
    EXPECT_GT(check.different, 200u);
    EXPECT_GT(check.first_different, 0u) << "the first frames are in free space";
    EXPECT_LT(check.first_different, 100u);
}

TEST_F(RecordingInC, EndsWhenItIsFullAndWhereFramesDoNotFollow) {
    const test::ScenePtr scene = test::parsed(kBall);
    const palpate_loop_options options = keeping(150);
    const test::LoopPtr full = test::made(scene, &options);
    run(full);
    EXPECT_EQ(palpate_loop_recorded_frames(full.get()), 150u);
    write(full);
    expect_the_same_again(scene, 150);

    const test::LoopPtr released = test::made(scene, &options);
    const auto hands = test::around_ball();
    for (int i = 0; i < 60; ++i)
        test::frame_of(released.get(), test::probe_of(hands[static_cast<std::size_t>(i)]));
    palpate_state* saved = nullptr;
    ASSERT_EQ(palpate_loop_save(released.get(), &saved, nullptr), PALPATE_OK);
    const test::StatePtr state(saved);
    double force_n[3];
    ASSERT_EQ(palpate_loop_release(released.get(), force_n), PALPATE_OK);
    run(released);
    EXPECT_EQ(palpate_loop_recorded_frames(released.get()), 60u);
    write(released);
    expect_the_same_again(scene, 60);

    const test::LoopPtr restored = test::made(scene, &options);
    test::frame_of(restored.get(), test::probe_of(hands[0]));
    ASSERT_EQ(palpate_loop_restore(restored.get(), state.get(), nullptr), PALPATE_OK);
    run(restored);
    EXPECT_EQ(palpate_loop_recorded_frames(restored.get()), 1u);
}

TEST_F(RecordingInC, WithAChangedGainSaysThatItCannotBeComputedAgain) {
    const test::ScenePtr scene = test::parsed(kBall);
    const palpate_loop_options options = keeping(400);
    const test::LoopPtr loop = test::made(scene, &options);
    ASSERT_EQ(palpate_loop_set_gain(loop.get(), 0, 0.5), PALPATE_OK);
    run(loop);
    write(loop);
    EXPECT_THAT(refusal(scene), HasSubstr("gain was changed"));
}

TEST_F(RecordingInC, KeepsFramesAsTheyAreWithoutIt) {
    const test::ScenePtr scene = test::parsed(kBall);
    const palpate_loop_options options = keeping(400);
    const test::LoopPtr kept = test::made(scene, &options), plain = test::made(scene);
    for (const DeviceState& hand : test::around_ball()) {
        const palpate_frame a = test::frame_of(kept.get(), test::probe_of(hand));
        const palpate_frame b = test::frame_of(plain.get(), test::probe_of(hand));
        ASSERT_EQ(test::vec(a.proxy_m), test::vec(b.proxy_m));
        ASSERT_EQ(test::vec(a.force_n), test::vec(b.force_n));
        ASSERT_EQ(a.field_samples, b.field_samples);
    }
}

TEST_F(RecordingInC, BadCallsSayWhatTheyAre) {
    const test::ScenePtr scene = test::parsed(kBall);
    palpate_loop* none = nullptr;
    palpate_error error = test::no_error();
    const auto refused = [&](const palpate_loop_options& options) {
        EXPECT_EQ(palpate_loop_make(scene.get(), &options, &none, &error), PALPATE_BAD_CALL);
        EXPECT_EQ(none, nullptr);
        return std::string(error.message);
    };
    palpate_loop_options options = keeping(std::uint64_t{1} << 62);
    EXPECT_THAT(refused(options), HasSubstr("recorded_frames = 4611686018427387904 is out of"));
    options = keeping(10);
    options.rate_hz = 500.0;
    EXPECT_THAT(refused(options), HasSubstr("rate_hz or evaluation_cap"));
    options = keeping(10);
    options.evaluation_cap = 4;
    EXPECT_THAT(refused(options), HasSubstr("rate_hz or evaluation_cap"));

    options = keeping(10);
    const test::LoopPtr loop = test::made(scene, &options), plain = test::made(scene);
    const auto unwritten = [&](const palpate_loop* of, const char* file) {
        const palpate_code code = palpate_loop_write_recording(of, file, &error);
        EXPECT_NE(code, PALPATE_OK);
        EXPECT_FALSE(std::filesystem::exists(file_));
        return std::string(error.message);
    };
    EXPECT_THAT(unwritten(nullptr, file_.c_str()), HasSubstr("NULL"));
    EXPECT_THAT(unwritten(loop.get(), nullptr), HasSubstr("NULL"));
    EXPECT_THAT(unwritten(plain.get(), file_.c_str()), HasSubstr("recorded_frames"));
    EXPECT_THAT(unwritten(loop.get(), file_.c_str()), HasSubstr("no frame is kept"));
    run(loop);
    const std::filesystem::path foreign = folder_ / "thesis.txt";
    test::make_file(foreign, "three years of work\n");
    EXPECT_THAT(unwritten(loop.get(), foreign.c_str()), HasSubstr("thesis.txt"));
    EXPECT_EQ(test::content_of(foreign), "three years of work\n");
    EXPECT_THAT(unwritten(loop.get(), (folder_ / "none" / "r.h5").c_str()), HasSubstr("none"));

    auto check = sized<palpate_check>();
    EXPECT_EQ(palpate_recording_check(nullptr, scene.get(), &check, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_recording_check(file_.c_str(), nullptr, &check, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_recording_check(file_.c_str(), scene.get(), nullptr, &error),
              PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_recording_check(file_.c_str(), scene.get(), &check, &error),
              PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr("recording.h5"));
    EXPECT_EQ(palpate_recording_check(foreign.c_str(), scene.get(), &check, &error),
              PALPATE_BAD_INPUT);
    --check.size;
    EXPECT_EQ(palpate_recording_check(file_.c_str(), scene.get(), &check, &error),
              PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_recorded_frames(nullptr), 0u);
    EXPECT_EQ(palpate_loop_recorded_frames(plain.get()), 0u);
}

} // namespace
} // namespace palpate
