// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_file.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include <palpate/volume/formats/internal/component_image.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::append;
using test::counting;
using test::distance;
using test::frame_mm;
using test::make_file;
using test::refusal;
using test::TemporaryFolder;

// Text headers hold 17 digits; what is left is rounding of positions below a metre.
constexpr double kSamePlace = 1e-15; // m

/// Header lines, of which a test may change or drop some.
struct Header {
    std::string geometry = "TransformMatrix = 0 1 0 0 0 -1 1 0 0\nOffset = -12.5 34.25 100\n"
                           "CenterOfRotation = 0 0 0\nElementSpacing = 0.5 0.75 2.5\n";
    std::string size = "DimSize = 4 3 2\n";
    std::string type = "ElementType = MET_SHORT\n";
    std::string more;
    std::string data = "LOCAL";

    std::string text() const {
        return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
               "False\n" +
               more + geometry + size + type + "ElementDataFile = " + data + "\n";
    }
};

const AffineTransform kFrame =
    frame_mm(Mat3(0, 0.5, 0, 0, 0, -0.75, 2.5, 0, 0), Vec3(-12.5, 34.25, 100.0));

std::vector<float> counted(int voxels) {
    std::vector<float> values;
    for (int n = 0; n < voxels; ++n)
        values.push_back(static_cast<float>(n));
    return values;
}

std::string deflated(const std::string& bytes) {
    std::string result(compressBound(bytes.size()), '\0');
    uLongf size = result.size();
    EXPECT_EQ(compress(reinterpret_cast<Bytef*>(result.data()), &size,
                       reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
              Z_OK);
    result.resize(size);
    return result;
}

TEST(MetaImage, DirectionsStandOneAfterTheOtherInLps) {
    const TemporaryFolder folder;
    make_file(folder / "a.mha", Header().text() + counting(24));
    const VoxelVolume volume = read_volume(folder / "a.mha");
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 2}));
    EXPECT_EQ(volume.values, counted(24));
    EXPECT_LT(distance(volume.index_to_scene, kFrame), kSamePlace);
    EXPECT_EQ(volume.source_type, "int16");
    EXPECT_TRUE(volume.warnings.empty());
}

TEST(MetaImage, GeometryGoesBySeveralNames) {
    const TemporaryFolder folder;
    for (const char* matrix : {"TransformMatrix", "Rotation", "Orientation"})
        for (const char* origin : {"Offset", "Position", "Origin"})
            for (const char* spacing : {"ElementSpacing", "ElementSize"}) {
                Header header;
                header.geometry = std::string(matrix) + " = 0 1 0 0 0 -1 1 0 0\n" + origin +
                                  " = -12.5 34.25 100\n" + spacing + " = 0.5 0.75 2.5\n";
                make_file(folder / "a.mha", header.text() + counting(24));
                const VoxelVolume volume = read_volume(folder / "a.mha");
                EXPECT_LT(distance(volume.index_to_scene, kFrame), kSamePlace)
                    << matrix << " " << origin << " " << spacing;
            }
    Header both; // the size of an element is not the distance of elements
    both.geometry += "ElementSize = 9 9 9\n";
    make_file(folder / "a.mha", both.text() + counting(24));
    EXPECT_LT(distance(read_volume(folder / "a.mha").index_to_scene, kFrame), kSamePlace);
}

TEST(MetaImage, MissingGeometryIsTakenForGrantedWithAWarning) {
    const TemporaryFolder folder;
    Header header;
    header.geometry.clear();
    make_file(folder / "a.mha", header.text() + counting(24));
    const VoxelVolume volume = read_volume(folder / "a.mha");
    EXPECT_LT(distance(volume.index_to_scene, frame_mm(Mat3(1.0), Vec3(0.0))), kSamePlace);
    EXPECT_EQ(volume.warnings.size(), 2U);
}

TEST(MetaImage, ContradictionsAndWhatIsNotAppliedAreWarnedOf) {
    const TemporaryFolder folder;
    const auto warnings_with = [&](const std::string& line) {
        Header header;
        header.more = line + "\n";
        make_file(folder / "a.mha", header.text() + counting(24));
        const VoxelVolume volume = read_volume(folder / "a.mha");
        EXPECT_LT(distance(volume.index_to_scene, kFrame), kSamePlace) << line;
        EXPECT_EQ(volume.values, counted(24)) << line;
        return volume.warnings.size();
    };
    // i runs from anterior to posterior, j from superior to inferior, k from right to left.
    EXPECT_EQ(warnings_with("AnatomicalOrientation = ASR"), 0U);
    EXPECT_EQ(warnings_with("AnatomicalOrientation = ???"), 0U);
    EXPECT_EQ(warnings_with("AnatomicalOrientation = RAI"), 1U);
    EXPECT_EQ(warnings_with("AnatomicalOrientation = PSR"), 1U);
    EXPECT_EQ(warnings_with("ElementToIntensityFunctionSlope = 2"), 1U);
    EXPECT_EQ(warnings_with("ElementToIntensityFunctionSlope = 1"), 0U);
    EXPECT_EQ(warnings_with("DistanceUnits = mm"), 0U);
    Header header;
    header.geometry.replace(header.geometry.find("Rotation = 0 0 0"), 16, "Rotation = 1 2 3");
    make_file(folder / "a.mha", header.text() + counting(24));
    const VoxelVolume volume = read_volume(folder / "a.mha");
    EXPECT_EQ(volume.warnings.size(), 1U);
    EXPECT_LT(distance(volume.index_to_scene, kFrame), kSamePlace);
}

template <class T>
std::string stored(bool big_endian) {
    std::string bytes;
    for (int n = 0; n < 24; ++n) {
        std::string one;
        append<T>(one, static_cast<T>(n));
        if (big_endian) std::reverse(one.begin(), one.end());
        bytes += one;
    }
    return bytes;
}

TEST(MetaImage, EveryTypeAndByteOrderIsRead) {
    struct Case {
        const char* type;
        std::string (*bytes)(bool);
    };
    const std::vector<Case> cases{{"MET_CHAR", stored<std::int8_t>},
                                  {"MET_UCHAR", stored<std::uint8_t>},
                                  {"MET_SHORT", stored<std::int16_t>},
                                  {"MET_USHORT", stored<std::uint16_t>},
                                  {"MET_INT", stored<std::int32_t>},
                                  {"MET_UINT", stored<std::uint32_t>},
                                  {"MET_LONG", stored<std::int32_t>},
                                  {"MET_ULONG", stored<std::uint32_t>},
                                  {"MET_LONG_LONG", stored<std::int64_t>},
                                  {"MET_ULONG_LONG", stored<std::uint64_t>},
                                  {"MET_FLOAT", stored<float>},
                                  {"MET_DOUBLE", stored<double>}};
    const TemporaryFolder folder;
    for (const Case& c : cases)
        for (const bool big_endian : {false, true})
            for (const char* key : {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) {
                Header header;
                header.type = std::string("ElementType = ") + c.type + "\n";
                std::string text = header.text();
                const std::string line = "BinaryDataByteOrderMSB = False";
                text.replace(text.find(line), line.size(),
                             std::string(key) + (big_endian ? " = True" : " = False"));
                make_file(folder / "a.mha", text + c.bytes(big_endian));
                EXPECT_EQ(read_volume(folder / "a.mha").values, counted(24)) << c.type;
            }
}

TEST(MetaImage, DataLieInTheFileBesideItInSeveralOrDeflated) {
    const TemporaryFolder folder;
    make_file(folder / "plain.raw", counting(24));
    make_file(folder / "after.raw", "header" + counting(24));
    make_file(folder / "s0", counting(24).substr(0, 24));
    make_file(folder / "s1", counting(24).substr(24));
    const std::string packed = deflated(counting(24));
    make_file(folder / "packed.zraw", packed);
    const std::string size = "CompressedDataSize = " + std::to_string(packed.size()) + "\n";
    struct Case {
        std::string more;
        std::string data;
        std::string local;
    };
    const std::vector<Case> cases{{"", "plain.raw", ""},
                                  {"HeaderSize = 0\n", "plain.raw", ""},
                                  {"HeaderSize = 6\n", "after.raw", ""},
                                  {"HeaderSize = -1\n", "after.raw", ""},
                                  {"", "LIST\ns0\ns1", ""},
                                  {"", "LIST 2\ns0\r\ns1\n", ""},
                                  {"CompressedData = True\n" + size, "packed.zraw", ""},
                                  {"CompressedData = True\n", "packed.zraw", ""},
                                  {"CompressedData = True\n" + size, "LOCAL", packed},
                                  {"CompressedData = True\n", "LOCAL", packed}};
    for (const Case& c : cases) {
        SCOPED_TRACE(c.more + c.data);
        Header header;
        header.more = c.more;
        header.data = c.data;
        make_file(folder / "a.mhd", header.text() + c.local);
        const VoxelVolume volume = read_volume(folder / "a.mhd");
        EXPECT_EQ(volume.values, counted(24));
        EXPECT_LT(distance(volume.index_to_scene, kFrame), kSamePlace);
    }
}

TEST(MetaImage, ChannelsAreComponentsAndNoScalarVolume) {
    const TemporaryFolder folder;
    Header header;
    header.size = "DimSize = 2 2 2\nElementNumberOfChannels = 3\n";
    make_file(folder / "a.mha", header.text() + counting(24));
    EXPECT_REFUSED(folder / "a.mha", "3 numbers per voxel");
    const internal::ComponentImage image = internal::read_meta_image(folder / "a.mha");
    EXPECT_EQ(image.components, 3);
    EXPECT_EQ(image.values, counted(24));
    const internal::ComponentImage only_header =
        internal::read_meta_image(folder / "a.mha", internal::ImagePart::header);
    EXPECT_EQ(only_header.size, (std::array<int, 3>{2, 2, 2}));
    EXPECT_TRUE(only_header.values.empty());
    const auto entries = list_volumes(folder / "a.mha");
    ASSERT_EQ(entries.size(), 1U);
    EXPECT_FALSE(entries[0].readable);
}

TEST(MetaImage, MalformedHeadersAreRefusedWithWords) {
    const TemporaryFolder folder;
    const auto file = folder / "a.mha";
    const auto expect_refused = [&](const std::string& from, const std::string& to,
                                    const std::string& says) {
        SCOPED_TRACE(to);
        std::string text = Header().text();
        const auto at = text.find(from);
        ASSERT_NE(at, std::string::npos);
        text.replace(at, from.size(), to);
        make_file(file, text + counting(24));
        EXPECT_REFUSED(file, says);
    };
    expect_refused("DimSize = 4 3 2", "DimSize = 4 3", "has 2 numbers as DimSize where 3 belong");
    expect_refused("DimSize = 4 3 2", "DimSize = 4 3 x", "\"x\" where a number of DimSize");
    expect_refused("DimSize = 4 3 2", "DimSize = 4 3 2.5", "impossible DimSize");
    expect_refused("DimSize = 4 3 2", "DimSize = 4 3 -2", "impossible size");
    expect_refused("DimSize = 4 3 2", "DimSize = 2000000000 2000000000 2000000000",
                   "impossible size");
    expect_refused("DimSize = 4 3 2", "DimSize = 4000 3000 2000", "is truncated");
    expect_refused("DimSize = 4 3 2\n", "", "states no DimSize");
    expect_refused("NDims = 3", "NDims = 2", "numbers");
    expect_refused("NDims = 3", "NDims = 99", "impossible NDims");
    expect_refused("MET_SHORT", "MET_STRING", "voxels of type \"MET_STRING\"");
    expect_refused("MET_SHORT", "MET_CHAR", "has 48 bytes of voxels where 24 belong");
    expect_refused("0.5 0.75 2.5", "0.5 0 2.5", "spacing that is not positive");
    expect_refused("0.5 0.75 2.5", "0.5 nan 2.5", "\"nan\" where a number");
    expect_refused("0 1 0 0 0 -1 1 0 0", "0 1 0 0 1 0 1 0 0", "is singular");
    expect_refused("ObjectType = Image", "ObjectType = Tube", "of type \"Tube\"");
    expect_refused("BinaryData = True", "BinaryData = False", "voxels as text");
    expect_refused("BinaryData = True", "HeaderSize = 4", "HeaderSize for voxels in the same file");
    expect_refused("BinaryData = True", "DistanceUnits = um", "distances in \"um\"");
    expect_refused("BinaryData = True", "ElementNumberOfChannels = 0", "impossible ElementNumber");
    expect_refused("BinaryData = True", "CompressedData = True", "cannot be inflated");
    expect_refused("BinaryData = True", "CompressedData = True\nCompressedDataSize = 49",
                   "48 compressed bytes of the 49");
    expect_refused("LOCAL", "missing.raw", "names a data file that cannot be read");
    expect_refused("LOCAL", "/dev/zero", "names a data file that cannot be read");
    expect_refused("LOCAL", ".", "names a data file that cannot be read");
    expect_refused("LOCAL", "s%03d.raw 1 2 1", "by a pattern");
    expect_refused("LOCAL\n", "LIST\n",
                   "names a data file that cannot be read"); // the voxels' bytes
    expect_refused("ElementDataFile = LOCAL", "NoDataFile = LOCAL", "is not a MetaImage");
    Header deflated_too_long;
    deflated_too_long.more = "CompressedData = True\n";
    make_file(file, deflated_too_long.text() + deflated(counting(25)));
    EXPECT_REFUSED(file, "more voxels than belong");
    deflated_too_long.size = "DimSize = 4000 3000 2000\n"; // no gigabytes before that is found
    make_file(file, deflated_too_long.text() + deflated(counting(25)));
    EXPECT_REFUSED(file, "compressed bytes cannot hold");
}

TEST(MetaImage, DamagedFilesAreReadOrRefused) {
    const TemporaryFolder folder;
    const auto file = folder / "a.mha";
    Header packed;
    packed.more = "CompressedData = True\n";
    for (const std::string& whole :
         {Header().text() + counting(24), packed.text() + deflated(counting(24))}) {
        make_file(file, whole);
        EXPECT_EQ(read_volume(file).values, counted(24));
        for (std::size_t cut = 1; cut < whole.size(); ++cut) {
            SCOPED_TRACE("cut at " + std::to_string(cut));
            make_file(file, whole.substr(0, cut));
            refusal(file);
        }
        std::mt19937 random(12);
        SCOPED_TRACE("seed 12");
        int read = 0;
        for (int n = 0; n < 300; ++n) {
            std::string damaged = whole;
            damaged[random() % whole.size()] = static_cast<char>(random());
            make_file(file, damaged);
            try {
                const VoxelVolume volume = read_volume(file);
                EXPECT_EQ(volume.values.size(), volume.voxels());
                ++read;
            } catch (const std::runtime_error& error) {
                const std::string message = error.what();
                EXPECT_EQ(message.find(folder.path().string()), 0U) << message;
                EXPECT_EQ(message.find('\n'), std::string::npos) << message;
                EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
            } // anything else ends the test
        }
        EXPECT_GT(read, 0);
        EXPECT_LT(read, 300);
    }
}

} // namespace
} // namespace palpate
