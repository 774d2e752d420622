// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_file.h>

#include <cstdint>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::append;
using test::content_of;
using test::counting;
using test::distance;
using test::frame_mm;
using test::make_file;
using test::oblique_frame;
using test::random_volume;
using test::refusal;
using test::TemporaryFolder;

constexpr double kMm = 1e-3;

std::string nrrd_text(const std::string& geometry, const std::string& more = "") {
    return "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: raw\n" +
           geometry + more + "\n";
}

const std::string kLpsGeometry = "space: left-posterior-superior\n"
                                 "space directions: (0.5,0,0) (0,1,0.25) (0,0,2)\n"
                                 "space origin: (10,20,30)\n";

TEST(NrrdVolume, MillimetresBecomeMetresAndTheWholeDirectionMatrixIsKept) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd", nrrd_text(kLpsGeometry) + counting(24));
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
        make_file(folder / "r.nrrd",
                  nrrd_text(std::string("space: ") + ras + "\n" + rest) + counting(24));
        const auto expected = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0.25, 0, 0, 2), {-10, -20, 30});
        const VoxelVolume volume = read_volume(folder / "r.nrrd");
        EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15) << ras;
        EXPECT_TRUE(volume.warnings.empty());
    }
    for (const char* las : {"left-anterior-superior", "LAS"}) {
        make_file(folder / "l.nrrd",
                  nrrd_text(std::string("space: ") + las + "\n" + rest) + counting(24));
        const auto expected = frame_mm(Mat3(0.5, 0, 0, 0, -1, 0.25, 0, 0, 2), {10, -20, 30});
        EXPECT_LT(distance(read_volume(folder / "l.nrrd").index_to_scene, expected), 1e-15) << las;
    }
}

TEST(NrrdVolume, WarnsWhereOrientationOrSpacingIsNotStated) {
    const TemporaryFolder folder;
    make_file(folder / "s.nrrd", nrrd_text("spacings: 0.5 1 2\n") + counting(24));
    const VoxelVolume spaced = read_volume(folder / "s.nrrd");
    EXPECT_LT(glm::length(spaced.spacing_m() - Vec3(0.5, 1, 2) * kMm), 1e-15);
    ASSERT_EQ(spaced.warnings.size(), 1U);
    EXPECT_NE(spaced.warnings[0].find("patient space"), std::string::npos);
    make_file(folder / "n.nrrd", nrrd_text("") + counting(24));
    EXPECT_EQ(read_volume(folder / "n.nrrd").warnings.size(), 2U);
    make_file(folder / "x.nrrd",
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
        make_file(folder / "t.nrrd", "NRRD0004\ntype: " + std::string(type) +
                                         "\ndimension: 3\nsizes: 4 3 2\nendian: little\n"
                                         "encoding: raw\n" +
                                         kLpsGeometry + "\n" + data);
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
    make_file(folder / "b.nrrd", header + big);
    EXPECT_EQ(read_volume(folder / "b.nrrd").values[23], 23.0F);

    make_file(folder / "d.raw", counting(24));
    make_file(folder / "d.nhdr", nrrd_text(kLpsGeometry, "data file: d.raw\n"));
    EXPECT_EQ(read_volume(folder / "d.nhdr").values[23], 23.0F);

    make_file(folder / "s.raw", "0123456" + counting(24));
    make_file(folder / "s.nhdr", nrrd_text(kLpsGeometry, "byte skip: 7\ndata file: s.raw\n"));
    EXPECT_EQ(read_volume(folder / "s.nhdr").values[23], 23.0F);
    make_file(folder / "e.nhdr", nrrd_text(kLpsGeometry, "byte skip: -1\ndata file: s.raw\n"));
    EXPECT_EQ(read_volume(folder / "e.nhdr").values[23], 23.0F);
}

// Seen: its voxels were sought in the lines that follow, as those of a list.
TEST(NrrdVolume, ReadsADataFileWhoseNameBeginsWithList) {
    const TemporaryFolder folder;
    make_file(folder / "list_ct.raw", counting(24));
    make_file(folder / "a.nhdr", nrrd_text(kLpsGeometry, "data file: list_ct.raw\n"));
    EXPECT_EQ(read_volume(folder / "a.nhdr").values[23], 23.0F);
}

TEST(NrrdVolume, ListsAndPatternsNameTheirFilesInOrder) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "slices");
    for (const char* stem : {"list", "slices/s00"}) {
        make_file(folder / (stem + std::string("0.raw")), counting(24).substr(0, 24));
        make_file(folder / (stem + std::string("1.raw")), counting(24).substr(24));
    }
    for (const char* description : {"LIST\nlist0.raw\nlist1.raw", "list 2\nlist0.raw\nlist1.raw",
                                    "list%d.raw 0 1 1", "slices/s%03d.raw 0 1 1"}) {
        SCOPED_TRACE(description);
        make_file(folder / "a.nhdr",
                  nrrd_text(kLpsGeometry, std::string("data file: ") + description + "\n"));
        const VoxelVolume volume = read_volume(folder / "a.nhdr");
        for (std::size_t n = 0; n < 24; ++n)
            EXPECT_EQ(volume.values[n], static_cast<float>(n));
    }
}

TEST(NrrdVolume, RefusesDataOfTheWrongLength) {
    const TemporaryFolder folder;
    make_file(folder / "short.nrrd", nrrd_text(kLpsGeometry) + counting(23));
    EXPECT_REFUSED(folder / "short.nrrd", "46 bytes of voxels of the 48");
    make_file(folder / "long.nrrd", nrrd_text(kLpsGeometry) + counting(25));
    EXPECT_REFUSED(folder / "long.nrrd", "50 bytes of voxels where 48 belong");
    make_file(folder / "none.nrrd", nrrd_text(kLpsGeometry));
    EXPECT_REFUSED(folder / "none.nrrd", "truncated");

    make_file(folder / "d.raw", counting(20));
    make_file(folder / "d.nhdr", nrrd_text(kLpsGeometry, "data file: d.raw\n"));
    EXPECT_REFUSED(folder / "d.nhdr", "40 bytes of voxels of the 48");
    make_file(folder / "d.raw", counting(30));
    EXPECT_REFUSED(folder / "d.nhdr", "60 bytes of voxels where 48 belong");
    make_file(folder / "s.nhdr", nrrd_text(kLpsGeometry, "byte skip: 70\ndata file: d.raw\n"));
    EXPECT_REFUSED(folder / "s.nhdr", "truncated");
    for (const char* numbers : {"0 -9223372036854775808 -1", "-9223372036854775808 0 1",
                                "0 1 -9223372036854775808", "1 9223372036854775807 1"}) {
        make_file(folder / "n.nhdr",
                  nrrd_text(kLpsGeometry, std::string("data file: d%d.raw ") + numbers + "\n"));
        EXPECT_REFUSED(folder / "n.nhdr", "unusable pattern");
    }
    make_file(folder / "t.nhdr", nrrd_text(kLpsGeometry, "data file: s.raw\ndata file: d.raw\n"));
    EXPECT_REFUSED(folder / "t.nhdr", "states \"data file\" twice; remove one of both lines");
    make_file(folder / "m.nhdr", nrrd_text(kLpsGeometry, "data file: missing.raw\n"));
    EXPECT_REFUSED(folder / "m.nhdr", "missing.raw");
    make_file(folder / "l.nhdr",
              nrrd_text(kLpsGeometry, "data file: LIST 2\nd.raw\nmissing.raw\n"));
    EXPECT_REFUSED(folder / "l.nhdr", "cannot be read");
}

TEST(NrrdVolume, RefusesTruncatedGzipWhereverItIsCut) {
    const TemporaryFolder folder;
    write_volume(random_volume(oblique_frame(Vec3(kMm), Vec3(0.0))), folder / "whole.nrrd");
    const std::string whole = content_of(folder / "whole.nrrd");
    const std::size_t data = whole.find("\n\n") + 2;
    for (const std::size_t cut :
         {data, data + 5, data + 100, whole.size() / 2, whole.size() - 60}) {
        SCOPED_TRACE(cut);
        make_file(folder / "cut.nrrd", whole.substr(0, cut));
        refusal(folder / "cut.nrrd");
    }
    std::string absurd = whole;
    const std::string sizes = "sizes: 11 7 5";
    absurd.replace(absurd.find(sizes), sizes.size(), "sizes: 9999 9999 9999");
    make_file(folder / "absurd.nrrd", absurd);
    EXPECT_REFUSED(folder / "absurd.nrrd", "truncated");
}

TEST(NrrdVolume, RefusesWhatIsNotAScalarVolume) {
    const TemporaryFolder folder;
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = nrrd_text(kLpsGeometry);
        text.replace(text.find(from), from.size(), to);
        make_file(folder / "a.nrrd", text + counting(24));
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

TEST(NrrdVolume, RefusesOtherWaysToStateSizeAndPlaceOfAxes) {
    const TemporaryFolder folder;
    const auto with = [&](const std::string& fields) {
        make_file(folder / "a.nrrd", nrrd_text(fields) + counting(24));
        return folder / "a.nrrd";
    };
    EXPECT_REFUSED(with("spacings: 0.1 0.1 0.1\nunits: \"cm\" \"cm\" \"cm\"\n"), "has units");
    EXPECT_REFUSED(with("spacings: 2 2 2\naxis mins: 100 100 100\n"), "axis mins");
    EXPECT_REFUSED(with("axismins: 0 0 0\naxis maxs: 20 20 20\n"), "axis maxs");
    // What says nothing else is taken.
    const VoxelVolume volume = read_volume(
        with("spacings: 2 2 2\naxis mins: 0 nan 0\naxis maxs: 8 6 4\nunits: \"mm\" \"\" \"mm\"\n"));
    EXPECT_EQ(volume.index_to_scene.linear, Mat3(2 * kMm));
    EXPECT_EQ(volume.index_to_scene.offset, Vec3(0.0));
}

TEST(NrrdVolume, RefusesSingularAxes) {
    const TemporaryFolder folder;
    for (const char* directions :
         {"(0,0,0) (0,1,0) (0,0,1)", "(1,0,0) (1,0,0) (0,0,1)", "(1,0,0) (0,1,0) (1,1,0)",
          "(nan,0,0) (0,1,0) (0,0,1)", "(1,0,0) (0,inf,0) (0,0,1)"}) {
        SCOPED_TRACE(directions);
        make_file(folder / "a.nrrd", nrrd_text(std::string("space: LPS\nspace directions: ") +
                                               directions + "\nspace origin: (0,0,0)\n") +
                                         counting(24));
        refusal(folder / "a.nrrd");
    }
    for (const char* spacings : {"0 1 1", "1 nan 1"}) {
        SCOPED_TRACE(spacings);
        make_file(folder / "a.nrrd",
                  nrrd_text(std::string("spacings: ") + spacings + "\n") + counting(24));
        refusal(folder / "a.nrrd");
    }
}

} // namespace
} // namespace palpate
