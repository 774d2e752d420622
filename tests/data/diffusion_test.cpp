// SPDX-License-Identifier: Apache-2.0
// Vectors of a real head: what is known of white matter says whether their frame is read rightly.
#include <palpate/volume/vector_volume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/volume/fields/grid_vector_field.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

constexpr double kMm = 1e-3;

// Fractional anisotropy of bundles where one direction dominates; above 1 it is noise at the rim.
constexpr float kBundle = 0.5F;
constexpr float kFibre = 0.3F;
constexpr float kNoise = 1.0F;

/// Principal directions and anisotropy of one head, by FSL's dtifit: dti_V1.nii.gz, dti_FA.nii.gz.
struct Head {
    VectorVolume directions;
    VoxelVolume anisotropy;
    double midline_m = 0.0; ///< x of the plane between the hemispheres: middle of what is a fibre

    Vec3 direction(std::size_t voxel) const {
        return {directions.values[3 * voxel], directions.values[3 * voxel + 1],
                directions.values[3 * voxel + 2]};
    }
    bool above(std::size_t voxel, float threshold) const {
        const float value = anisotropy.values[voxel];
        return value > threshold && value < kNoise && squared_length(direction(voxel)) > 0.25;
    }
};

std::filesystem::path data_folder() {
    const char* const folder = std::getenv("PALPATE_REAL_DATA");
    return folder == nullptr ? "" : folder;
}

class Diffusion : public testing::Test {
protected:
    void SetUp() override {
        const std::filesystem::path folder = data_folder();
        if (folder.empty()) GTEST_SKIP() << "PALPATE_REAL_DATA names no folder";
        const auto file = folder / "dti_V1.nii.gz", beside = folder / "dti_FA.nii.gz";
        if (!std::filesystem::exists(file) || !std::filesystem::exists(beside))
            GTEST_SKIP() << file << " and dti_FA.nii.gz are not there; get them with "
                         << "scripts/fetch_data.sh " << folder << " diffusion";
        head_.directions = read_vector_volume(file);
        head_.anisotropy = read_volume(beside);
        ASSERT_EQ(head_.directions.size, head_.anisotropy.size);
        Box fibres;
        each_voxel([&](std::size_t voxel, const Vec3& point) {
            if (head_.above(voxel, 0.2F)) fibres.add(point);
        });
        head_.midline_m = fibres.center().x;
    }

    /// visit(voxel number, scene point)
    template <class Visit>
    void each_voxel(const Visit& visit) const {
        const auto& size = head_.anisotropy.size;
        for (int k = 0; k < size[2]; ++k)
            for (int j = 0; j < size[1]; ++j)
                for (int i = 0; i < size[0]; ++i)
                    visit(head_.anisotropy.index(i, j, k),
                          head_.anisotropy.index_to_scene.point(Vec3(i, j, k)));
    }

    /// Share of the bundles' voxels with wanted(point, midline at x = 0; direction) whose direction
    /// has its largest component along `axis`.
    template <class Wanted>
    double share_along(int axis, const Wanted& wanted) const {
        int all = 0, along = 0;
        each_voxel([&](std::size_t voxel, Vec3 point) {
            point.x -= head_.midline_m;
            if (!head_.above(voxel, kBundle) || !wanted(point)) return;
            const Vec3 d = glm::abs(head_.direction(voxel));
            ++all;
            if (d[axis] >= std::max({d.x, d.y, d.z})) ++along;
        });
        EXPECT_GT(all, 100) << "the region is empty: the head lies elsewhere";
        return static_cast<double>(along) / std::max(all, 1);
    }

    /// Pairs of neighbouring fibre voxels that continue each other when every direction's
    /// components are multiplied by `signs`: the step between them and both directions within 30
    /// degrees.
    int continued_pairs(const Vec3& signs) const {
        const double close = std::cos(30.0 * std::acos(-1.0) / 180.0);
        const auto& size = head_.anisotropy.size;
        const Mat3& axes = head_.anisotropy.index_to_scene.linear;
        int pairs = 0;
        for (int neighbour = 14; neighbour < 27; ++neighbour) { // one of each two opposite ones
            const std::array<int, 3> step{neighbour % 3 - 1, neighbour / 3 % 3 - 1,
                                          neighbour / 9 - 1};
            const Vec3 way = glm::normalize(axes * Vec3(step[0], step[1], step[2]));
            for (int k = 0; k + step[2] < size[2]; ++k)
                for (int j = std::max(0, -step[1]); j < size[1] - std::max(0, step[1]); ++j)
                    for (int i = std::max(0, -step[0]); i < size[0] - std::max(0, step[0]); ++i) {
                        const std::size_t a = head_.anisotropy.index(i, j, k);
                        const std::size_t b =
                            head_.anisotropy.index(i + step[0], j + step[1], k + step[2]);
                        if (!head_.above(a, kFibre) || !head_.above(b, kFibre)) continue;
                        const Vec3 p = signs * head_.direction(a), q = signs * head_.direction(b);
                        if (std::abs(glm::dot(p, way)) > close &&
                            std::abs(glm::dot(q, way)) > close && std::abs(glm::dot(p, q)) > close)
                            ++pairs;
                    }
        }
        return pairs;
    }

    Head head_;
};

TEST_F(Diffusion, TheHeadsVectorsAreUnitVectorsInTheImagesAxes) {
    EXPECT_EQ(head_.directions.kind, VectorVolume::Kind::vector);
    EXPECT_NE(head_.directions.frame.find("as FSL writes them"), std::string::npos);
    double longest = 0.0;
    each_voxel([&](std::size_t voxel, const Vec3&) {
        longest = std::max(longest, squared_length(head_.direction(voxel)));
    });
    EXPECT_NEAR(longest, 1.0, 1e-6); // float components
}

TEST_F(Diffusion, TheCorpusCallosumRunsFromLeftToRight) {
    // Its body crosses the midline 20 to 40 mm above the origin. Measured: 0.89 of 245 voxels.
    EXPECT_GT(share_along(0,
                          [](const Vec3& p) {
                              return std::abs(p.x) < 4.0 * kMm && p.z > 20.0 * kMm &&
                                     p.z < 40.0 * kMm;
                          }),
              0.8);
}

TEST_F(Diffusion, TheCorticospinalTractRunsFromInferiorToSuperior) {
    // In the internal capsule's posterior limb, on both sides. Measured: 0.82 of 614 voxels.
    EXPECT_GT(share_along(2,
                          [](const Vec3& p) {
                              const double x = std::abs(p.x);
                              return x > 15.0 * kMm && x < 30.0 * kMm && p.y > -5.0 * kMm &&
                                     p.y < 25.0 * kMm && p.z > 0.0 && p.z < 20.0 * kMm;
                          }),
              0.7);
}

TEST_F(Diffusion, FibresOfTheCoronaRadiataLeanOutwardsGoingUpInBothHemispheres) {
    // x times vx vz is positive there, x from the midline; with x reversed it would be negative.
    // Measured at z from 20 to 30 mm: positive in 0.87 of 283 voxels on one side, 0.82 of 160.
    for (const double side : {-1.0, 1.0}) {
        int all = 0, outwards = 0;
        each_voxel([&](std::size_t voxel, const Vec3& point) {
            const double x = side * (point.x - head_.midline_m);
            const Vec3 d = head_.direction(voxel);
            if (!head_.above(voxel, kBundle) || x < 10.0 * kMm || x > 45.0 * kMm ||
                point.z < 20.0 * kMm || point.z > 30.0 * kMm || std::abs(d.z) < 0.7)
                return;
            ++all;
            if (side * d.x * d.z > 0.0) ++outwards;
        });
        EXPECT_GT(all, 100);
        EXPECT_GT(static_cast<double>(outwards) / std::max(all, 1), 0.7) << "side " << side;
    }
}

TEST_F(Diffusion, FibresContinueEachOtherBestAsTheyAreRead) {
    // A wrong sign of any one axis breaks bundles that run obliquely. Measured: 41892 pairs, and
    // 34360, 37098, 35218 with x, y, z reversed.
    const int as_read = continued_pairs(Vec3(1.0));
    EXPECT_GT(as_read, 30000);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 signs(1.0);
        signs[axis] = -1.0;
        EXPECT_LT(continued_pairs(signs), 0.95 * as_read) << "axis " << axis;
    }
}

/// Where the proxy goes when a hand gives way to the guide: it stays 0.4 mm above the proxy for
/// 250 frames, then below it, and so pulls across the fibre with at most 0.2 N of its 3 N.
std::vector<Vec3> followed(const std::shared_ptr<const VectorField>& fibres, const Vec3& start) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<VectorFollow>(fibres, TransferFunction::constant(3.0)));
    test::ContactLoop loop({}, {}, std::move(effects));
    loop.start(start);
    std::vector<Vec3> trace;
    for (int frame = 0; frame < 500; ++frame) {
        loop.move(loop.proxy() + Vec3{0, 0, frame < 250 ? 0.4 * kMm : -0.4 * kMm});
        trace.push_back(loop.proxy());
    }
    return trace;
}

// From the internal capsule's posterior limb, where the tract is an upright bundle, through the
// corona radiata towards the cortex, and back. A direction and its opposite are the same fibre,
// whatever sign the file gives each voxel.
TEST_F(Diffusion, TheCorticospinalTractIsFollowedWhateverTheSigns) {
    std::vector<Vec3> seeds;
    each_voxel([&](std::size_t voxel, const Vec3& point) {
        const double aside = std::abs(point.x - head_.midline_m);
        if (aside > 18 * kMm && aside < 28 * kMm && point.y > 5 * kMm && point.y < 20 * kMm &&
            point.z > 0.0 && point.z < 15 * kMm && head_.above(voxel, 0.6F) &&
            std::abs(head_.direction(voxel).z) > 0.9)
            seeds.push_back(point);
    });
    ASSERT_GT(seeds.size(), 20u);

    VectorVolume flipped = head_.directions;
    std::mt19937 random(3);
    for (std::size_t voxel = 0; voxel < flipped.voxels(); ++voxel)
        if (random() % 2)
            for (std::size_t c = 0; c < 3; ++c)
                flipped.values[3 * voxel + c] = -flipped.values[3 * voxel + c];
    const auto fibres = std::make_shared<GridVectorField>(head_.directions, VectorSense::axial);
    const auto reversed = std::make_shared<GridVectorField>(flipped, VectorSense::axial);
    const auto sampler = fibres->make_sampler();

    std::vector<double> climbs;
    double along = 0.0, length = 0.0;
    for (const Vec3& seed : seeds) {
        const std::vector<Vec3> trace = followed(fibres, seed);
        EXPECT_EQ(followed(reversed, seed), trace);
        double top = seed.z;
        for (std::size_t i = 1; i < trace.size(); ++i) {
            top = std::max(top, trace[i].z);
            const Vec3 step = trace[i] - trace[i - 1];
            const VectorSample here = sampler->sample(0.5 * (trace[i] + trace[i - 1]));
            length += glm::length(step);
            if (here.valid) along += std::abs(glm::dot(step, glm::normalize(here.value)));
        }
        climbs.push_back(top - seed.z);
    }
    std::sort(climbs.begin(), climbs.end());
    RecordProperty("seeds", std::to_string(seeds.size()));
    RecordProperty("median_climb_mm", std::to_string(1e3 * climbs[climbs.size() / 2]));
    RecordProperty("share_along", std::to_string(along / length));
    EXPECT_GT(climbs[climbs.size() / 2], 25 * kMm);
    EXPECT_GT(along, 0.99 * length);
}

} // namespace
} // namespace palpate
