// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/grid_field.h>

#include <cfenv>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include <tests/support/grid_cases.h>

namespace palpate {
namespace {

using test::all_frames;
using test::kBackground;
using test::kValueRounding;
using test::NamedFrame;
using test::noise;
using test::point_with_data;
using test::random_direction;
using test::random_point;

/// Segments of 1 um to 100 mm in and around a volume; some along axes, in faces, along edges,
/// through nodes.
std::pair<Vec3, Vec3> random_segment(std::mt19937_64& random, const VoxelVolume& volume) {
    const Vec3 n(volume.size[0], volume.size[1], volume.size[2]);
    Vec3 from = random_point(random, {Vec3(-2.5), n + 1.5});
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    Vec3 along = std::pow(10.0, -3.0 + 5.0 * unit(random)) * random_direction(random);
    const std::uint64_t kind = random() % 8;
    for (int a = 0; a < 3; ++a) {
        if (kind < 3 && (random() % 2 == 0 || a == static_cast<int>(kind)))
            from[a] = std::round(from[a]);
        if (kind < 5 && random() % 2 == 0) along[a] = 0.0;
        if (kind == 2) along[a] = std::round(along[a]);
    }
    return {volume.index_to_scene.point(from), volume.index_to_scene.point(from + along)};
}

/// Checks a root against 300 samples before it, and the value at it.
void expect_first_root(FieldSampler& sampler, const Vec3& from, const Vec3& to, double level,
                       double rounding) {
    const auto value = [&](const Vec3& p) { return sampler.value(p); };
    const std::optional<double> t = sampler.first_root(from, to, level);
    if (value(from) >= level) {
        ASSERT_EQ(t, std::optional<double>(0.0));
        return;
    }
    ASSERT_LT(test::highest_sampled(value, from, to, t.value_or(1.0), 300), level + rounding);
    if (t) {
        ASSERT_TRUE(*t >= 0.0 && *t <= 1.0);
        ASSERT_NEAR(value(from + *t * (to - from)), level, rounding);
    }
}

TEST(GridRoot, FirstRootIsFirstAgainstDenseSampling) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 9");
        std::mt19937_64 random(9);
        const VoxelVolume volume = noise({13, 10, 17}, f.frame, 9);
        const GridField field(volume, kBackground);
        const auto sampler = field.make_sampler();
        int found = 0;
        std::feclearexcept(FE_ALL_EXCEPT);
        for (int n = 0; n < 100'000; ++n) {
            const auto [from, to] = random_segment(random, volume);
            // High levels leave small islands, that are easily missed; low ones few gaps.
            const double level = std::uniform_real_distribution<double>(-100.0, 890.0)(random);
            // A position on the segment errs by roundings of 3e-17 m, 4e-14 of a step of 0.7 mm,
            // and of 100 steps times 1e-16; nodes differ by up to 2000 U.
            expect_first_root(*sampler, from, to, level, kValueRounding);
            if (testing::Test::HasFatalFailure()) FAIL() << "case " << n;
            found += sampler->first_root(from, to, level).value_or(0.0) > 0.0;
        }
        EXPECT_GT(found, 4000);
        EXPECT_FALSE(std::fetestexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)); // loops trap them
    }
}

TEST(GridRoot, FirstRootHoldsWhereNodesAreExactlyAtTheLevel) {
    // Two labels and a level that is one of them: whole cells at the level, roots at nodes, edges
    // and faces.
    SCOPED_TRACE("seed 10");
    std::mt19937_64 random(10);
    const VoxelVolume volume = test::sampled({11, 12, 13}, all_frames()[0].frame, [&](const Vec3&) {
        return random() % 3 == 0 ? 1.0 : 0.0;
    });
    const GridField field(volume, -1.0F);
    const auto sampler = field.make_sampler();
    for (int n = 0; n < 20'000; ++n) {
        const auto [from, to] = random_segment(random, volume);
        const double level = n % 2 == 0 ? 1.0 : 0.5;
        const std::optional<double> t = sampler->first_root(from, to, level);
        const auto value = [&](const Vec3& p) { return sampler->value(p); };
        if (value(from) < level) {
            // index coordinates up to 150 rounded to 3e-14, nodes differ by 2
            ASSERT_LT(test::highest_sampled(value, from, to, t.value_or(1.0), 300), level + 1e-12)
                << n;
        }
        if (t) {
            ASSERT_NEAR(value(from + *t * (to - from)), level, value(from) < level ? 1e-12 : 2.0)
                << n;
        }
    }
}

TEST(GridRoot, FirstRootFromFarAway) {
    const AffineTransform frame = all_frames()[1].frame;
    const Vec3 middle = test::middle_of({21, 21, 21}, frame);
    const VoxelVolume volume = test::sampled(
        {21, 21, 21}, frame, [&](const Vec3& p) { return 4e-3 - glm::length(p - middle); });
    const GridField field(volume, -1.0F);
    const auto sampler = field.make_sampler();
    SCOPED_TRACE("seed 11");
    std::mt19937_64 random(11);
    for (int n = 0; n < 500; ++n) {
        const double far =
            std::pow(10.0, std::uniform_real_distribution<double>(-1.0, 6.0)(random));
        const Vec3 from = middle + far * random_direction(random);
        const std::optional<double> t = sampler->first_root(from, middle, 0.0);
        ASSERT_TRUE(t);
        const Vec3 root = from + *t * (middle - from);
        // 4 mm less what a trilinear ball of 1.6 mm cells may lose, and the roundings of a position
        // from far away
        ASSERT_NEAR(glm::length(root - middle), 4e-3, 0.4e-3 + 1e-15 * far);
        ASSERT_NEAR(sampler->value(root), 0.0, 1e-13 + 1e-15 * far);
    }
    EXPECT_FALSE(sampler->first_root(middle + Vec3(1.0), middle + Vec3(1e300), 0.0));
    EXPECT_FALSE(sampler->first_root({1e20, 3.0, 1e20}, {-1e20, 2.0, 1e20}, 0.0));
}

TEST(GridRoot, SegmentsWithoutLengthOrNumbersAreAnswered) {
    const VoxelVolume volume = noise({6, 6, 6}, all_frames()[0].frame, 12);
    const GridField field(volume, kBackground);
    const auto sampler = field.make_sampler();
    SCOPED_TRACE("seed 12");
    std::mt19937_64 random(12);
    for (int n = 0; n < 500; ++n) {
        const Vec3 p = n % 2 == 0 ? point_with_data(random, volume)
                                  : volume.index_to_scene.point(Vec3(n % 6, n % 5, n % 4));
        ASSERT_EQ(sampler->first_root(p, p, 0.0).has_value(), sampler->value(p) >= 0.0);
    }
    EXPECT_FALSE(sampler->first_root(Vec3(1.0), Vec3(1.0), 0.0));
    EXPECT_EQ(sampler->first_root(Vec3(std::nan("")), Vec3(0.0), 0.0), std::optional<double>(0.0));
    EXPECT_EQ(sampler->roots(), 502U);
}

} // namespace
} // namespace palpate
