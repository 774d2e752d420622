// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/volume_file.h>

#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/expect_says.h"
#include "tests/support/gzip.h"
#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::counting;
using test::distance;
using test::frame_mm;
using test::gzipped;
using test::make_file;
using test::Nifti;
using test::TemporaryFolder;

constexpr auto kAutomatic = VolumeSelection::NiftiTransform::automatic;

/// 4 x 3 x 2 voxels of int16 with two or more components.
std::string nrrd_text(const std::string& sizes, const std::string& more) {
    return "NRRD0005\ntype: short\ndimension: 4\nsizes: " + sizes + "\nendian: little\n" + more;
}

const std::string kSpace = "space: left-posterior-superior\nspace origin: (10,20,30)\n";
const std::string kFirst = kSpace + "space directions: none (0.5,0,0) (0,1,0.25) (0,0,2)\n";
const std::string kLast = kSpace + "space directions: (0.5,0,0) (0,1,0.25) (0,0,2) none\n";

/// What a file of the numbers 0, 1, 2 ... holds when its components come last.
std::vector<float> components_last(std::size_t voxels, std::size_t components) {
    std::vector<float> values;
    for (std::size_t voxel = 0; voxel < voxels; ++voxel)
        for (std::size_t component = 0; component < components; ++component)
            values.push_back(static_cast<float>(component * voxels + voxel));
    return values;
}

std::vector<float> components_first(std::size_t count) {
    std::vector<float> values(count);
    std::iota(values.begin(), values.end(), 0.0F);
    return values;
}

/// The message that reading ends with.
template <class Read>
std::string message_of(const Read& read) {
    try {
        read();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "was read";
}

// --- NRRD ----------------------------------------------------------------------------------------

TEST(NrrdImage, ComponentsComeFirstOrLastAndAreStoredFastest) {
    const TemporaryFolder folder;
    make_file(folder / "first.nrrd", nrrd_text("2 4 3 2", kFirst + "encoding: raw\n"
                                                                   "kinds: list domain domain "
                                                                   "domain\n\n") +
                                         counting(48));
    make_file(folder / "last.nrrd", nrrd_text("4 3 2 2", kLast + "encoding: raw\n"
                                                                 "kinds: domain domain domain "
                                                                 "vector\n\n") +
                                        counting(48));
    const internal::ComponentImage first = internal::read_nrrd_image(folder / "first.nrrd");
    const internal::ComponentImage last = internal::read_nrrd_image(folder / "last.nrrd");
    EXPECT_EQ(first.values, components_first(48));
    EXPECT_EQ(last.values, components_last(24, 2));
    EXPECT_EQ(first.kind, "list");
    EXPECT_EQ(last.kind, "vector");
    const auto frame = frame_mm(Mat3(0.5, 0, 0, 0, 1, 0.25, 0, 0, 2), {10, 20, 30});
    for (const internal::ComponentImage* image : {&first, &last}) {
        EXPECT_EQ(image->size, (std::array<int, 3>{4, 3, 2}));
        EXPECT_EQ(image->components, 2);
        EXPECT_EQ(image->source_type, "int16");
        EXPECT_TRUE(image->warnings.empty());
        EXPECT_LT(distance(image->index_to_scene, frame), 1e-15);
    }
}

TEST(NrrdImage, TheComponentAxisIsFoundByDirectionKindOrSpacing) {
    const TemporaryFolder folder;
    for (const char* geometry :
         {"space: LPS\nspace directions: (nan,nan,nan) (1,0,0) (0,1,0) (0,0,1)\n",
          "kinds: vector space space space\n", "spacings: NaN 1 1 1\n"}) {
        SCOPED_TRACE(geometry);
        make_file(folder / "a.nrrd",
                  nrrd_text("2 4 3 2", std::string(geometry) + "encoding: raw\n\n") + counting(48));
        const internal::ComponentImage image = internal::read_nrrd_image(folder / "a.nrrd");
        EXPECT_EQ(image.components, 2);
        EXPECT_EQ(image.size, (std::array<int, 3>{4, 3, 2}));
        EXPECT_EQ(image.values, components_first(48));
    }
}

TEST(NrrdImage, ALayerAloneIsAScalarVolumeAndKeepsItsKind) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd", nrrd_text("1 4 3 2", kFirst + "encoding: raw\nkinds: list domain "
                                                               "domain domain\n\n") +
                                     counting(24));
    internal::ComponentImage image = internal::read_nrrd_image(folder / "a.nrrd");
    EXPECT_EQ(image.kind, "list");
    EXPECT_EQ(internal::as_scalar_volume(folder / "a.nrrd", std::move(image)).values,
              components_first(24));
}

TEST(NrrdImage, EncodingsAndWaysToStoreGiveTheSameVoxels) {
    const TemporaryFolder folder;
    const std::string data = counting(48);
    std::string text;
    for (int n = 0; n < 48; ++n)
        text += std::to_string(n) + (n % 7 == 6 ? "\r\n" : " ");
    const auto expect_same = [&](const char* name) {
        SCOPED_TRACE(name);
        EXPECT_EQ(internal::read_nrrd_image(folder / name).values, components_first(48));
    };
    const auto header = [&](const std::string& more) {
        return nrrd_text("2 4 3 2", kFirst + more + "\n");
    };
    make_file(folder / "gzip.nrrd", header("encoding: gz\n") + gzipped(data));
    expect_same("gzip.nrrd");
    make_file(folder / "skip.nrrd", header("encoding: gzip\nline skip: 2\nbyte skip: 3\n") +
                                        "a line\nanother\n" + gzipped("xyz" + data));
    expect_same("skip.nrrd");
    for (const char* name : {"ascii", "text", "txt"}) {
        make_file(folder / "text.nrrd", header("encoding: " + std::string(name) + "\n") + text);
        expect_same("text.nrrd");
    }
    for (const char* word : {"nan", "-NaN", "NAN(0x7)"}) {
        make_file(folder / "text.nrrd",
                  header("encoding: text\n") + word + text.substr(text.find(' ')));
        EXPECT_TRUE(std::isnan(internal::read_nrrd_image(folder / "text.nrrd").values[0])) << word;
    }
    for (const char* word : {"12n", "unknown", "1.5mean", "nand"}) {
        make_file(folder / "text.nrrd",
                  header("encoding: text\n") + word + text.substr(text.find(' ')));
        EXPECT_SAYS(message_of([&] { internal::read_nrrd_image(folder / "text.nrrd"); }),
                    "where a voxel's number should be");
    }
    make_file(folder / "tail.raw", "anything\n" + data);
    make_file(folder / "tail.nhdr", header("encoding: raw\nbyte skip: -1\ndata file: tail.raw\n"));
    expect_same("tail.nhdr");
    make_file(folder / "with blank.raw", data);
    make_file(folder / "blank.nhdr", header("encoding: raw\ndata file: with blank.raw\n"));
    expect_same("blank.nhdr");

    for (int part = 0; part < 4; ++part) {
        const std::string share = data.substr(static_cast<std::size_t>(part) * 24, 24);
        make_file(folder / ("s0" + std::to_string(2 * part + 1) + ".raw"), share);
        make_file(folder / ("z" + std::to_string(4 - part)), gzipped(share));
    }
    make_file(folder / "list.nhdr",
              header("encoding: raw\ndata file: LIST 3\ns01.raw\ns03.raw\ns05.raw\ns07.raw"));
    expect_same("list.nhdr");
    make_file(folder / "numbered.nhdr", header("encoding: raw\ndata file: s%02d.raw 1 7 2\n"));
    expect_same("numbered.nhdr");
    make_file(folder / "backwards.nhdr", header("encoding: gzip\ndata file: z%d 4 1 -1 3\n"));
    expect_same("backwards.nhdr");
}

TEST(NrrdImage, KeyValuePairsKeepTheirBlanksAndResolveTheirEscapes) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd",
              nrrd_text("2 4 3 2", kFirst + "encoding: raw\nSegment0_Name:=Left: hippo campus \n"
                                            "note:=two\\nlines\\\\x\r\n\n") +
                  counting(48));
    const internal::ComponentImage image = internal::read_nrrd_image(folder / "a.nrrd");
    EXPECT_EQ(image.key_values.at("Segment0_Name"), "Left: hippo campus ");
    EXPECT_EQ(image.key_values.at("note"), "two\nlines\\x");
    EXPECT_EQ(image.key_values.size(), 2U);
}

TEST(NrrdImage, ComponentAxesAreTheMeasurementFrameElseThoseOfTheSpace) {
    const TemporaryFolder folder;
    const auto axes = [&](const std::string& more) {
        make_file(folder / "a.nrrd",
                  nrrd_text("2 4 3 2", "space: RAS\nencoding: raw\n"
                                       "space directions: none (1,0,0) (0,1,0) (0,0,1)\n" +
                                           more + "\n") +
                      counting(48));
        return internal::read_nrrd_image(folder / "a.nrrd").axes;
    };
    const Mat3 ras(-1, 0, 0, 0, -1, 0, 0, 0, 1);
    EXPECT_EQ(axes("").to_lps, ras);
    EXPECT_FALSE(axes("").stated);
    EXPECT_FALSE(axes("measurement frame: none none none\n").stated);
    // Each vector is a column: the first component points along the space's (0,1,0), which is A.
    const internal::ComponentAxes stated = axes("measurement frame: (0,1,0) (0,0,1) (1,0,0)\n");
    EXPECT_TRUE(stated.stated);
    EXPECT_EQ(stated.to_lps * Vec3(1, 0, 0), Vec3(0, -1, 0));
    EXPECT_EQ(stated.to_lps * Vec3(0, 0, 1), Vec3(-1, 0, 0));
    EXPECT_SAYS(message_of([&] { axes("measurement frame: (1,0,0) (0,1,0)\n"); }), "measurement");
    EXPECT_SAYS(message_of([&] { axes("measurement frame: (1,0,0) (0,1,0) (1,1,0)\n"); }),
                "singular");
}

TEST(NrrdImage, RefusesWhatHasNoThreeAxesInSpaceAndOneOfComponents) {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& sizes, const std::string& geometry,
                             const char* words) {
        SCOPED_TRACE(words);
        make_file(folder / "a.nrrd",
                  nrrd_text(sizes, geometry + "encoding: raw\n\n") + counting(48));
        EXPECT_SAYS(message_of([&] { internal::read_nrrd_image(folder / "a.nrrd"); }), words);
    };
    refused("4 2 3 2", "kinds: domain vector domain domain\n", "between those in space");
    refused("2 2 4 3", "kinds: vector time domain domain\n", "several axes");
    refused("2 4 3 2", "", "4 dimensions");
    refused("2 4 3 2", "kinds: vector domain\n", "2 kinds for its 4 dimensions");
    refused("2 4 3 2", "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n",
            "3 space directions for its 4 dimensions");
    refused("0 4 3 2", kFirst, "0 numbers per voxel");
    refused("99999999 4 3 2", kFirst, "99999999 numbers per voxel");
    refused("2 4 3 2",
            "space: left-posterior-superior-time\n"
            "space directions: (0,0,0,1) (1,0,0,0) (0,1,0,0) (0,0,1,0)\n",
            "space with time");
    refused("2 4 3 2", "space: RAS\nspace directions: none (1,0) (0,1) (1,1)\n",
            "directions of three numbers");
    refused("2 4 3 2", kFirst + "space units: \"m\" \"mm\" \"mm\"\n", "space units");
    refused("2 4 3 2", kFirst + "data file: p%d 1 900000000 1\n", "unusable pattern");
    refused("2 4 3 2", kFirst + "data file: p%d 1 9 0\n", "unusable pattern");
    refused("2 4 3 2", kFirst + "byte skip: 9223372036854775807\n", "unreadable skip");
    refused("2 4 3 2", kFirst + "line skip: -1\n", "unreadable skip");
    refused("2 4 3 2", kFirst + "line skip: 1000\n", "truncated");
}

TEST(NrrdImage, WordsOfADamagedHeaderDoNotCutAMessageOrFillIt) {
    // Seen: a zero byte in the type ended the message before the remedy.
    const TemporaryFolder folder;
    for (const std::string& type : {std::string("sh\0rt", 5), std::string(100000, 'x')}) {
        make_file(folder / "a.nrrd", "NRRD0005\ntype: " + type +
                                         "\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n\n" +
                                         counting(24));
        const std::string message =
            message_of([&] { internal::read_nrrd_image(folder / "a.nrrd"); });
        EXPECT_SAYS(message, "; convert it to float or short");
        EXPECT_LT(message.size(), 300U);
    }
}

TEST(NrrdImage, RefusesDataThatDoNotFillTheVoxels) {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& encoding, const std::string& data,
                             const char* words) {
        SCOPED_TRACE(words);
        make_file(folder / "a.nrrd",
                  nrrd_text("2 4 3 2", kFirst + "encoding: " + encoding + "\n\n") + data);
        EXPECT_SAYS(message_of([&] { internal::read_nrrd_image(folder / "a.nrrd"); }), words);
    };
    const std::string packed = gzipped(counting(48));
    refused("gzip", packed.substr(0, packed.size() - 1), "cannot be inflated");
    refused("gzip", packed.substr(0, packed.size() / 2), "cannot be inflated");
    refused("gzip", gzipped(counting(47)), "ends within its voxels");
    refused("gzip", gzipped(counting(49)), "more bytes of voxels");
    refused("gzip", counting(48), "not gzipped");
    refused("ascii", "1 2 3", "truncated");
    refused("ascii", std::string(200, 'x'), "should be");
    refused("hex", std::string(200, '0'), "encoding \"hex\"");
    refused("bzip2", std::string(200, '0'), "encoding \"bzip2\"");
    std::string many;
    for (int n = 0; n < 49; ++n)
        many += "10 ";
    refused("ascii", many, "more numbers");
    refused("ascii", many.substr(6), "47 numbers of the 48");
}

TEST(NrrdImage, RawDataThatLookGzippedAreTakenAsTheyAre) {
    const TemporaryFolder folder;
    std::string data = counting(48);
    data[0] = '\x1f'; // the first bytes of gzip
    data[1] = '\x8b';
    make_file(folder / "a.nrrd", nrrd_text("2 4 3 2", kFirst + "encoding: raw\n\n") + data);
    const internal::ComponentImage image = internal::read_nrrd_image(folder / "a.nrrd");
    EXPECT_EQ(image.values[0], static_cast<float>(static_cast<std::int16_t>(0x8b1f)));
    EXPECT_EQ(image.values[47], 47.0F);
}

TEST(NrrdImage, AHeaderAloneHasEverythingButTheValues) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd", nrrd_text("2 4 3 2", kFirst + "encoding: raw\n\n") + counting(48));
    const internal::ComponentImage header =
        internal::read_nrrd_image(folder / "a.nrrd", internal::ImagePart::header);
    EXPECT_TRUE(header.values.empty());
    EXPECT_EQ(header.components, 2);
    make_file(folder / "a.nrrd", nrrd_text("2 4 3 2", kFirst + "encoding: raw\n\n") + counting(47));
    EXPECT_SAYS(message_of([&] {
                    internal::read_nrrd_image(folder / "a.nrrd", internal::ImagePart::header);
                }),
                "truncated");
}

// --- NIfTI ---------------------------------------------------------------------------------------

TEST(NiftiImage, ComponentsOfTheFourthAndFifthDimensionAreStoredFastest) {
    const TemporaryFolder folder;
    const auto read = [&](const std::vector<std::int16_t>& sizes, std::int16_t intent) {
        Nifti nifti;
        nifti.sform(0.0F, 0.0F, 0.0F);
        nifti.sizes(sizes);
        nifti.intent(intent);
        make_file(folder / "a.nii", nifti.with(counting(24 * sizes.back())));
        return internal::read_nifti_image(folder / "a.nii", kAutomatic);
    };
    struct Case {
        std::vector<std::int16_t> sizes;
        std::int16_t intent;
        const char* kind;
    };
    for (const Case& c :
         {Case{{4, 3, 2, 3}, 0, ""}, Case{{4, 3, 2, 3}, 1007, "vector"},
          Case{{4, 3, 2, 1, 3}, 1006, "displacement"},
          Case{{4, 3, 2, 1, 6}, 1005, "symmetric-matrix"}, Case{{4, 3, 2, 1, 9}, 1004, "matrix"},
          Case{{4, 3, 2, 1, 3}, 1008, "point"}, Case{{4, 3, 2, 6}, 0, ""},
          Case{{4, 3, 2, 7}, 0, "time"}, Case{{4, 3, 2, 3}, 2001, "time"}}) {
        SCOPED_TRACE(std::to_string(c.intent) + " of " + std::to_string(c.sizes.back()));
        const internal::ComponentImage image = read(c.sizes, c.intent);
        EXPECT_EQ(image.kind, c.kind);
        EXPECT_EQ(image.components, c.sizes.back());
        EXPECT_EQ(image.values, components_last(24, static_cast<std::size_t>(c.sizes.back())));
    }
    const internal::ComponentImage label = read({4, 3, 2, 1}, 1002);
    EXPECT_EQ(label.kind, "label");
    EXPECT_EQ(label.components, 1);
}

TEST(NiftiImage, SlopeIsAppliedToComponentsAndGzipIsKnownByItsLook) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    nifti.sizes({4, 3, 2, 3});
    nifti.set<float>(112, 0.5F);
    make_file(folder / "a.nii", gzipped(nifti.with(counting(72)))); // gzipped in spite of its name
    const internal::ComponentImage image = internal::read_nifti_image(folder / "a.nii", kAutomatic);
    std::vector<float> expected = components_last(24, 3);
    for (float& value : expected)
        value *= 0.5F;
    EXPECT_EQ(image.values, expected);
}

// --- axes ----------------------------------------------------------------------------------------

TEST(ComponentAxes, NearestRotationOfAShearedMatrixIsItsPolarFactor) {
    // M = R S with a rotation or reflection R and a positive stretch S: R again, whatever S.
    const Mat3 r = test::oblique_frame(Vec3(1.0), Vec3(0.0)).linear; // left-handed
    const Mat3 stretch(Vec3(2.0, 0.3, 0.1), Vec3(0.3, 1.0, -0.2), Vec3(0.1, -0.2, 0.7));
    const Mat3 found = internal::nearest_rotation(r * stretch);
    for (int column = 0; column < 3; ++column)
        EXPECT_LT(glm::length(found[column] - r[column]), 1e-14) << column;
    EXPECT_EQ(internal::nearest_rotation(Mat3(1.0)), Mat3(1.0));
}

TEST(ComponentAxes, NearestRotationIsOneWhateverTheLengths) {
    const Mat3 r = test::oblique_frame(Vec3(1.0), Vec3(0.0)).linear;
    for (const double length : {1e-20, 1.0, 1e20}) {
        const Mat3 axes(length * r[0], 2.0 * length * r[1], 3.0 * length * r[2]);
        const Mat3 found = internal::nearest_rotation(axes);
        for (int column = 0; column < 3; ++column)
            EXPECT_LT(glm::length(found[column] - r[column]), 1e-14) << length << " " << column;
    }
}

TEST(ComponentAxes, ImageAxesReverseTheFirstOfARightHandedImage) {
    const AffineTransform left = test::oblique_frame(Vec3(0.3, 0.9, 1.7), Vec3(0.0));
    AffineTransform right = left;
    right.linear[0] = -right.linear[0];
    const Mat3 from_left = internal::image_axes(left), from_right = internal::image_axes(right);
    for (int column = 0; column < 3; ++column) {
        const Vec3 along = glm::normalize(left.linear[column]);
        EXPECT_LT(glm::length(from_left[column] - along), 1e-14);
        EXPECT_LT(glm::length(from_right[column] - along), 1e-14); // i reversed back
    }
}

} // namespace
} // namespace palpate
