// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/grid_field.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/geometry/patient_size.h>

#include <tests/support/grid_cases.h>

namespace palpate {
namespace {

using test::all_frames;
using test::DenseReference;
using test::kBackground;
using test::kValueRounding;
using test::NamedFrame;
using test::noise;
using test::point_with_data;
using test::random_point;

double largest(const Mat3& m) {
    double value = 0.0;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            value = std::max(value, std::abs(m[column][row]));
    return value;
}

TEST(GridField, SampleEqualsTheDenseReference) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 1");
        std::mt19937_64 random(1);
        const VoxelVolume volume = noise({19, 23, 14}, f.frame, 1);
        const GridField field(volume, kBackground);
        const DenseReference reference(volume, kBackground);
        const auto sampler = field.make_sampler();
        for (int n = 0; n < 3000; ++n) {
            const Vec3 p = point_with_data(random, volume);
            const FieldSample s = sampler->sample(p);
            const FieldSample r = reference.sample(p);
            ASSERT_TRUE(s.valid);
            ASSERT_NEAR(s.value, r.value, kValueRounding);
            // Per metre: a step is at least 0.7 mm, so 1500 per m and once more for the Hessian;
            // some terms each.
            ASSERT_LT(glm::length(s.slope - r.slope), kValueRounding * 1e4);
            ASSERT_LT(glm::length(s.gradient - r.gradient), kValueRounding * 1e4);
            ASSERT_LT(largest(s.hessian - r.hessian), kValueRounding * 1e8);
        }
    }
}

TEST(GridField, ValueAndSampleAgreeToTheBit) {
    const VoxelVolume volume = noise({12, 9, 20}, all_frames()[1].frame, 2);
    const GridField field(volume, kBackground);
    const auto sampler = field.make_sampler();
    const auto other = field.make_sampler();
    SCOPED_TRACE("seed 2");
    std::mt19937_64 random(2);
    for (int n = 0; n < 5000; ++n) {
        const Vec3 p = point_with_data(random, volume);
        ASSERT_EQ(sampler->sample(p).value, other->value(p));
        ASSERT_EQ(sampler->sample(p).value, sampler->sample(p).value); // from the kept cell
    }
    EXPECT_EQ(sampler->samples(), 15'000U);
}

TEST(GridField, NodesKeepTheirValuesAcrossLeavesAndTiles) {
    // Blocks of one value become tiles of the tree, others leaves: 40 nodes are five leaves.
    const AffineTransform frame = all_frames()[0].frame;
    VoxelVolume volume = noise({40, 33, 17}, frame, 3);
    for (int k = 0; k < 17; ++k)
        for (int j = 0; j < 33; ++j)
            for (int i = 0; i < 40; ++i) {
                if (i >= 8 && i < 24)
                    volume.values[volume.index(i, j, k)] = 500.0F; // tiles of a value
                if (i >= 24 && i < 34)
                    volume.values[volume.index(i, j, k)] = kBackground; // tiles of background
            }
    const GridField field(volume, kBackground);
    const DenseReference reference(volume, kBackground);
    const auto sampler = field.make_sampler();
    SCOPED_TRACE("seed 3");
    std::mt19937_64 random(3);
    for (int n = 0; n < 20'000; ++n) {
        const Vec3 p = point_with_data(random, volume);
        ASSERT_NEAR(sampler->value(p), reference.value(p), kValueRounding);
        ASSERT_LT(glm::length(sampler->sample(p).gradient - reference.sample(p).gradient),
                  kValueRounding * 1e4);
    }
}

TEST(GridField, DerivativesAreThoseOfFiniteDifferencesInsideCells) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 4");
        std::mt19937_64 random(4);
        const VoxelVolume volume = noise({10, 11, 12}, f.frame, 4);
        const GridField field(volume, kBackground);
        const auto sampler = field.make_sampler();
        std::uniform_real_distribution<double> inner(0.05, 0.95);
        for (int n = 0; n < 1000; ++n) {
            const Vec3 cell(static_cast<double>(random() % 9), static_cast<double>(random() % 10),
                            static_cast<double>(random() % 11));
            const Vec3 p = f.frame.point(cell + Vec3(inner(random), inner(random), inner(random)));
            const FieldSample s = sampler->sample(p);
            const double h = 1e-6; // m, a thousandth of a cell: stays inside
            for (int a = 0; a < 3; ++a) {
                Vec3 step(0.0);
                step[a] = h;
                const FieldSample above = sampler->sample(p + step),
                                  below = sampler->sample(p - step);
                // Third derivatives: 8 corners of 900 U over (0.7 mm)^3, 2e13 U/m^3, times h^2/6;
                // rounding 1e-9 / h is smaller. The same for the gradient, over one step more:
                // relative to its 1e9 U/m^2 alike.
                ASSERT_NEAR((above.value - below.value) / (2.0 * h), s.slope[a], 10.0);
                const Vec3 by_a = (above.gradient - below.gradient) / (2.0 * h);
                ASSERT_LT(glm::length(by_a - s.hessian[a]), 2e4);
            }
        }
    }
}

TEST(GridField, GradientIsContinuousAcrossFacesAndSlopeJumps) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 5");
        std::mt19937_64 random(5);
        const VoxelVolume volume = noise({10, 11, 12}, f.frame, 5);
        const GridField field(volume, kBackground);
        const auto sampler = field.make_sampler();
        double largest_jump = 0.0;
        for (int n = 0; n < 1000; ++n) {
            Vec3 index = random_point(random, {Vec3(0.0), Vec3(9.0, 10.0, 11.0)});
            const int axis = static_cast<int>(random() % 3);
            index[axis] = std::round(index[axis]);
            Vec3 off(0.0);
            off[axis] = 1e-9;
            const FieldSample above = sampler->sample(f.frame.point(index + off));
            const FieldSample below = sampler->sample(f.frame.point(index - off));
            // 2e-9 of a step times node differences of 2000 U, per step of 0.7 mm: 6 U/m of 1e6
            ASSERT_LT(std::abs(above.value - below.value), 1e-5);
            ASSERT_LT(glm::length(above.gradient - below.gradient), 100.0);
            largest_jump = std::max(largest_jump, glm::length(above.slope - below.slope));
        }
        EXPECT_GT(largest_jump,
                  1e5); // noise: slopes of 1e6 U/m on either side have nothing in common
    }
}

TEST(GridField, GradientOfALinearFieldIsItsGradient) {
    const Vec3 steepness(3e5, -2e5, 1e5); // U/m
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 6");
        std::mt19937_64 random(6);
        const Vec3 origin = f.frame.offset;
        const VoxelVolume volume = test::sampled(
            {9, 9, 9}, f.frame, [&](const Vec3& p) { return glm::dot(steepness, p - origin); });
        const GridField field(volume, -1e5F);
        const auto sampler = field.make_sampler();
        for (int n = 0; n < 500; ++n) {
            const Vec3 p = f.frame.point(random_point(random, {Vec3(1.0), Vec3(7.0)}));
            const FieldSample s = sampler->sample(p);
            // Nodes of up to 8000 U in float err by 2.5e-4; over a step of 0.7 mm, some terms
            ASSERT_LT(glm::length(s.slope - steepness), 3.0);
            ASSERT_LT(glm::length(s.gradient - steepness), 3.0);
        }
    }
}

TEST(GridField, OutsideIsBackgroundWithoutData) {
    const AffineTransform frame = all_frames()[1].frame;
    const VoxelVolume volume = noise({5, 6, 7}, frame, 7);
    const GridField field(volume, kBackground);
    const auto sampler = field.make_sampler();
    for (int axis = 0; axis < 3; ++axis)
        for (const double index :
             {-1.0001, -1.7, -2.5, -9.0, -1e6, 0.0001, 0.7, 1.5, 9.0, 1e6, 1e200}) {
            Vec3 p(2.0);
            p[axis] = index < -1.0 ? index : volume.size[static_cast<std::size_t>(axis)] + index;
            const FieldSample s = sampler->sample(frame.point(p));
            EXPECT_FALSE(s.valid) << index;
            EXPECT_EQ(s.value, kBackground);
            EXPECT_EQ(s.slope, Vec3(0.0));
            EXPECT_EQ(s.gradient, Vec3(0.0));
            EXPECT_EQ(sampler->value(frame.point(p)), kBackground);
        }
    EXPECT_TRUE(sampler->sample(frame.point({-0.99, 2.0, 2.0})).valid);
    EXPECT_FALSE(sampler->sample(Vec3(std::nan(""))).valid);
    EXPECT_EQ(sampler->value(Vec3(std::nan(""))), kBackground);
}

TEST(GridField, VoxelsMayBeAsSmallAsTheyAreTaken) {
    const AffineTransform frame{Mat3(PatientSize::kSmallestVoxel), Vec3(0.0)};
    const VoxelVolume volume = noise({6, 6, 6}, frame, 9);
    const GridField field(volume, kBackground);
    EXPECT_NEAR(field.make_sampler()->value(frame.point({2.0, 3.0, 4.0})), volume.at(2, 3, 4),
                kValueRounding);
}

TEST(GridField, BadVoxelsBecomeBackgroundAndAreCounted) {
    VoxelVolume volume = noise({12, 12, 12}, all_frames()[2].frame, 8);
    for (int k = 4; k < 8; ++k)
        for (int j = 4; j < 8; ++j)
            for (int i = 4; i < 8; ++i)
                volume.values[volume.index(i, j, k)] = i % 2 == 0 ? std::nanf("") : HUGE_VALF;
    const GridField field(volume, kBackground);
    EXPECT_EQ(field.replaced_voxels(), 64U);
    const DenseReference reference(volume, kBackground);
    const auto sampler = field.make_sampler();
    const auto at = [&](const Vec3& index) {
        return sampler->sample(volume.index_to_scene.point(index));
    };
    EXPECT_FALSE(at(Vec3(5.5)).valid); // all corners are bad
    EXPECT_EQ(at(Vec3(5.5)).value, kBackground);
    EXPECT_TRUE(at(Vec3(3.5)).valid); // one corner is
    SCOPED_TRACE("seed 8");
    std::mt19937_64 random(8);
    for (int n = 0; n < 5000; ++n) {
        const Vec3 p = point_with_data(random, volume);
        const FieldSample s = sampler->sample(p);
        ASSERT_TRUE(std::isfinite(s.value) && is_finite(s.slope) && is_finite(s.gradient));
        ASSERT_NEAR(s.value, reference.value(p), kValueRounding);
    }
}

TEST(GridField, OneVoxelIsAField) {
    VoxelVolume volume;
    volume.size = {1, 1, 1};
    volume.values = {100.0F};
    volume.index_to_scene.linear = 1e-3 * Mat3(1.0);
    const GridField field(volume, 0.0F);
    const auto sampler = field.make_sampler();
    EXPECT_EQ(sampler->value(Vec3(0.0)), 100.0);
    EXPECT_NEAR(sampler->value({0.5e-3, 0.0, 0.0}), 50.0, 1e-11);
    const std::optional<double> t = sampler->first_root({-0.01, 0.0, 0.0}, {0.01, 0.0, 0.0}, 25.0);
    ASSERT_TRUE(t);
    EXPECT_NEAR(-0.01 + *t * 0.02, -0.75e-3, 1e-15);
    EXPECT_GT(field.typical_slope(50.0), 0.0);
}

TEST(GridField, TypicalSlopeIsTheSlopeAtTheLevel) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name);
        const Vec3 middle = test::middle_of({40, 40, 30}, f.frame);
        const VoxelVolume volume = test::sampled({40, 40, 30}, f.frame, [&](const Vec3& p) {
            return 4e5 * (9e-3 - glm::length(p - middle));
        });
        const GridField field(volume, -1e5F);
        EXPECT_NEAR(field.typical_slope(0.0), 4e5,
                    4e3); // 1 %: chords of a sphere of 9 mm across cells of 1.6 mm
        EXPECT_EQ(field.typical_slope(1e6), 0.0);
    }
}

TEST(GridField, TypicalSlopeMissesNoCellWhereverBlocksBegin) {
    // One voxel of 1 in nothing, at each place of two blocks: the level passes the eight cells
    // around it. In each the slope is that of the corner, 0.25 along each axis at the middle.
    constexpr double kSpacing_m = 1e-3;
    const double slope = 0.25 * std::sqrt(3.0) / kSpacing_m;
    for (int axis = 0; axis < 3; ++axis)
        for (int at = 1; at < 18; ++at) {
            VoxelVolume volume;
            volume.size = {20, 20, 20};
            volume.values.assign(volume.voxels(), 0.0F);
            volume.index_to_scene.linear = kSpacing_m * Mat3(1.0);
            std::array<int, 3> voxel{8, 7, 9};
            voxel[static_cast<std::size_t>(axis)] = at;
            volume.values[volume.index(voxel[0], voxel[1], voxel[2])] = 1.0F;
            const GridField field(volume, 0.0F);
            EXPECT_NEAR(field.typical_slope(0.5), slope, 1e-12 * slope) << axis << " " << at;
            EXPECT_EQ(field.typical_slope(0.5), field.typical_slope(0.5));
            EXPECT_EQ(field.typical_slope(2.0), 0.0);
        }
}

TEST(GridField, TypicalSlopeOfManyCellsIsThinnedEvenly) {
    // 96^3 cells of noise pass the level: far more than are kept; the median must be that of all,
    // whichever half is looked at.
    const VoxelVolume large = noise({96, 96, 96}, all_frames()[0].frame, 13);
    const VoxelVolume small = noise({46, 46, 46}, all_frames()[0].frame, 14);
    const double of_large = GridField(large, kBackground).typical_slope(0.0);
    const double of_small = GridField(small, kBackground).typical_slope(0.0);
    // The median of 1e5 slopes of relative spread 0.4 errs by 0.4 * 1.25 / sqrt(1e5) = 0.16 %; six
    // of that
    EXPECT_NEAR(of_large / of_small, 1.0, 0.01);
}

TEST(GridField, TellsItsScaleAndBounds) {
    const AffineTransform frame = all_frames()[1].frame;
    const VoxelVolume volume = noise({5, 6, 7}, frame, 15);
    const GridField field(volume, kBackground);
    EXPECT_NEAR(field.feature_size_m(), 0.7e-3, 1e-15);
    EXPECT_EQ(field.patch_cosine(), 0.9);
    const Box box = field.bounds();
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 p =
            frame.point(Vec3((corner & 1) != 0 ? 4.0 : 0.0, (corner & 2) != 0 ? 5.0 : 0.0,
                             (corner & 4) != 0 ? 6.0 : 0.0));
        for (int a = 0; a < 3; ++a) {
            EXPECT_GT(p[a], box.lower[a]);
            EXPECT_LT(p[a], box.upper[a]);
        }
    }
}

TEST(GridField, RefusesWhatIsNoVolume) {
    const VoxelVolume good = noise({4, 4, 4}, all_frames()[0].frame, 16);
    VoxelVolume bad = good;
    bad.size = {4, 0, 4};
    EXPECT_THROW(GridField(bad, 0.0F), std::invalid_argument);
    bad = good;
    bad.values.pop_back();
    EXPECT_THROW(GridField(bad, 0.0F), std::invalid_argument);
    bad = good;
    bad.index_to_scene.linear[2] = bad.index_to_scene.linear[0] + bad.index_to_scene.linear[1];
    EXPECT_THROW(GridField(bad, 0.0F), std::invalid_argument);
    bad = good;
    bad.index_to_scene.offset.x = std::nan("");
    EXPECT_THROW(GridField(bad, 0.0F), std::invalid_argument);
    EXPECT_THROW(GridField(good, std::nanf("")), std::invalid_argument);
    EXPECT_THROW(GridField(good, kBackground).preview(kBackground), std::invalid_argument);
}

} // namespace
} // namespace palpate
