// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/label_filters.h>
#include <palpate/volume/label_volume.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/label_gaps.h"

// The atlases of MRIcron, where they are: PALPATE_REAL_DATA names their folder (Debian's
// mricron-data puts them into /usr/share/mricron/templates).
namespace palpate {
namespace {

using test::gaps_between;
using test::LabelGaps;
using test::LabelSurface;
using test::quantile;
using test::smoothed_label;
using test::Smoothing;

constexpr double kSigma = 1.0; // voxels

std::filesystem::path data_file(const std::string& name) {
    const char* const folder = std::getenv("PALPATE_REAL_DATA");
    return folder == nullptr ? std::filesystem::path() : std::filesystem::path(folder) / name;
}

class Aal : public testing::Test {
protected:
    static void SetUpTestSuite() {
        const std::filesystem::path file = data_file("aal.nii.gz");
        if (std::filesystem::exists(file)) volume_ = read_label_volume(file);
    }
    static void TearDownTestSuite() { volume_.reset(); }
    void SetUp() override {
        if (!volume_)
            GTEST_SKIP() << "PALPATE_REAL_DATA names no folder with aal.nii.gz (mricron-data)";
    }

    static std::size_t label(const std::string& name) {
        return find_labels(*volume_, std::vector<std::string>{name}).at(0);
    }

    static inline std::optional<LabelVolume> volume_;
};

TEST_F(Aal, HasItsNamesFromTheTableBesideIt) {
    ASSERT_EQ(volume_->labels.size(), 116U);
    EXPECT_EQ(volume_->labels[0].name, "Precentral_L");
    EXPECT_EQ(volume_->labels[36].name, "Hippocampus_L");
    EXPECT_EQ(volume_->labels[115].name, "Vermis_10");
    // Its voxels are 1 mm.
    EXPECT_EQ(label_extents(*volume_)[label("Hippocampus_L")].voxels, 7469U);
    EXPECT_NEAR(label_extents(*volume_)[label("Hippocampus_L")].volume_mm3, 7469.0, 1e-3);
}

TEST_F(Aal, SmoothedStructuresKeepTheirVolumeAndLoseNoPart) {
    for (const char* name : {"Hippocampus_L", "Thalamus_L", "Putamen_L"}) {
        const LabelSurface surface = smoothed_label(*volume_, label(name), kSigma);
        const double wanted = 1e-9 * label_extents(*volume_)[label(name)].volume_mm3;
        EXPECT_NEAR(volume_above(surface.field, surface.level), wanted, 1e-4 * wanted) << name;
        EXPECT_GT(surface.level, 0.45) << name;
        EXPECT_LT(surface.level, 0.52) << name;
        const std::vector<std::size_t> chosen{label(name)};
        const VoxelVolume occupancy = label_occupancy(*volume_, chosen, 6);
        ASSERT_EQ(occupancy.size, surface.field.size);
        EXPECT_TRUE(thin_parts(occupancy, surface.field, surface.level).empty()) << name;
    }
}

struct Pair {
    const char* a;
    const char* b;
};

class AalNeighbours : public Aal, public testing::WithParamInterface<Pair> {};

TEST_P(AalNeighbours, KeepTouching) {
    const std::size_t a = label(GetParam().a);
    const std::size_t b = label(GetParam().b);
    const auto gaps_with = [&](Smoothing smoothing) {
        return gaps_between(*volume_, a, b, smoothed_label(*volume_, a, kSigma, smoothing),
                            smoothed_label(*volume_, b, kSigma, smoothing));
    };
    const auto wide_share = [](const LabelGaps& gaps) {
        double wide = 0.0;
        for (const auto* distances : {&gaps.near_third, &gaps.near_background})
            for (const double gap : *distances)
                wide += gap > 0.5 ? 1.0 : 0.0;
        return wide / static_cast<double>(gaps.near_third.size() + gaps.near_background.size());
    };
    const LabelGaps gaps = gaps_with(Smoothing::against_neighbours);
    // With nothing but the two within a voxel: no gap of half a voxel anywhere.
    ASSERT_GT(gaps.between_two.size(), 1000U);
    EXPECT_LE(gaps.between_two.back(), 0.5);
    EXPECT_LE(quantile(gaps.between_two, 0.99), 0.0);
    // With another one there, that one may take the place of a tip that is rounded off: measured in
    // 3 to 8 of 100 points, of plain Gaussians in 19 to 32.
    EXPECT_LT(wide_share(gaps), 0.1);
    EXPECT_LT(wide_share(gaps), 0.5 * wide_share(gaps_with(Smoothing::plain_gaussian)));
}

INSTANTIATE_TEST_SUITE_P(Neighbours, AalNeighbours,
                         testing::Values(Pair{"Putamen_L", "Pallidum_L"},
                                         Pair{"Precentral_L", "Postcentral_L"},
                                         Pair{"Hippocampus_L", "ParaHippocampal_L"}),
                         [](const auto& tested) { return std::string(tested.param.a); });

TEST(RealData, AtlasesLookLikeLabelsAndScansDoNot) {
    const std::vector<std::pair<const char*, bool>> files{
        {"aal.nii.gz", true},
        {"AICHAmc.nii.gz", true},
        {"HarvardOxford-cort-maxprob-thr0-1mm.nii.gz", true},
        {"JHU-WhiteMatter-labels-2mm.nii.gz", true},
        {"inia19-NeuroMaps.nii.gz", true},
        {"ch2.nii.gz", false},
        {"ch2bet.nii.gz", false},
        {"ch2better.nii.gz", false}};
    int seen = 0;
    for (const auto& [name, labels] : files) {
        const std::filesystem::path file = data_file(name);
        if (!std::filesystem::exists(file)) continue;
        ++seen;
        EXPECT_EQ(looks_like_labels(read_volume(file)), labels) << name;
    }
    if (seen == 0) GTEST_SKIP() << "PALPATE_REAL_DATA names no folder with mricron-data's volumes";
}

} // namespace
} // namespace palpate
