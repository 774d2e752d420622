// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/label_volume.h>

#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::make_file;
using test::oblique_frame;
using test::sampled;
using test::sheared_frame;
using test::TemporaryFolder;

constexpr double kMm = 1e-3;

/// Label 3 in a box, 1 in a voxel, 7 in another, in a volume of 6 x 5 x 4.
VoxelVolume three_labels() {
    VoxelVolume volume = sampled({6, 5, 4}, oblique_frame({kMm, 2 * kMm, 3 * kMm}, {0.1, 0, 0}),
                                 [](const Vec3&) { return 0.0; });
    for (int k = 1; k < 3; ++k)
        for (int j = 1; j < 4; ++j)
            for (int i = 2; i < 4; ++i)
                volume.values[volume.index(i, j, k)] = 3.0F;
    volume.values[volume.index(0, 0, 0)] = 1.0F;
    volume.values[volume.index(5, 4, 3)] = 7.0F;
    return volume;
}

LabelVolume written_and_read(const VoxelVolume& volume) {
    const TemporaryFolder folder;
    write_volume(volume, folder / "v.nrrd");
    return read_label_volume(folder / "v.nrrd");
}

std::vector<std::string> names_of(const LabelVolume& volume) {
    std::vector<std::string> names;
    for (const Label& label : volume.labels)
        names.push_back(label.name);
    return names;
}

std::string refusal(const std::filesystem::path& file, const std::filesystem::path& table = {}) {
    try {
        read_label_volume(file, table);
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        return message;
    }
    return "was read";
}

// --- reading -----------------------------------------------------------------------------------

TEST(LabelVolume, ValuesWithoutATableAreNamedByTheirDigits) {
    const VoxelVolume image = three_labels();
    const LabelVolume volume = written_and_read(image);
    EXPECT_EQ(volume.size, image.size);
    EXPECT_LT(test::distance(volume.index_to_scene, image.index_to_scene), 1e-12);
    EXPECT_EQ(names_of(volume), (std::vector<std::string>{"1", "3", "7"}));
    ASSERT_EQ(volume.layers.size(), 1U);
    for (std::size_t n = 0; n < image.values.size(); ++n)
        EXPECT_EQ(static_cast<float>(volume.layers[0][n]), image.values[n]);
    EXPECT_TRUE(volume.warnings.empty());
}

TEST(LabelVolume, ATableBesideItNamesThemAndAGivenOneGoesFirst) {
    const TemporaryFolder folder;
    write_volume(three_labels(), folder / "atlas.nii.gz");
    make_file(folder / "atlas.txt", "3 beside\n");
    EXPECT_EQ(names_of(read_label_volume(folder / "atlas.nii.gz")),
              (std::vector<std::string>{"1", "beside", "7"}));
    make_file(folder / "atlas.nii.txt", "0 nothing\n3 nearer\n1 one 2001\n900 absent\n");
    EXPECT_EQ(names_of(read_label_volume(folder / "atlas.nii.gz")),
              (std::vector<std::string>{"one", "nearer", "7"}));
    make_file(folder / "given.ctbl", "3 given 1 2 3 255\n");
    const LabelVolume given = read_label_volume(folder / "atlas.nii.gz", folder / "given.ctbl");
    EXPECT_EQ(names_of(given), (std::vector<std::string>{"1", "given", "7"}));
    EXPECT_EQ(given.labels[1].color, (std::array<std::uint8_t, 3>{1, 2, 3}));
}

TEST(LabelVolume, ATableBesideItThatIsNoneIsAWarningAGivenOneAnError) {
    const TemporaryFolder folder;
    write_volume(three_labels(), folder / "v.nrrd");
    make_file(folder / "v.txt", "This volume was made by hand.\n");
    const LabelVolume volume = read_label_volume(folder / "v.nrrd");
    EXPECT_EQ(names_of(volume), (std::vector<std::string>{"1", "3", "7"}));
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("v.txt:1:"), std::string::npos);
    EXPECT_NE(refusal(folder / "v.nrrd", folder / "v.txt").find("v.txt:1:"), std::string::npos);
    EXPECT_NE(refusal(folder / "v.nrrd", folder / "none.txt").find("none.txt"), std::string::npos);
}

TEST(LabelVolume, TablesAreFoundByTheNameOfTheVolume) {
    const TemporaryFolder folder;
    const auto found = [&](const char* file) {
        return find_name_table(folder / file).filename().string();
    };
    EXPECT_EQ(found("a.nii.gz"), "");
    for (const char* table : {"a.tsv", "a.ctbl", "a.lut", "a.label", "a.txt", "a.nii.txt"}) {
        make_file(folder / table, "1 One\n");
        EXPECT_EQ(found("a.nii.gz"), table);
    }
    EXPECT_EQ(found("a.nii"), "a.nii.txt");
    EXPECT_EQ(found("a.seg.nrrd"), "a.txt");
    EXPECT_EQ(found("a.mha"), "a.txt");
    EXPECT_EQ(found("b.nii.gz"), "");
    EXPECT_EQ(found("a"), ""); // a folder of slices
    // A binary colour table, as MRIcron has beside its atlases.
    make_file(folder / "c.nii.lut", std::string(768, '\0'));
    EXPECT_EQ(found("c.nii.gz"), "");
}

TEST(LabelVolume, NegativeValuesAreLabelsWithAWarning) {
    VoxelVolume image = three_labels();
    image.values[5] = -4.0F;
    const LabelVolume volume = written_and_read(image);
    EXPECT_EQ(volume.labels.front().value, -4);
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("-4"), std::string::npos);
}

TEST(LabelVolume, AnEmptyLabelMapHasNoLabels) {
    VoxelVolume image = three_labels();
    std::fill(image.values.begin(), image.values.end(), 0.0F);
    EXPECT_TRUE(written_and_read(image).labels.empty());
}

TEST(LabelVolume, RefusesWhatIsNoLabelWithVoxelAndRemedy) {
    const TemporaryFolder folder;
    const auto said = [&](float value) {
        VoxelVolume image = three_labels();
        image.values[image.index(2, 3, 1)] = value;
        write_volume(image, folder / "v.nrrd");
        return refusal(folder / "v.nrrd");
    };
    EXPECT_NE(said(2.5F).find("v.nrrd: has the value 2.5 at voxel 2,3,1, which is no whole"),
              std::string::npos);
    EXPECT_NE(said(std::nanf("")).find("nan at voxel 2,3,1"), std::string::npos);
    EXPECT_NE(said(INFINITY).find("inf at voxel 2,3,1, which is no whole"), std::string::npos);
    // From 2^24 on a float cannot tell neighbouring numbers apart.
    EXPECT_NE(said(16777216.0F).find("beyond the labels that can be read; renumber"),
              std::string::npos);
    EXPECT_NE(said(-16777216.0F).find("renumber"), std::string::npos);
    EXPECT_EQ(said(16777215.0F), "was read");
    EXPECT_EQ(said(-16777215.0F), "was read");
    EXPECT_NE(refusal(folder / "none.nrrd").find("does not exist"), std::string::npos);
    EXPECT_NE(refusal(folder.path() / "none.nii.gz").find("does not exist"), std::string::npos);
}

// --- extents -------------------------------------------------------------------------------------

TEST(LabelExtents, EqualBruteForceInAShearedFrame) {
    SCOPED_TRACE("seed 12");
    std::mt19937 random(12);
    std::discrete_distribution<int> draw({20, 5, 1, 0, 3});
    const VoxelVolume image =
        sampled({13, 9, 8}, sheared_frame(kMm), [&](const Vec3&) { return draw(random); });
    const LabelVolume volume = written_and_read(image);
    const std::vector<LabelExtent> extents = label_extents(volume);
    ASSERT_EQ(extents.size(), 3U);
    const double voxel_mm3 = std::abs(glm::determinant(volume.index_to_scene.linear)) * 1e9;
    for (std::size_t label = 0; label < extents.size(); ++label) {
        std::size_t voxels = 0;
        Box bounds;
        for (int k = 0; k < 8; ++k)
            for (int j = 0; j < 9; ++j)
                for (int i = 0; i < 13; ++i) {
                    if (image.at(i, j, k) != static_cast<float>(volume.labels[label].value))
                        continue;
                    ++voxels;
                    for (int corner = 0; corner < 8; ++corner)
                        bounds.add(volume.index_to_scene.point(
                            Vec3(i, j, k) + 0.5 * Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1,
                                                       corner & 4 ? 1 : -1)));
                }
        EXPECT_EQ(extents[label].voxels, voxels);
        EXPECT_NEAR(extents[label].volume_mm3, voxel_mm3 * static_cast<double>(voxels),
                    1e-12 * static_cast<double>(voxels)); // rounding
        EXPECT_LT(glm::length(extents[label].bounds.lower - bounds.lower), 1e-15);
        EXPECT_LT(glm::length(extents[label].bounds.upper - bounds.upper), 1e-15);
    }
}

// --- finding -------------------------------------------------------------------------------------

LabelVolume named(const std::vector<std::pair<int, std::string>>& labels) {
    LabelVolume volume;
    volume.size = {static_cast<int>(labels.size()), 1, 1};
    volume.layers.resize(1);
    for (const auto& [value, name] : labels) {
        volume.layers[0].push_back(value);
        Label label;
        label.value = value;
        label.name = name;
        volume.labels.push_back(label);
    }
    return volume;
}

std::vector<std::size_t> found_in(const LabelVolume& volume,
                                  const std::vector<std::string>& wanted) {
    return find_labels(volume, wanted);
}

std::string not_found(const LabelVolume& volume, const std::string& wanted) {
    try {
        found_in(volume, {wanted});
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "found";
}

const LabelVolume kBrain = named({{1, "Precentral_L"},
                                  {2, "Precentral_R"},
                                  {37, "Hippocampus_L"},
                                  {38, "Hippocampus_R"},
                                  {40, "cyst"},
                                  {41, "Cyst"},
                                  {42, "cyst"},
                                  {43, "38"}});

TEST(FindLabels, TakesNamesAsTheyStandElseWithoutCaseElseNumbers) {
    using Indices = std::vector<std::size_t>;
    EXPECT_EQ(found_in(kBrain, {"Hippocampus_L"}), (Indices{2}));
    EXPECT_EQ(found_in(kBrain, {"hippocampus_l"}), (Indices{2}));
    EXPECT_EQ(found_in(kBrain, {"37"}), (Indices{2}));
    EXPECT_EQ(found_in(kBrain, {"cyst"}), (Indices{4, 6})); // two of one name, and not "Cyst"
    EXPECT_EQ(found_in(kBrain, {"CYST"}), (Indices{4, 5, 6}));
    EXPECT_EQ(found_in(kBrain, {"38"}), (Indices{7})); // a name goes before a number
    EXPECT_EQ(found_in(kBrain, {"Precentral_R", "1", "2"}), (Indices{1, 0})); // each once
    EXPECT_EQ(found_in(kBrain, {}), Indices{});
}

TEST(FindLabels, SaysWhichNamesAreNearestAndWhichNumbersThereAre) {
    EXPECT_EQ(not_found(kBrain, "Hipocampus_L"),
              "no label is called \"Hipocampus_L\"; did you mean Hippocampus_L, Hippocampus_R or "
              "Precentral_L?");
    EXPECT_EQ(not_found(kBrain, "5"), "no voxel has the label 5; there are 8 labels from 1 to 43");
    EXPECT_EQ(not_found(kBrain, "99999999999"),
              "no voxel has the label 99999999999; there are 8 labels from 1 to 43");
    EXPECT_NE(not_found(kBrain, "").find("did you mean"), std::string::npos);
    EXPECT_EQ(not_found(named({{1, "only"}}), "x"), "no label is called \"x\"; did you mean only?");
    EXPECT_NE(not_found(LabelVolume{}, "x").find("no labels"), std::string::npos);
    EXPECT_LT(not_found(kBrain, std::string(100000, 'x')).size(), 300U);
}

// --- occupancy -----------------------------------------------------------------------------------

TEST(LabelOccupancy, IsOneInTheChosenAndHasItsMarginBeyondTheBorderToo) {
    const VoxelVolume image = three_labels();
    const LabelVolume volume = written_and_read(image);
    for (const auto& chosen :
         std::vector<std::vector<std::size_t>>{{0}, {1}, {2}, {0, 1}, {1, 2}}) {
        const int margin = 2;
        const VoxelVolume occupancy = label_occupancy(volume, chosen, margin);
        std::size_t ones = 0;
        for (int k = 0; k < occupancy.size[2]; ++k)
            for (int j = 0; j < occupancy.size[1]; ++j)
                for (int i = 0; i < occupancy.size[0]; ++i) {
                    const Vec3 index = volume.index_to_scene.inverse().point(
                        occupancy.index_to_scene.point(Vec3(i, j, k)));
                    const auto at = glm::round(index);
                    EXPECT_LT(glm::length(index - at), 1e-9);
                    float expected = 0.0F;
                    if (glm::all(glm::greaterThanEqual(at, Vec3(0.0))) &&
                        glm::all(glm::lessThan(at, Vec3(6, 5, 4)))) {
                        const float value = image.at(static_cast<int>(at.x), static_cast<int>(at.y),
                                                     static_cast<int>(at.z));
                        for (const std::size_t label : chosen)
                            if (value == static_cast<float>(volume.labels[label].value))
                                expected = 1.0F;
                    }
                    EXPECT_EQ(occupancy.at(i, j, k), expected);
                    ones += expected > 0.0F ? 1 : 0;
                    const bool in_margin =
                        i < margin || j < margin || k < margin || i >= occupancy.size[0] - margin ||
                        j >= occupancy.size[1] - margin || k >= occupancy.size[2] - margin;
                    EXPECT_TRUE(!in_margin || occupancy.at(i, j, k) == 0.0F);
                }
        std::size_t expected = 0;
        const auto extents = label_extents(volume);
        for (const std::size_t label : chosen)
            expected += extents[label].voxels;
        EXPECT_EQ(ones, expected);
    }
    EXPECT_EQ(label_occupancy(volume, std::vector<std::size_t>{1}, 0).size,
              (std::array<int, 3>{2, 3, 2}));
}

TEST(LabelOccupancy, RefusesWhatItCannotDo) {
    const LabelVolume volume = written_and_read(three_labels());
    const std::vector<std::size_t> one{0}, none{}, wrong{3};
    EXPECT_THROW(label_occupancy(volume, none, 2), std::invalid_argument);
    EXPECT_THROW(label_occupancy(volume, wrong, 2), std::invalid_argument);
    EXPECT_THROW(label_occupancy(volume, one, -1), std::invalid_argument);
    EXPECT_THROW(label_occupancy(volume, one, 2000000000), std::invalid_argument);
    EXPECT_THROW(label_occupancy(LabelVolume{}, one, 2), std::invalid_argument);
    LabelVolume absent = volume;
    std::fill(absent.layers[0].begin(), absent.layers[0].end(), 0);
    EXPECT_THROW(label_occupancy(absent, one, 2), std::invalid_argument);
}

// --- labels or an image --------------------------------------------------------------------------

TEST(LooksLikeLabels, TellsLabelMapsFromImages) {
    const AffineTransform frame;
    SCOPED_TRACE("seed 8");
    std::mt19937 random(8);
    std::normal_distribution<double> noise(0.0, 12.0);
    const auto radius = [](const Vec3& p) { return glm::length(p - Vec3(20.0)); };
    const auto in_ball = [&](const Vec3& p) { return radius(p) < 15.0; };

    // Shells of three voxels, 300 blocks, a mask, an inverted mask.
    EXPECT_TRUE(looks_like_labels(sampled({41, 41, 41}, frame, [&](const Vec3& p) {
        return in_ball(p) ? 1.0 + std::floor(radius(p) / 3.0) : 0.0;
    })));
    EXPECT_TRUE(looks_like_labels(sampled({41, 41, 41}, frame, [&](const Vec3& p) {
        const Vec3 block = glm::floor(p / 6.0);
        return in_ball(p) ? 1.0 + block.x + 7.0 * block.y + 49.0 * block.z : 0.0;
    })));
    EXPECT_TRUE(looks_like_labels(
        sampled({41, 41, 41}, frame, [&](const Vec3& p) { return in_ball(p) ? 255.0 : 0.0; })));
    EXPECT_TRUE(looks_like_labels(
        sampled({41, 41, 41}, frame, [&](const Vec3& p) { return in_ball(p) ? 0.0 : 1.0; })));

    // MR of 8 bits, CT with a padding of its own, shares, a distance, nothing at all.
    EXPECT_FALSE(looks_like_labels(sampled({41, 41, 41}, frame, [&](const Vec3& p) {
        return in_ball(p) ? std::max(1.0, std::round(100.0 + noise(random))) : 0.0;
    })));
    EXPECT_FALSE(looks_like_labels(sampled({41, 41, 41}, frame, [&](const Vec3& p) {
        return in_ball(p) ? std::round(1064.0 + noise(random)) : 24.0;
    })));
    EXPECT_FALSE(looks_like_labels(sampled({41, 41, 41}, frame, [&](const Vec3& p) {
        return in_ball(p) ? std::round(40.0 + noise(random)) : -1024.0;
    })));
    EXPECT_FALSE(looks_like_labels(
        sampled({41, 41, 41}, frame, [&](const Vec3& p) { return in_ball(p) ? 0.5 : 0.0; })));
    EXPECT_FALSE(looks_like_labels(
        sampled({41, 41, 41}, frame, [&](const Vec3& p) { return std::round(2 * radius(p)); })));
    EXPECT_FALSE(looks_like_labels(sampled({9, 9, 9}, frame, [](const Vec3&) { return 0.0; })));
    EXPECT_FALSE(
        looks_like_labels(sampled({9, 9, 9}, frame, [](const Vec3&) { return std::nan(""); })));
    EXPECT_FALSE(looks_like_labels(VoxelVolume{}));
}

// Of neighbours there are none to be equal: spots of noise, as far as anybody can tell.
TEST(LooksLikeLabels, SpotsOfWhichNoneIsBesideAnotherAreNoLabels) {
    VoxelVolume volume = sampled({9, 9, 9}, AffineTransform{}, [](const Vec3&) { return 0.0; });
    volume.values[volume.index(2, 2, 2)] = 1.0F;
    volume.values[volume.index(4, 4, 4)] = 2.0F;
    volume.values[volume.index(6, 2, 6)] = 1.0F;
    EXPECT_FALSE(looks_like_labels(volume));
    volume.values[volume.index(3, 2, 2)] = 1.0F; // a pair of equal ones
    EXPECT_TRUE(looks_like_labels(volume));
}

TEST(LooksLikeLabels, LooksAllOverALargeVolume) {
    // 7.7 million voxels: more than are looked at. Only the last tenth of the slices has values.
    const std::array<int, 3> size{320, 240, 100};
    VoxelVolume volume = sampled(size, AffineTransform{}, [](const Vec3&) { return 0.0; });
    SCOPED_TRACE("seed 9");
    std::mt19937 random(9);
    std::uniform_int_distribution<int> gray(1, 200);
    for (int k = 90; k < 100; ++k)
        for (int j = 0; j < 240; ++j)
            for (int i = 0; i < 320; ++i)
                volume.values[volume.index(i, j, k)] = static_cast<float>(gray(random));
    EXPECT_FALSE(looks_like_labels(volume));
    for (int k = 90; k < 100; ++k)
        for (int j = 0; j < 240; ++j)
            for (int i = 0; i < 320; ++i)
                volume.values[volume.index(i, j, k)] = static_cast<float>(1 + i / 10);
    EXPECT_TRUE(looks_like_labels(volume));
}

} // namespace
} // namespace palpate
