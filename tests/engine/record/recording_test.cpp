// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recording.h>

#include <array>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording_journal.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/engine/record/recording_file.h"
#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

using test::message_of;
using test::random_recording;
using test::RecordingFile;
using test::same_bits;
using test::seal;
using testing::HasSubstr;

TEST_F(RecordingFile, GivesEveryBitBack) {
    // More rows than a chunk has, so that the last chunk is a part of one.
    constexpr std::size_t kFrames = 20000;
    constexpr std::uint64_t kSeed = 11;
    SCOPED_TRACE(kSeed);
    const Recording recording = random_recording(kFrames, kSeed);
    write_recording(file(), recording);
    EXPECT_TRUE(same_bits(read_recording(file()), recording));
    EXPECT_EQ(test::files_in(folder()), 1u);
}

// Where nothing soft was pressed, a recording is one that older programs read.
TEST_F(RecordingFile, HasColumnsOfSoftnessWhereASoftSurfaceWasPressed) {
    Recording recording = random_recording(50, 12);
    const auto version = [&] {
        const hid_t h5 = H5Fopen(file().c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
        const hid_t set = H5Dopen2(h5, "format_version", H5P_DEFAULT);
        std::uint64_t read = 0;
        H5Dread(set, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &read);
        H5Dclose(set);
        H5Fclose(h5);
        return read;
    };
    write_recording(file(), recording);
    EXPECT_EQ(version(), 4u);
    for (std::size_t i = 20; i < 30; ++i) {
        recording.frames[i].indentation_m = 1e-3 * static_cast<double>(i);
        recording.frames[i].stiffness_n_per_m = 200.0;
        recording.frames[i].front = {0.1, 0.2, 0.3 * static_cast<double>(i)};
    }
    write_recording(file(), recording);
    EXPECT_EQ(version(), 5u);
    const Recording read = read_recording(file());
    EXPECT_TRUE(same_bits(read, recording));
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
        EXPECT_TRUE(same_bits(read.frames[i].indentation_m, recording.frames[i].indentation_m));
        EXPECT_TRUE(
            same_bits(read.frames[i].stiffness_n_per_m, recording.frames[i].stiffness_n_per_m));
        EXPECT_TRUE(same_bits(read.frames[i].front, recording.frames[i].front));
    }
}

TEST_F(RecordingFile, AJournalOfARunThatWasCutOffHasAllThatWasKept) {
    const Recording whole = random_recording(30, 16);
    Recording before = whole;
    before.inputs.clear();
    before.frames.clear();
    before.steps_left.clear();
    before.touches.clear();
    RecordingJournal journal(file(), before);
    Trace so_far;
    so_far.device = whole.device;
    for (const double share : {0.3, 0.3, 0.8, 1.0}) { // once with nothing new
        const auto take = [share](auto& to, const auto& from) {
            to.assign(from.begin(),
                      from.begin() + static_cast<std::ptrdiff_t>(share * double(from.size())));
        };
        take(so_far.inputs, whole.inputs);
        take(so_far.frames, whole.frames);
        take(so_far.steps_left, whole.steps_left);
        take(so_far.touches, whole.touches);
        ASSERT_TRUE(journal.add(so_far));
    }
    ASSERT_GT(whole.touches.size(), 10u);
    EXPECT_TRUE(same_bits(read_recording(file()), whole));
}

// As good as hard: it is not pressed in, so the file has no columns of what was.
TEST_F(RecordingFile, ATissueAsStiffAsTheCouplingComesBackTheSame) {
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\n"
                    "volume = \"v\"\nstiffness_n_per_mm = 2.0\n[[effect]]\ntype = \"surface\"\n"
                    "surface = \"s\"\n",
                    "ball.toml"));
    std::vector<DeviceState> inputs(100);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        inputs[i].time_s = 1e-3 * static_cast<double>(i);
        inputs[i].position = {51e-3 - 3e-5 * static_cast<double>(i), 0.0, 0.0};
    }
    test::ScriptedClock clock;
    const Trace trace = run_trace(scene, inputs, clock);
    EXPECT_GT(glm::length(trace.frames.back().force), 0.5);
    write_recording(file(), recorded(*scene, {}, trace));
    const Recording read = read_recording(file());
    const Trace again = run_again(recorded_scene(read, "r.h5", {}), read);
    EXPECT_EQ(difference(read, again).frames, 0u);
}

TEST_F(RecordingFile, EmptyRecordingComesBackEmpty) {
    write_recording(file(), Recording{});
    EXPECT_TRUE(same_bits(read_recording(file()), Recording{}));
}

TEST_F(RecordingFile, SameRecordingGivesTheSameBytes) {
    const Recording recording = random_recording(50, 1);
    write_recording(file(), recording);
    const std::string first = test::content_of(file());
    write_recording(file(), recording);
    EXPECT_EQ(test::content_of(file()), first);
}

TEST_F(RecordingFile, OtherProgramsFindColumnsWithTheirUnits) {
    write_recording(file(), random_recording(10, 2));
    const hid_t h5 = H5Fopen(file().c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    ASSERT_GE(h5, 0);
    const hid_t set = H5Dopen2(h5, "/frames/force_n", H5P_DEFAULT);
    ASSERT_GE(set, 0);
    const hid_t space = H5Dget_space(set);
    hsize_t size[2] = {0, 0};
    EXPECT_EQ(H5Sget_simple_extent_ndims(space), 2);
    H5Sget_simple_extent_dims(space, size, nullptr);
    EXPECT_EQ(size[0], 10u);
    EXPECT_EQ(size[1], 3u);
    const hid_t unit = H5Aopen(set, "unit", H5P_DEFAULT);
    const hid_t type = H5Aget_type(unit);
    std::string text(H5Tget_size(type), '?');
    EXPECT_GE(H5Aread(unit, type, text.data()), 0);
    EXPECT_EQ(text, "N");
    H5Tclose(type);
    H5Aclose(unit);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(h5);
}

TEST_F(RecordingFile, NothingIsLeftWhereItCannotBeWritten) {
    const std::filesystem::path missing = folder() / "missing" / "recording.h5";
    message_of(missing, [&] { write_recording(missing, random_recording(5, 8)); });
    EXPECT_EQ(test::files_in(folder()), 0u);
}

// HDF5 takes two files in memory of one name for one.
TEST_F(RecordingFile, TwoThatAreReadAtOnceAreTwo) {
    const std::array<Recording, 2> recordings{random_recording(300, 17), random_recording(500, 18)};
    const auto file_of = [this](std::size_t i) { return folder() / (i == 0 ? "a.h5" : "b.h5"); };
    for (std::size_t i = 0; i < 2; ++i)
        write_recording(file_of(i), recordings[i]);
    std::array<int, 2> different{};
    std::array<std::thread, 2> threads;
    for (std::size_t i = 0; i < 2; ++i)
        threads[i] = std::thread([&, i] {
            for (int turn = 0; turn < 100; ++turn)
                if (!same_bits(read_recording(file_of(i)), recordings[i])) ++different[i];
        });
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(different, (std::array<int, 2>{}));
}

TEST_F(RecordingFile, Hdf5StaysSilentAndItsSettingIsPutBack) {
    const auto print = [](hid_t, void*) -> herr_t { return 0; };
    H5E_auto2_t before = nullptr;
    void* data_before = nullptr;
    H5Eget_auto2(H5E_DEFAULT, &before, &data_before);
    const H5E_auto2_t mine = print;
    H5Eset_auto2(H5E_DEFAULT, mine, nullptr);

    testing::internal::CaptureStderr();
    test::make_file(file(), "\x89HDF\r\n\x1a\n and nothing else");
    seal(file());
    message_of(file(), [&] { read_recording(file()); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");

    H5E_auto2_t after = nullptr;
    void* data_after = nullptr;
    H5Eget_auto2(H5E_DEFAULT, &after, &data_after);
    EXPECT_EQ(after, mine);
    H5Eset_auto2(H5E_DEFAULT, before, data_before);
}

} // namespace
} // namespace palpate
