// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recording.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <palpate/engine/files/sha256.h>
#include <palpate/engine/record/recording_journal.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class RecordingFile : public testing::Test {
protected:
    std::filesystem::path file() const { return folder_.path() / "recording.h5"; }
    const std::filesystem::path& folder() const { return folder_.path(); }

private:
    test::TemporaryFolder folder_;
};

/// Every column has other bits in every row, NaN with payloads among them.
Recording random_recording(std::size_t frames, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto number = [&] { return std::bit_cast<double>(random()); };
    const auto vector = [&] { return Vec3(number(), number(), number()); };
    const auto count = [&] { return static_cast<std::uint32_t>(random()); };

    Recording recording;
    recording.version = "0.1.0";
    recording.scene_file = "/scenes/Schädel mit Leerzeichen.toml";
    recording.scene_text = "[volume.head]\nfile = \"skull.nhdr\" # \"quoted\"\n";
    recording.overrides = "";
    recording.steps_left = {3, 2, 1, 0};
    recording.device.name = "hand of \"somebody\"";
    recording.device.force_n = 7.5;
    recording.device.stiffness_n_per_m = 1234.5;
    recording.device.damping_n_s_per_m = 0.25;
    recording.device.position_step_m = 3e-5;
    recording.device.delay_s = 2e-3;
    recording.device.velocity_source = VelocitySource::device;
    recording.felt_names = {"bone", "Haut, \"dünn\"", "brain"};
    recording.sources = {{"/data/skull.nhdr", std::string(64, 'a')}, {"/d", std::string(64, '0')}};
    for (std::size_t i = 0; i < frames; ++i) {
        DeviceState input;
        input.time_s = number();
        input.position = vector();
        input.velocity = vector();
        input.trial = count();
        input.buttons = count();
        input.freshness = random() % 2 == 0 ? Freshness::fresh : Freshness::stale;
        input.orientation = {number(), number(), number(), number()};
        recording.inputs.push_back(input);

        FrameReport f;
        f.frame = random();
        f.trial = count();
        f.time_s = number();
        f.probe = vector();
        f.proxy = vector();
        f.force = vector();
        f.sub_steps = count();
        f.evaluations = count();
        f.contacts = count();
        f.residual_m = number();
        f.flags = count();
        f.field_samples = count();
        f.surface_queries = count();
        f.root_queries = count();
        f.spent_us = number();
        f.estimate_us = number();
        f.late_us = number();
        f.surfaces_felt = random();
        recording.frames.push_back(f);

        RecordedTouch touch;
        touch.frame = f.frame;
        touch.surface = count();
        touch.phase = static_cast<Touch::Phase>(random() % 3);
        touch.point = vector();
        touch.normal = vector();
        touch.force = vector();
        recording.touches.insert(recording.touches.end(), random() % 3, touch);
    }
    return recording;
}

bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool same_bits(const Vec3& a, const Vec3& b) {
    return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}
bool same_bits(const DeviceState& a, const DeviceState& b) {
    return same_bits(a.time_s, b.time_s) && same_bits(a.position, b.position) &&
           same_bits(a.velocity, b.velocity) && a.trial == b.trial && a.buttons == b.buttons &&
           a.freshness == b.freshness && same_bits(a.orientation.w, b.orientation.w) &&
           same_bits(a.orientation.x, b.orientation.x) &&
           same_bits(a.orientation.y, b.orientation.y) &&
           same_bits(a.orientation.z, b.orientation.z);
}
bool same_bits(const FrameReport& a, const FrameReport& b) {
    return a.frame == b.frame && a.trial == b.trial && same_bits(a.time_s, b.time_s) &&
           same_bits(a.probe, b.probe) && same_bits(a.proxy, b.proxy) &&
           same_bits(a.force, b.force) && a.sub_steps == b.sub_steps &&
           a.evaluations == b.evaluations && a.contacts == b.contacts &&
           same_bits(a.residual_m, b.residual_m) && a.flags == b.flags &&
           a.field_samples == b.field_samples && a.surface_queries == b.surface_queries &&
           a.root_queries == b.root_queries && same_bits(a.spent_us, b.spent_us) &&
           same_bits(a.estimate_us, b.estimate_us) && same_bits(a.late_us, b.late_us) &&
           a.surfaces_felt == b.surfaces_felt;
}
bool same_bits(const RecordedTouch& a, const RecordedTouch& b) {
    return a.frame == b.frame && a.surface == b.surface && a.phase == b.phase &&
           same_bits(a.point, b.point) && same_bits(a.normal, b.normal) &&
           same_bits(a.force, b.force);
}
template <typename Row>
bool same_bits(const std::vector<Row>& a, const std::vector<Row>& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (!same_bits(a[i], b[i])) return false;
    return true;
}
bool same_bits(const Recording& a, const Recording& b) {
    bool same = a.version == b.version && a.scene_file == b.scene_file &&
                a.scene_text == b.scene_text && a.overrides == b.overrides &&
                a.sources.size() == b.sources.size() && a.steps_left == b.steps_left &&
                a.felt_names == b.felt_names;
    for (std::size_t i = 0; same && i < a.sources.size(); ++i)
        same = a.sources[i].file == b.sources[i].file && a.sources[i].sha256 == b.sources[i].sha256;
    same = same && a.device.name == b.device.name && a.device.force_n == b.device.force_n &&
           a.device.stiffness_n_per_m == b.device.stiffness_n_per_m &&
           a.device.damping_n_s_per_m == b.device.damping_n_s_per_m &&
           a.device.position_step_m == b.device.position_step_m &&
           a.device.delay_s == b.device.delay_s &&
           a.device.velocity_source == b.device.velocity_source;
    return same && same_bits(a.inputs, b.inputs) && same_bits(a.frames, b.frames) &&
           same_bits(a.touches, b.touches);
}

/// The message of the error that `action` must throw; one line that begins with the file's name.
std::string message_of(const std::filesystem::path& file, const std::function<void()>& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.rfind(file.string() + ": ", 0), 0u) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return message;
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

/// Puts the hash behind an HDF5 file that read_recording() looks for.
void seal(const std::filesystem::path& file) {
    const std::string bytes = test::content_of(file);
    test::make_file(file, bytes + "\npalpate sha256 " + sha256_of_text(bytes) + "\n");
}

/// Changes a recording as somebody would who knows about the seal.
void change(const std::filesystem::path& file, const std::function<void(hid_t)>& action) {
    const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(h5, 0);
    action(h5);
    H5Fclose(h5);
    seal(file);
}

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

TEST_F(RecordingFile, FileCutShortIsRefusedWhereverItIsCut) {
    write_recording(file(), random_recording(30, 3));
    const std::string whole = test::content_of(file());
    const std::size_t step = whole.size() / 97 + 1;
    for (std::size_t size = 0; size < whole.size(); size += step) {
        SCOPED_TRACE(size);
        test::make_file(file(), whole.substr(0, size));
        message_of(file(), [&] { read_recording(file()); });
    }
}

TEST_F(RecordingFile, ChangedByteIsRefusedWhereverItIs) {
    write_recording(file(), random_recording(30, 4));
    const std::string whole = test::content_of(file());
    const std::size_t step = whole.size() / 211 + 1;
    // Both ends in full, where signature and seal are.
    for (std::size_t at = 0; at < whole.size();
         at +=
         at < 100 || at + 100 > whole.size() ? 1 : std::min(step, whole.size() - 100 - at + 1)) {
        SCOPED_TRACE(at);
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
        test::make_file(file(), damaged);
        message_of(file(), [&] { read_recording(file()); });
    }
}

TEST_F(RecordingFile, OtherFilesAreRefusedWithTheReason) {
    const auto message = [&] { return message_of(file(), [&] { read_recording(file()); }); };
    message(); // no such file
    test::make_file(file(), "frame,trial,time_s\n");
    EXPECT_THAT(message(), HasSubstr("not an HDF5 file"));
    H5Fclose(H5Fcreate(file().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
    EXPECT_THAT(message(), HasSubstr("not a recording"));
    seal(file());
    EXPECT_THAT(message(), HasSubstr("not a recording"));
}

TEST_F(RecordingFile, ChangeByAnotherProgramIsRefused) {
    write_recording(file(), random_recording(5, 5));
    const hid_t h5 = H5Fopen(file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(H5Ldelete(h5, "frames/proxy_m", H5P_DEFAULT), 0);
    H5Fclose(h5);
    message_of(file(), [&] { read_recording(file()); });
}

TEST_F(RecordingFile, MissingDataSetIsNamed) {
    write_recording(file(), random_recording(5, 5));
    change(file(), [](hid_t h5) { H5Ldelete(h5, "frames/proxy_m", H5P_DEFAULT); });
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }), HasSubstr("frames/proxy_m"));
}

TEST_F(RecordingFile, ColumnsOfDifferentLengthAreRefused) {
    write_recording(file(), random_recording(5, 6));
    change(file(), [](hid_t h5) {
        H5Ldelete(h5, "frames/flags", H5P_DEFAULT);
        const hsize_t rows = 4;
        const std::uint32_t values[4] = {1, 2, 3, 4};
        const hid_t space = H5Screate_simple(1, &rows, nullptr);
        const hid_t set = H5Dcreate2(h5, "frames/flags", H5T_STD_U32LE, space, H5P_DEFAULT,
                                     H5P_DEFAULT, H5P_DEFAULT);
        H5Dwrite(set, H5T_NATIVE_UINT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
        H5Dclose(set);
        H5Sclose(space);
    });
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }),
                HasSubstr("frames/flags has 4 rows"));
}

/// Puts another version into a file.
void set_version(hid_t h5, std::uint64_t version) {
    const hid_t set = H5Dopen2(h5, "format_version", H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &version);
    H5Dclose(set);
}

/// Takes from a file and from what is expected of it what the third version did not have.
void forget_touches(hid_t h5, Recording& expected) {
    EXPECT_GE(H5Ldelete(h5, "touches", H5P_DEFAULT), 0);
    expected.touches.clear();
}

/// The same of the second version.
void forget_what_is_felt(hid_t h5, Recording& expected) {
    forget_touches(h5, expected);
    for (const char* name : {"frames/surfaces_felt", "surfaces"})
        EXPECT_GE(H5Ldelete(h5, name, H5P_DEFAULT), 0);
    expected.felt_names.clear();
    for (FrameReport& frame : expected.frames)
        frame.surfaces_felt = 0;
}

TEST_F(RecordingFile, TheSecondVersionIsReadWithWhatItHas) {
    Recording expected = random_recording(20, 12);
    write_recording(file(), expected);
    change(file(), [&](hid_t h5) {
        forget_what_is_felt(h5, expected);
        set_version(h5, 2);
    });
    EXPECT_TRUE(same_bits(read_recording(file()), expected));
}

TEST_F(RecordingFile, TheThirdVersionIsReadWithWhatItHas) {
    Recording expected = random_recording(20, 14);
    write_recording(file(), expected);
    change(file(), [&](hid_t h5) {
        forget_touches(h5, expected);
        set_version(h5, 3);
    });
    EXPECT_TRUE(same_bits(read_recording(file()), expected));
}

TEST_F(RecordingFile, APhaseThatMeansNothingIsRefused) {
    Recording recording = random_recording(2, 15);
    recording.touches.assign(2, {});
    recording.touches[1].phase = static_cast<Touch::Phase>(3);
    write_recording(file(), recording);
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }),
                HasSubstr("row 1 of data set touches/phase means nothing"));
}

TEST_F(RecordingFile, MoreNamesThanBitsAreRefused) {
    Recording recording = random_recording(3, 13);
    recording.felt_names.assign(65, "a");
    write_recording(file(), recording);
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }),
                HasSubstr("surfaces/name has more names than bits"));
}

// The first version knew neither buttons, freshness and orientation nor the device.
TEST_F(RecordingFile, TheFirstVersionIsReadWithWhatItHas) {
    Recording expected = random_recording(20, 9);
    write_recording(file(), expected);
    change(file(), [&](hid_t h5) {
        for (const char* name :
             {"inputs/buttons", "inputs/freshness", "inputs/orientation_wxyz", "device"})
            EXPECT_GE(H5Ldelete(h5, name, H5P_DEFAULT), 0);
        forget_what_is_felt(h5, expected);
        set_version(h5, 1);
    });
    expected.device = {};
    for (DeviceState& input : expected.inputs) {
        const DeviceState fresh;
        input.buttons = fresh.buttons;
        input.freshness = fresh.freshness;
        input.orientation = fresh.orientation;
    }
    EXPECT_TRUE(same_bits(read_recording(file()), expected));
}

TEST_F(RecordingFile, AVersionToComeIsRefused) {
    write_recording(file(), random_recording(5, 10));
    change(file(), [](hid_t h5) { set_version(h5, 7); });
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }),
                HasSubstr("another version of the format than 1 to 6"));
}

TEST_F(RecordingFile, AFreshnessThatMeansNothingIsRefused) {
    write_recording(file(), random_recording(2, 11));
    change(file(), [](hid_t h5) {
        const hid_t set = H5Dopen2(h5, "inputs/freshness", H5P_DEFAULT);
        const std::uint32_t values[2] = {0, 2};
        H5Dwrite(set, H5T_NATIVE_UINT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
        H5Dclose(set);
    });
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }),
                HasSubstr("inputs/freshness has numbers that mean nothing"));
}

TEST_F(RecordingFile, DataSetThatClaimsMoreThanItStoresIsRefusedBeforeAllocating) {
    write_recording(file(), random_recording(5, 7));
    change(file(), [](hid_t h5) {
        H5Ldelete(h5, "inputs/time_s", H5P_DEFAULT);
        const hsize_t rows = hsize_t{1} << 36;
        const hsize_t chunk = 1024;
        const hid_t space = H5Screate_simple(1, &rows, nullptr);
        const hid_t plist = H5Pcreate(H5P_DATASET_CREATE);
        H5Pset_chunk(plist, 1, &chunk);
        H5Dclose(H5Dcreate2(h5, "inputs/time_s", H5T_IEEE_F64LE, space, H5P_DEFAULT, plist,
                            H5P_DEFAULT));
        H5Pclose(plist);
        H5Sclose(space);
    });
    EXPECT_THAT(message_of(file(), [&] { read_recording(file()); }),
                HasSubstr("inputs/time_s claims"));
}

TEST_F(RecordingFile, NothingIsLeftWhereItCannotBeWritten) {
    const std::filesystem::path missing = folder() / "missing" / "recording.h5";
    message_of(missing, [&] { write_recording(missing, random_recording(5, 8)); });
    EXPECT_EQ(test::files_in(folder()), 0u);
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
