// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/volume_file.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::oblique_frame;
using test::read_bytes;
using test::sampled;
using test::sheared_frame;
using test::TemporaryFolder;
using test::write_bytes;

constexpr double kMm = 1e-3;

// Largest difference of two maps at the voxels of a small volume, m.
double distance(const AffineTransform& a, const AffineTransform& b) {
    double largest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 index(10 * (corner & 1), 10 * (corner >> 1 & 1), 10 * (corner >> 2));
        largest = std::max(largest, glm::length(a.point(index) - b.point(index)));
    }
    return largest;
}

VoxelVolume random_volume(const AffineTransform& frame) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(-1000.0F, 3000.0F);
    return sampled({11, 7, 5}, frame, [&](const Vec3&) { return uniform(random); });
}

/// The message of reading that file; it must be one line that begins with the file's name, and
/// nothing may be printed meanwhile.
std::string refusal(const std::filesystem::path& file) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    std::string message;
    try {
        read_volume(file);
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "") << file;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << file;
    EXPECT_NE(message, "") << "was read: " << file;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_LT(message.size(), 600U) << message;
    EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
    return message;
}

#define EXPECT_REFUSED(file, words)                                                                \
    do {                                                                                           \
        const std::string message_ = refusal(file);                                                \
        EXPECT_NE(message_.find(words), std::string::npos) << message_;                            \
        EXPECT_EQ(message_.find((file).parent_path().string()), 0U) << message_;                   \
    } while (false)

// --- files made by hand --------------------------------------------------------------------------

template <class T> void append(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// The bytes of an int16 volume 0, 1, 2 ...
std::string counting(int voxels) {
    std::string bytes;
    for (int n = 0; n < voxels; ++n)
        append<std::int16_t>(bytes, static_cast<std::int16_t>(n));
    return bytes;
}

std::string nrrd_text(const std::string& geometry, const std::string& more = "") {
    return "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: raw\n" +
           geometry + more + "\n";
}

const std::string kLpsGeometry = "space: left-posterior-superior\n"
                                 "space directions: (0.5,0,0) (0,1,0.25) (0,0,2)\n"
                                 "space origin: (10,20,30)\n";

/// A NIfTI-1 header of 4 x 3 x 2 int16 whose fields can be set by their offset.
struct Nifti {
    Nifti() : bytes(352, '\0') {
        set<std::int32_t>(0, 348);
        for (const auto& [offset, value] :
             {std::pair{40, 3}, {42, 4}, {44, 3}, {46, 2}, {48, 1}, {50, 1}, {52, 1}, {54, 1}})
            set<std::int16_t>(static_cast<std::size_t>(offset), static_cast<std::int16_t>(value));
        type(4, 16);
        set<float>(76, 1.0F);
        set<float>(80, 0.5F);
        set<float>(84, 1.0F);
        set<float>(88, 2.0F);
        set<float>(108, 352.0F);
        set<char>(123, 2); // mm
        std::memcpy(bytes.data() + 344, "n+1", 4);
    }
    template <class T> void set(std::size_t offset, T value) {
        std::memcpy(bytes.data() + offset, &value, sizeof(T));
    }
    void type(std::int16_t code, std::int16_t bits) {
        set(70, code);
        set(72, bits);
    }
    /// Spacing .5 1 2 as a sform; RAS, mm.
    void sform(float x, float y, float z) {
        set<std::int16_t>(254, 1);
        const float rows[3][4] = {{0.5F, 0, 0, x}, {0, 1.0F, 0, y}, {0, 0, 2.0F, z}};
        std::memcpy(bytes.data() + 280, rows, sizeof(rows));
    }
    void qform(float b, float c, float d, float x, float y, float z) {
        set<std::int16_t>(252, 1);
        const float values[6] = {b, c, d, x, y, z};
        std::memcpy(bytes.data() + 256, values, sizeof(values));
    }
    std::string with(const std::string& data) const { return bytes + data; }

    std::string bytes;
};

AffineTransform frame_mm(const Mat3& linear, const Vec3& offset) {
    return {kMm * linear, kMm * offset};
}

// --- round trips ---------------------------------------------------------------------------------

TEST(VolumeFile, RoundTripKeepsValuesBitForBitAndPlaces) {
    const TemporaryFolder folder;
    const auto frame = oblique_frame(Vec3(0.3, 0.9, 1.7) * kMm, Vec3(-0.12, 0.034, 0.21));
    const VoxelVolume volume = random_volume(frame);
    for (const char* name : {"a.nrrd", "a.nii", "a.nii.gz"}) {
        SCOPED_TRACE(name);
        write_volume(volume, folder / name);
        const VoxelVolume back = read_volume(folder / name);
        EXPECT_EQ(back.size, volume.size);
        EXPECT_EQ(back.values, volume.values);
        EXPECT_EQ(back.source_type, "float32");
        EXPECT_TRUE(back.warnings.empty()) << back.warnings.front();
        // NRRD: 17 digits; NIfTI: float millimetres, 6e-8 of 210 mm in each of three coordinates
        // and as much again in ten voxels' directions.
        const double tolerance = std::string(name) == "a.nrrd" ? 1e-15 : 50e-9;
        EXPECT_LT(distance(back.index_to_scene, volume.index_to_scene), tolerance);
    }
    EXPECT_LT(std::filesystem::file_size(folder / "a.nii.gz"),
              std::filesystem::file_size(folder / "a.nii"));
}

TEST(VolumeFile, ShearedAxesSurviveInNrrdAndAreRefusedByNifti) {
    const TemporaryFolder folder;
    const VoxelVolume volume = random_volume(sheared_frame(0.7 * kMm));
    write_volume(volume, folder / "a.nrrd");
    const VoxelVolume back = read_volume(folder / "a.nrrd");
    EXPECT_LT(distance(back.index_to_scene, volume.index_to_scene), 1e-15);
    EXPECT_THROW(write_volume(volume, folder / "a.nii.gz"), std::runtime_error);
    EXPECT_FALSE(std::filesystem::exists(folder / "a.nii.gz"));
}

TEST(VolumeFile, WritingLeavesOneCompleteFileOrNothing) {
    const TemporaryFolder folder;
    const VoxelVolume volume = random_volume(oblique_frame(Vec3(kMm), Vec3(0.0)));
    testing::internal::CaptureStderr();
    for (const char* ending : {".nrrd", ".nii", ".nii.gz"}) {
        const auto target = folder / (std::string("taken") + ending);
        std::filesystem::create_directory(target);
        write_bytes(target / "x", "a folder with something in it cannot be replaced");
        EXPECT_THROW(write_volume(volume, target), std::runtime_error);
        std::filesystem::remove_all(target);
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << ending;
        EXPECT_THROW(write_volume(volume, folder / "missing" / (std::string("a") + ending)),
                     std::runtime_error);
        write_bytes(target, "an older file");
        write_volume(volume, target);
        EXPECT_EQ(read_volume(target).values, volume.values);
        std::filesystem::remove(target);
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << ending;
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(VolumeFile, WritingRefusesWhatIsNoVolumeAndNamesItCannotWrite) {
    const TemporaryFolder folder;
    VoxelVolume volume = random_volume(AffineTransform{});
    for (const char* name : {"a.vdb", "a.png", "a", "a.nhdr"})
        EXPECT_THROW(write_volume(volume, folder / name), std::runtime_error) << name;
    volume.values.pop_back();
    EXPECT_THROW(write_volume(volume, folder / "a.nrrd"), std::invalid_argument);
    EXPECT_THROW(write_volume(VoxelVolume{}, folder / "a.nrrd"), std::invalid_argument);
    VoxelVolume flat = random_volume(AffineTransform{});
    flat.index_to_scene.linear[2] = flat.index_to_scene.linear[1];
    EXPECT_THROW(write_volume(flat, folder / "a.nrrd"), std::runtime_error);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

// --- NRRD ----------------------------------------------------------------------------------------

TEST(NrrdVolume, MillimetresBecomeMetresAndTheWholeDirectionMatrixIsKept) {
    const TemporaryFolder folder;
    write_bytes(folder / "a.nrrd", nrrd_text(kLpsGeometry) + counting(24));
    const VoxelVolume volume = read_volume(folder / "a.nrrd");
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 2}));
    EXPECT_EQ(volume.source_type, "int16");
    EXPECT_TRUE(volume.warnings.empty());
    for (int n = 0; n < 24; ++n)
        EXPECT_EQ(volume.values[static_cast<std::size_t>(n)], static_cast<float>(n));
    const auto expected = frame_mm(Mat3(0.5, 0, 0, 0, 1, 0.25, 0, 0, 2), {10, 20, 30});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
}

TEST(NrrdVolume, RasAndLasAreTurnedIntoLps) {
    const TemporaryFolder folder;
    const std::string rest = "space directions: (0.5,0,0) (0,1,0.25) (0,0,2)\n"
                             "space origin: (10,20,30)\n";
    for (const char* ras : {"right-anterior-superior", "RAS"}) {
        write_bytes(folder / "r.nrrd",
                    nrrd_text(std::string("space: ") + ras + "\n" + rest) + counting(24));
        const auto expected = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0.25, 0, 0, 2), {-10, -20, 30});
        const VoxelVolume volume = read_volume(folder / "r.nrrd");
        EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15) << ras;
        EXPECT_TRUE(volume.warnings.empty());
    }
    for (const char* las : {"left-anterior-superior", "LAS"}) {
        write_bytes(folder / "l.nrrd",
                    nrrd_text(std::string("space: ") + las + "\n" + rest) + counting(24));
        const auto expected = frame_mm(Mat3(0.5, 0, 0, 0, -1, 0.25, 0, 0, 2), {10, -20, 30});
        EXPECT_LT(distance(read_volume(folder / "l.nrrd").index_to_scene, expected), 1e-15) << las;
    }
}

TEST(NrrdVolume, WarnsWhereOrientationOrSpacingIsNotStated) {
    const TemporaryFolder folder;
    write_bytes(folder / "s.nrrd", nrrd_text("spacings: 0.5 1 2\n") + counting(24));
    const VoxelVolume spaced = read_volume(folder / "s.nrrd");
    EXPECT_LT(glm::length(spaced.spacing_m() - Vec3(0.5, 1, 2) * kMm), 1e-15);
    ASSERT_EQ(spaced.warnings.size(), 1U);
    EXPECT_NE(spaced.warnings[0].find("patient space"), std::string::npos);
    write_bytes(folder / "n.nrrd", nrrd_text("") + counting(24));
    EXPECT_EQ(read_volume(folder / "n.nrrd").warnings.size(), 2U);
    write_bytes(folder / "x.nrrd",
                nrrd_text("space: scanner-xyz\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n") +
                    counting(24));
    EXPECT_EQ(read_volume(folder / "x.nrrd").warnings.size(), 1U);
}

TEST(NrrdVolume, ReadsEveryScalarType) {
    const TemporaryFolder folder;
    const auto check = [&](const char* type, const char* name, auto one) {
        std::string data;
        for (int n = 0; n < 24; ++n)
            append(data, static_cast<decltype(one)>(n));
        write_bytes(folder / "t.nrrd", "NRRD0004\ntype: " + std::string(type) +
                                           "\ndimension: 3\nsizes: 4 3 2\nendian: little\n"
                                           "encoding: raw\n" + kLpsGeometry + "\n" + data);
        const VoxelVolume volume = read_volume(folder / "t.nrrd");
        EXPECT_EQ(volume.source_type, name);
        EXPECT_EQ(volume.values[23], 23.0F) << type;
        EXPECT_EQ(volume.values[1], 1.0F) << type;
    };
    check("signed char", "int8", std::int8_t{});
    check("unsigned char", "uint8", std::uint8_t{});
    check("int16", "int16", std::int16_t{});
    check("ushort", "uint16", std::uint16_t{});
    check("int", "int32", std::int32_t{});
    check("uint32_t", "uint32", std::uint32_t{});
    check("long long", "int64", std::int64_t{});
    check("uint64", "uint64", std::uint64_t{});
    check("float", "float32", float{});
    check("double", "float64", double{});
}

TEST(NrrdVolume, ReadsBigEndianDetachedAndSkippedData) {
    const TemporaryFolder folder;
    std::string big = counting(24);
    for (std::size_t n = 0; n < big.size(); n += 2)
        std::swap(big[n], big[n + 1]);
    std::string header = nrrd_text(kLpsGeometry);
    header.replace(header.find("little"), 6, "big");
    write_bytes(folder / "b.nrrd", header + big);
    EXPECT_EQ(read_volume(folder / "b.nrrd").values[23], 23.0F);

    write_bytes(folder / "d.raw", counting(24));
    write_bytes(folder / "d.nhdr", nrrd_text(kLpsGeometry, "data file: d.raw\n"));
    EXPECT_EQ(read_volume(folder / "d.nhdr").values[23], 23.0F);

    write_bytes(folder / "s.raw", "0123456" + counting(24));
    write_bytes(folder / "s.nhdr", nrrd_text(kLpsGeometry, "byte skip: 7\ndata file: s.raw\n"));
    EXPECT_EQ(read_volume(folder / "s.nhdr").values[23], 23.0F);
    write_bytes(folder / "e.nhdr", nrrd_text(kLpsGeometry, "byte skip: -1\ndata file: s.raw\n"));
    EXPECT_EQ(read_volume(folder / "e.nhdr").values[23], 23.0F);
}

TEST(NrrdVolume, RefusesDataOfTheWrongLength) {
    const TemporaryFolder folder;
    write_bytes(folder / "short.nrrd", nrrd_text(kLpsGeometry) + counting(23));
    EXPECT_REFUSED(folder / "short.nrrd", "46 bytes of voxels of the 48");
    write_bytes(folder / "long.nrrd", nrrd_text(kLpsGeometry) + counting(25));
    EXPECT_REFUSED(folder / "long.nrrd", "50 bytes of voxels where 48 belong");
    write_bytes(folder / "none.nrrd", nrrd_text(kLpsGeometry));
    EXPECT_REFUSED(folder / "none.nrrd", "truncated");

    write_bytes(folder / "d.raw", counting(20));
    write_bytes(folder / "d.nhdr", nrrd_text(kLpsGeometry, "data file: d.raw\n"));
    EXPECT_REFUSED(folder / "d.nhdr", "40 bytes of voxels of the 48");
    write_bytes(folder / "d.raw", counting(30));
    EXPECT_REFUSED(folder / "d.nhdr", "60 bytes of voxels where 48 belong");
    write_bytes(folder / "s.nhdr", nrrd_text(kLpsGeometry, "byte skip: 70\ndata file: d.raw\n"));
    EXPECT_REFUSED(folder / "s.nhdr", "truncated");
    write_bytes(folder / "m.nhdr", nrrd_text(kLpsGeometry, "data file: missing.raw\n"));
    EXPECT_REFUSED(folder / "m.nhdr", "missing.raw");
    write_bytes(folder / "l.nhdr",
                nrrd_text(kLpsGeometry, "data file: LIST 2\nd.raw\nmissing.raw\n"));
    EXPECT_REFUSED(folder / "l.nhdr", "cannot be read");
}

TEST(NrrdVolume, RefusesTruncatedGzipWhereverItIsCut) {
    const TemporaryFolder folder;
    write_volume(random_volume(oblique_frame(Vec3(kMm), Vec3(0.0))), folder / "whole.nrrd");
    const std::string whole = read_bytes(folder / "whole.nrrd");
    const std::size_t data = whole.find("\n\n") + 2;
    for (const std::size_t cut : {data, data + 5, data + 100, whole.size() / 2, whole.size() - 60}) {
        SCOPED_TRACE(cut);
        write_bytes(folder / "cut.nrrd", whole.substr(0, cut));
        refusal(folder / "cut.nrrd");
    }
    std::string absurd = whole;
    const std::string sizes = "sizes: 11 7 5";
    absurd.replace(absurd.find(sizes), sizes.size(), "sizes: 9999 9999 9999");
    write_bytes(folder / "absurd.nrrd", absurd);
    EXPECT_REFUSED(folder / "absurd.nrrd", "truncated");
}

TEST(NrrdVolume, RefusesWhatIsNotAScalarVolume) {
    const TemporaryFolder folder;
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = nrrd_text(kLpsGeometry);
        text.replace(text.find(from), from.size(), to);
        write_bytes(folder / "a.nrrd", text + counting(24));
        return folder / "a.nrrd";
    };
    EXPECT_REFUSED(with("dimension: 3\nsizes: 4 3 2", "dimension: 2\nsizes: 4 6"), "2 dimensions");
    EXPECT_REFUSED(with("dimension: 3\nsizes: 4 3 2", "dimension: 4\nsizes: 2 2 3 2"),
                   "4 dimensions");
    EXPECT_REFUSED(with("sizes: 4 3 2", "sizes: 4 3"), "dimension 3 but 2 sizes");
    EXPECT_REFUSED(with("sizes: 4 3 2", "sizes: 4 0 2"), "impossible size");
    EXPECT_REFUSED(with("sizes: 4 3 2", "sizes: 4 -3 2"), "impossible size");
    EXPECT_REFUSED(with("sizes: 4 3 2", "sizes: 99999999999 3 2"), "impossible size");
    EXPECT_REFUSED(with("sizes: 4 3 2", "sizes: four"), "sizes");
    EXPECT_REFUSED(with("type: short", "type: block"), "block");
    EXPECT_REFUSED(with("type: short", "typo: short"), "type");
    EXPECT_REFUSED(with("NRRD0004", "BMPX0004"), "not an NRRD");
    EXPECT_REFUSED(with("encoding: raw", "encoding: magic"), "cannot be read");
    EXPECT_REFUSED(with("space origin: (10,20,30)\n",
                        "space origin: (10,20,30)\nspace units: \"m\" \"m\" \"m\"\n"),
                   "space units");
}

TEST(NrrdVolume, RefusesSingularAxes) {
    const TemporaryFolder folder;
    for (const char* directions :
         {"(0,0,0) (0,1,0) (0,0,1)", "(1,0,0) (1,0,0) (0,0,1)", "(1,0,0) (0,1,0) (1,1,0)",
          "(nan,0,0) (0,1,0) (0,0,1)", "(1,0,0) (0,inf,0) (0,0,1)"}) {
        SCOPED_TRACE(directions);
        write_bytes(folder / "a.nrrd",
                    nrrd_text(std::string("space: LPS\nspace directions: ") + directions +
                              "\nspace origin: (0,0,0)\n") +
                        counting(24));
        refusal(folder / "a.nrrd");
    }
    for (const char* spacings : {"0 1 1", "1 nan 1"}) {
        SCOPED_TRACE(spacings);
        write_bytes(folder / "a.nrrd",
                    nrrd_text(std::string("spacings: ") + spacings + "\n") + counting(24));
        refusal(folder / "a.nrrd");
    }
}

// --- NIfTI ---------------------------------------------------------------------------------------

TEST(NiftiVolume, RasMillimetresBecomeLpsMetres) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(-90.0F, -126.0F, -72.0F);
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 2}));
    EXPECT_EQ(volume.source_type, "int16");
    EXPECT_EQ(volume.values[23], 23.0F);
    EXPECT_TRUE(volume.warnings.empty());
    const auto expected = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0, 0, 0, 2), {90, 126, -72});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
}

TEST(NiftiVolume, SformWinsOverADifferentQformAndSaysByHowMuch) {
    // As in HarvardOxford of mricron-data: qoffset (90,0,0), srow offset (90,-126,-72); a reader
    // that goes by the qform puts it sqrt(126^2 + 72^2) = 145.12 mm off.
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(90.0F, -126.0F, -72.0F);
    nifti.qform(0.0F, 0.0F, 0.0F, 90.0F, 0.0F, 0.0F);
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    const auto expected = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0, 0, 0, 2), {-90, 126, -72});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("145.12 mm"), std::string::npos) << volume.warnings[0];
    nifti.qform(0.0F, 0.0F, 0.0F, 90.0F, -126.0F, -72.01F); // a hundredth of a millimetre
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    EXPECT_TRUE(read_volume(folder / "a.nii").warnings.empty());
}

TEST(NiftiVolume, SformIsNotTakenWhenItsCodeIsZero) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(90.0F, -126.0F, -72.0F);
    nifti.set<std::int16_t>(254, 0);
    // Half a turn about z: x and y run backwards. 0.5 turn = quaternion (0, 0, 0, 1).
    nifti.qform(0.0F, 0.0F, 1.0F, 1.0F, 2.0F, 3.0F);
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    const auto expected = frame_mm(Mat3(0.5, 0, 0, 0, 1, 0, 0, 0, 2), {-1, -2, 3});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
    EXPECT_TRUE(volume.warnings.empty());
}

TEST(NiftiVolume, QuaternionTurnsAndQfacMirrors) {
    // A turn by 60 degrees about z in RAS: quaternion (cos 30, 0, 0, sin 30).
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.qform(0.0F, 0.0F, 0.5F, 0.0F, 0.0F, 0.0F);
    nifti.set<float>(76, -1.0F);
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    const double c = 0.5, s = std::sqrt(0.75);
    const auto expected =
        frame_mm(Mat3(-0.5 * c, -0.5 * s, 0, 1.0 * s, -1.0 * c, 0, 0, 0, -2.0), Vec3(0.0));
    // 0.5 is exact in float; the rest is double.
    EXPECT_LT(distance(read_volume(folder / "a.nii").index_to_scene, expected), 1e-15);
}

TEST(NiftiVolume, WithoutAnyFormTheVoxelSizeAloneIsTakenAndSaid) {
    const TemporaryFolder folder;
    write_bytes(folder / "a.nii", Nifti().with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_LT(glm::length(volume.spacing_m() - Vec3(0.5, 1, 2) * kMm), 1e-15);
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("no orientation"), std::string::npos);
}

TEST(NiftiVolume, UnitsOtherThanMillimetresAreHeeded) {
    const TemporaryFolder folder;
    for (const auto& [code, metres] : {std::pair{1, 1.0}, {2, 1e-3}, {3, 1e-6}, {0, 1e-3}}) {
        Nifti nifti;
        nifti.sform(0.0F, 0.0F, 0.0F);
        nifti.set<char>(123, static_cast<char>(code + 8)); // seconds beside it
        write_bytes(folder / "a.nii", nifti.with(counting(24)));
        const Vec3 spacing = read_volume(folder / "a.nii").spacing_m();
        EXPECT_LT(glm::length(spacing - Vec3(0.5, 1, 2) * metres), 1e-15 * metres) << code;
    }
}

TEST(NiftiVolume, SlopeAndInterceptAreAppliedAndTheFilesTypeIsKept) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    nifti.set<float>(112, 2.0F);
    nifti.set<float>(116, -1024.0F);
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_EQ(volume.values[23], 2.0F * 23.0F - 1024.0F);
    EXPECT_EQ(volume.source_type, "int16");
}

TEST(NiftiVolume, ReadsTheOtherByteOrderAndTrailingDimensionsOfOne) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(-90.0F, -126.0F, -72.0F);
    nifti.set<std::int16_t>(40, 5);
    const std::string plain = nifti.with(counting(24));
    write_bytes(folder / "a.nii", plain);
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 2}));

    std::string swapped = plain;
    const auto swap = [&](std::size_t offset, std::size_t bytes) {
        std::reverse(swapped.begin() + static_cast<std::ptrdiff_t>(offset),
                     swapped.begin() + static_cast<std::ptrdiff_t>(offset + bytes));
    };
    swap(0, 4);
    for (std::size_t field = 40; field < 76; field += 2)
        if (field < 56 || field >= 68) // intent_p1..3 between are floats
            swap(field, 2);
    for (std::size_t field = 76; field < 120; field += 4)
        swap(field, 4);
    swap(252, 2);
    swap(254, 2);
    for (std::size_t field = 256; field < 328; field += 4)
        swap(field, 4);
    for (std::size_t voxel = 352; voxel < swapped.size(); voxel += 2)
        swap(voxel, 2);
    write_bytes(folder / "b.nii", swapped);
    const VoxelVolume other = read_volume(folder / "b.nii");
    EXPECT_EQ(other.values, volume.values);
    EXPECT_EQ(distance(other.index_to_scene, volume.index_to_scene), 0.0);
}

TEST(NiftiVolume, RefusesTruncatedFilesPlainAndGzipped) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    const std::string plain = nifti.with(counting(24));
    for (const std::size_t cut : {std::size_t{1}, std::size_t{347}, std::size_t{348},
                                  std::size_t{352}, plain.size() - 1}) {
        SCOPED_TRACE(cut);
        write_bytes(folder / "cut.nii", plain.substr(0, cut));
        EXPECT_REFUSED(folder / "cut.nii", "truncated");
    }
    write_volume(random_volume(oblique_frame(Vec3(kMm), Vec3(0.0))), folder / "whole.nii.gz");
    const std::string whole = read_bytes(folder / "whole.nii.gz");
    for (const std::size_t cut :
         {std::size_t{1}, std::size_t{20}, whole.size() / 4, whole.size() / 2, whole.size() - 60}) {
        SCOPED_TRACE(cut);
        write_bytes(folder / "cut.nii.gz", whole.substr(0, cut));
        refusal(folder / "cut.nii.gz");
    }
}

TEST(NiftiVolume, RefusesAnAbsurdSizeBeforeMemoryIsAskedFor) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    for (const std::size_t field : {42U, 44U, 46U})
        nifti.set<std::int16_t>(field, 32767);
    write_bytes(folder / "a.nii", nifti.with(counting(24)));
    EXPECT_REFUSED(folder / "a.nii", "truncated");
    write_bytes(folder / "a.nii.gz", nifti.with(counting(24)));
    EXPECT_REFUSED(folder / "a.nii.gz", "truncated");
}

TEST(NiftiVolume, RefusesWhatIsNotAScalarVolume) {
    const TemporaryFolder folder;
    const auto refused = [&](const char* words, const auto& change) {
        SCOPED_TRACE(words);
        Nifti nifti;
        nifti.sform(0.0F, 0.0F, 0.0F);
        change(nifti);
        write_bytes(folder / "a.nii", nifti.with(counting(240)));
        EXPECT_REFUSED(folder / "a.nii", words);
    };
    refused("2 dimensions", [](Nifti& n) { n.set<std::int16_t>(40, 2); });
    refused("4 dimensions", [](Nifti& n) {
        n.set<std::int16_t>(40, 4);
        n.set<std::int16_t>(48, 2);
    });
    refused("impossible size", [](Nifti& n) { n.set<std::int16_t>(44, 0); });
    refused("impossible size", [](Nifti& n) { n.set<std::int16_t>(44, -3); });
    refused("9 dimensions", [](Nifti& n) { n.set<std::int16_t>(40, 9); });
    refused("type 128", [](Nifti& n) { n.type(128, 24); });  // RGB
    refused("type 32", [](Nifti& n) { n.type(32, 64); });    // complex
    refused("vox_offset", [](Nifti& n) { n.set<float>(108, std::nanf("")); });
    refused("NIfTI-2", [](Nifti& n) { n.set<std::int32_t>(0, 540); });
    refused("not a single-file NIfTI-1", [](Nifti& n) { n.set<char>(345, 'i'); });
    refused("singular", [](Nifti& n) { n.set<float>(280, 0.0F); });
    refused("not finite", [](Nifti& n) { n.set<float>(284, std::nanf("")); });
}

// --- what is no volume at all ----------------------------------------------------------------------

TEST(VolumeFile, RefusesWhatCannotBeAVolumeWithOneLine) {
    const TemporaryFolder folder;
    for (const char* ending : {".nrrd", ".nhdr", ".nii", ".nii.gz", ".vdb"}) {
        SCOPED_TRACE(ending);
        EXPECT_REFUSED(folder / (std::string("missing") + ending), "does not exist");
        std::filesystem::create_directory(folder / (std::string("folder") + ending));
        EXPECT_REFUSED(folder / (std::string("folder") + ending), "is a folder");
        write_bytes(folder / (std::string("empty") + ending), "");
        EXPECT_REFUSED(folder / (std::string("empty") + ending), "is empty");
        write_bytes(folder / (std::string("text") + ending),
                    std::string(1000, 'x') + "\nnot a volume\n");
        refusal(folder / (std::string("text") + ending));
        SCOPED_TRACE("seed 3");
        std::mt19937 random(3);
        std::string noise(5000, '\0');
        for (char& c : noise)
            c = static_cast<char>(random());
        write_bytes(folder / (std::string("noise") + ending), noise);
        refusal(folder / (std::string("noise") + ending));
    }
    write_bytes(folder / "a.png", "x");
    EXPECT_REFUSED(folder / "a.png", ".nrrd, .nhdr, .nii, .nii.gz and .vdb are read");
    EXPECT_REFUSED(folder / ".nrrd", "not a volume by its name");
}

// --- OpenVDB -------------------------------------------------------------------------------------

class VdbVolume : public testing::Test {
protected:
    void SetUp() override { openvdb::initialize(); }

    static void write(const std::filesystem::path& file, const openvdb::GridPtrVec& grids) {
        openvdb::io::File output(file.string());
        output.write(grids);
        output.close();
    }
    static openvdb::FloatGrid::Ptr grid(const std::string& name, float value) {
        auto result = openvdb::FloatGrid::create(-1000.0F);
        result->setName(name);
        result->tree().setValue(openvdb::Coord(-3, 4, 5), value);
        result->tree().setValue(openvdb::Coord(10, 6, 5), 2.0F * value);
        return result;
    }
};

TEST_F(VdbVolume, IsCopiedOverItsActiveBoxWithBackgroundBetween) {
    const TemporaryFolder folder;
    const auto density = grid("anything", 7.0F);
    // Sheared and shifted, mm.
    density->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::Mat4R(openvdb::Vec4d(0.5, 0.1, 0, 0), openvdb::Vec4d(0, -1, 0.2, 0),
                       openvdb::Vec4d(0, 0, 2, 0), openvdb::Vec4d(100, 200, 300, 1), true)));
    write(folder / "a.vdb", {density});
    const VoxelVolume volume = read_volume(folder / "a.vdb");
    EXPECT_EQ(volume.size, (std::array<int, 3>{14, 3, 1}));
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 14; ++i)
            EXPECT_EQ(volume.at(i, j, 0),
                      i == 0 && j == 0 ? 7.0F : (i == 13 && j == 2 ? 14.0F : -1000.0F));
    const openvdb::Vec3d world = density->indexToWorld(openvdb::Coord(-3 + 13, 4 + 2, 5));
    const Vec3 expected = kMm * Vec3(world.x(), world.y(), world.z());
    EXPECT_LT(glm::length(volume.index_to_scene.point({13, 2, 0}) - expected), 1e-15);
    EXPECT_EQ(volume.source_type, "float32");
    EXPECT_TRUE(volume.warnings.empty());
}

TEST_F(VdbVolume, TheGridNamedDensityIsTakenAmongSeveral) {
    const TemporaryFolder folder;
    write(folder / "a.vdb", {grid("other", 1.0F), grid("density", 5.0F), grid("more", 2.0F)});
    EXPECT_EQ(read_volume(folder / "a.vdb").at(0, 0, 0), 5.0F);
    write(folder / "b.vdb", {grid("one", 1.0F), grid("two", 2.0F)});
    EXPECT_REFUSED(folder / "b.vdb", "one (float), two (float)");
    const auto labels = openvdb::Int32Grid::create(0);
    labels->setName("labels");
    labels->tree().setValue(openvdb::Coord(0), 3);
    write(folder / "c.vdb", {labels, grid("only", 3.0F)});
    EXPECT_EQ(read_volume(folder / "c.vdb").at(0, 0, 0), 3.0F);
    write(folder / "d.vdb", {labels});
    EXPECT_REFUSED(folder / "d.vdb", "labels (int32)");
}

TEST_F(VdbVolume, RefusesWhatHasNoDenseAffineVolume) {
    const TemporaryFolder folder;
    write(folder / "empty.vdb", {openvdb::FloatGrid::create()});
    EXPECT_REFUSED(folder / "empty.vdb", "no active voxel");
    const auto huge = grid("huge", 1.0F);
    huge->tree().setValue(openvdb::Coord(1000000, 1000000, 1000000), 1.0F);
    write(folder / "huge.vdb", {huge});
    EXPECT_REFUSED(folder / "huge.vdb", "too large");
    const auto frustum = grid("frustum", 1.0F);
    frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 10.0));
    write(folder / "frustum.vdb", {frustum});
    EXPECT_REFUSED(folder / "frustum.vdb", "not affine");
}

TEST_F(VdbVolume, RefusesTruncatedFilesWhereverTheyAreCut) {
    const TemporaryFolder folder;
    const auto density = grid("density", 1.0F);
    SCOPED_TRACE("seed 8");
    std::mt19937 random(8);
    for (int n = 0; n < 5000; ++n) {
        const openvdb::Coord at(static_cast<int>(random() % 60), static_cast<int>(random() % 60),
                                static_cast<int>(random() % 60));
        density->tree().setValue(at, static_cast<float>(random() % 1000));
    }
    write(folder / "whole.vdb", {density});
    const std::string whole = read_bytes(folder / "whole.vdb");
    EXPECT_GT(read_volume(folder / "whole.vdb").voxels(), 0U);
    for (int share = 1; share < 40; ++share) {
        const std::size_t cut = whole.size() * static_cast<std::size_t>(share) / 40;
        SCOPED_TRACE(cut);
        write_bytes(folder / "cut.vdb", whole.substr(0, cut));
        refusal(folder / "cut.vdb");
    }
    write_bytes(folder / "cut.vdb", whole.substr(0, whole.size() - 1));
    refusal(folder / "cut.vdb");
}

TEST_F(VdbVolume, WarnsThatALevelSetIsNegativeInside) {
    const TemporaryFolder folder;
    const auto set = grid("density", 1.0F);
    set->setGridClass(openvdb::GRID_LEVEL_SET);
    write(folder / "a.vdb", {set});
    const VoxelVolume volume = read_volume(folder / "a.vdb");
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("level set"), std::string::npos);
}

} // namespace
} // namespace palpate
