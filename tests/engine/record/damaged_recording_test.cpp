// SPDX-License-Identifier: Apache-2.0
// Recordings that somebody or something has changed, and those of other versions of the format.
#include <algorithm>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <palpate/engine/record/recording.h>

#include "tests/engine/record/recording_file.h"

namespace palpate {
namespace {

using test::change;
using test::message_of;
using test::random_recording;
using test::RecordingFile;
using test::same_bits;
using test::seal;
using testing::HasSubstr;

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

// Programs before it did not write the scale of a device, and their loops took it for 1.
TEST_F(RecordingFile, ADeviceWithoutAScaleHasTheScaleOne) {
    Recording expected = random_recording(20, 16);
    write_recording(file(), expected);
    change(file(), [](hid_t h5) { EXPECT_GE(H5Ldelete(h5, "device/scale", H5P_DEFAULT), 0); });
    expected.device.scale = 1.0;
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

} // namespace
} // namespace palpate
