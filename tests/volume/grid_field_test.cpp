// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/grid_field.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <tests/support/dense_reference.h>
#include <tests/support/test_volumes.h>

namespace palpate {
namespace {

using test::DenseReference;
using test::random_direction;
using test::random_point;

constexpr float kBackground = -1000.0F;

struct NamedFrame {
    std::string name;
    AffineTransform frame;
};

/// What must not be confused: anisotropic, oblique and left-handed, sheared.
std::vector<NamedFrame> all_frames() {
    AffineTransform straight;
    straight.linear = Mat3(0.957e-3, 0.0, 0.0, 0.0, 0.957e-3, 0.0, 0.0, 0.0, 1.5e-3);
    straight.offset = {-0.12, -0.13, 0.05};
    return {{"straight", straight},
            {"oblique, left-handed", test::oblique_frame({0.7e-3, 0.9e-3, 1.6e-3}, {0.05, -0.2, 0.1})},
            {"sheared", test::sheared_frame(1e-3)}};
}

VoxelVolume noise(const std::array<int, 3>& size, const AffineTransform& frame, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> value(-900.0, 900.0);
    return test::sampled(size, frame, [&](const Vec3&) { return value(random); });
}

/// A random scene point whose index coordinates lie in [-1, n): where there are data.
Vec3 point_with_data(std::mt19937_64& random, const VoxelVolume& volume) {
    const Vec3 n(volume.size[0], volume.size[1], volume.size[2]);
    return volume.index_to_scene.point(random_point(random, {Vec3(-0.9999), n - 1e-4}));
}

double largest(const Mat3& m) {
    double value = 0.0;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            value = std::max(value, std::abs(m[column][row]));
    return value;
}

// Index coordinates below 300 are rounded to a few 1e-14; times differences of 2000 U between nodes.
constexpr double kValueRounding = 1e-9;

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
            // Per metre: a step is at least 0.7 mm, so 1500 per m and once more for the Hessian; some terms each.
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
        ASSERT_EQ(sampler->sample(p).value, sampler->sample(p).value);  // from the kept cell
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
                    volume.values[volume.index(i, j, k)] = 500.0F;  // tiles of a value
                if (i >= 24 && i < 34)
                    volume.values[volume.index(i, j, k)] = kBackground;  // tiles of background
            }
    const GridField field(volume, kBackground);
    const DenseReference reference(volume, kBackground);
    const auto sampler = field.make_sampler();
    SCOPED_TRACE("seed 3");
    std::mt19937_64 random(3);
    for (int n = 0; n < 20'000; ++n) {
        const Vec3 p = point_with_data(random, volume);
        ASSERT_NEAR(sampler->value(p), reference.value(p), kValueRounding);
        ASSERT_LT(glm::length(sampler->sample(p).gradient - reference.sample(p).gradient), kValueRounding * 1e4);
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
            const double h = 1e-6;  // m, a thousandth of a cell: stays inside
            for (int a = 0; a < 3; ++a) {
                Vec3 step(0.0);
                step[a] = h;
                const FieldSample above = sampler->sample(p + step), below = sampler->sample(p - step);
                // Third derivatives: 8 corners of 900 U over (0.7 mm)^3, 2e13 U/m^3, times h^2/6; rounding 1e-9 / h is
                // smaller. The same for the gradient, over one step more: relative to its 1e9 U/m^2 alike.
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
        EXPECT_GT(largest_jump, 1e5);  // noise: slopes of 1e6 U/m on either side have nothing in common
    }
}

TEST(GridField, GradientOfALinearFieldIsItsGradient) {
    const Vec3 steepness(3e5, -2e5, 1e5);  // U/m
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 6");
        std::mt19937_64 random(6);
        const Vec3 origin = f.frame.offset;
        const VoxelVolume volume = test::sampled({9, 9, 9}, f.frame, [&](const Vec3& p) {
            return glm::dot(steepness, p - origin);
        });
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
        for (const double index : {-1.0001, -1.7, -2.5, -9.0, -1e6, 0.0001, 0.7, 1.5, 9.0, 1e6, 1e200}) {
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
    const auto at = [&](const Vec3& index) { return sampler->sample(volume.index_to_scene.point(index)); };
    EXPECT_FALSE(at(Vec3(5.5)).valid);  // all corners are bad
    EXPECT_EQ(at(Vec3(5.5)).value, kBackground);
    EXPECT_TRUE(at(Vec3(3.5)).valid);  // one corner is
    SCOPED_TRACE("seed 8");
    std::mt19937_64 random(8);
    for (int n = 0; n < 5000; ++n) {
        const Vec3 p = point_with_data(random, volume);
        const FieldSample s = sampler->sample(p);
        ASSERT_TRUE(std::isfinite(s.value) && is_finite(s.slope) && is_finite(s.gradient));
        ASSERT_NEAR(s.value, reference.value(p), kValueRounding);
    }
}

/// Segments of 1 um to 100 mm in and around a volume; some along axes, in faces, along edges, through nodes.
std::pair<Vec3, Vec3> random_segment(std::mt19937_64& random, const VoxelVolume& volume) {
    const Vec3 n(volume.size[0], volume.size[1], volume.size[2]);
    Vec3 from = random_point(random, {Vec3(-4.0), n + 3.0});
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    Vec3 along = std::pow(10.0, -3.0 + 5.0 * unit(random)) * random_direction(random);
    const std::uint64_t kind = random() % 8;
    for (int a = 0; a < 3; ++a) {
        if (kind < 3 && (random() % 2 == 0 || a == static_cast<int>(kind)))
            from[a] = std::round(from[a]);
        if (kind < 5 && random() % 2 == 0)
            along[a] = 0.0;
        if (kind == 2)
            along[a] = std::round(along[a]);
    }
    return {volume.index_to_scene.point(from), volume.index_to_scene.point(from + along)};
}

/// Checks a root against 300 samples before it, and the value at it.
void expect_first_root(FieldSampler& sampler, const Vec3& from, const Vec3& to, double level, double rounding) {
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

TEST(GridField, FirstRootIsFirstAgainstDenseSampling) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 9");
        std::mt19937_64 random(9);
        const VoxelVolume volume = noise({13, 10, 17}, f.frame, 9);
        const GridField field(volume, kBackground);
        const auto sampler = field.make_sampler();
        int found = 0;
        for (int n = 0; n < 20'000; ++n) {
            const auto [from, to] = random_segment(random, volume);
            // High levels leave small islands, that are easily missed; low ones few gaps.
            const double level = std::uniform_real_distribution<double>(-850.0, 890.0)(random);
            // A position on the segment errs by roundings of 3e-17 m, 4e-14 of a step of 0.7 mm, and of 100 steps times
            // 1e-16; nodes differ by up to 2000 U.
            expect_first_root(*sampler, from, to, level, kValueRounding);
            if (testing::Test::HasFatalFailure())
                FAIL() << "case " << n;
            found += sampler->first_root(from, to, level).value_or(0.0) > 0.0;
        }
        EXPECT_GT(found, 4000);
    }
}

TEST(GridField, FirstRootHoldsWhereNodesAreExactlyAtTheLevel) {
    // Two labels and a level that is one of them: whole cells at the level, roots at nodes, edges and faces.
    SCOPED_TRACE("seed 10");
    std::mt19937_64 random(10);
    const VoxelVolume volume =
        test::sampled({11, 12, 13}, all_frames()[0].frame, [&](const Vec3&) { return random() % 3 == 0 ? 1.0 : 0.0; });
    const GridField field(volume, -1.0F);
    const auto sampler = field.make_sampler();
    for (int n = 0; n < 20'000; ++n) {
        const auto [from, to] = random_segment(random, volume);
        const double level = n % 2 == 0 ? 1.0 : 0.5;
        const std::optional<double> t = sampler->first_root(from, to, level);
        const auto value = [&](const Vec3& p) { return sampler->value(p); };
        if (value(from) < level) {
            // index coordinates up to 150 rounded to 3e-14, nodes differ by 2
            ASSERT_LT(test::highest_sampled(value, from, to, t.value_or(1.0), 300), level + 1e-12) << n;
        }
        if (t) {
            ASSERT_NEAR(value(from + *t * (to - from)), level, value(from) < level ? 1e-12 : 2.0) << n;
        }
    }
}

TEST(GridField, FirstRootFromFarAway) {
    const AffineTransform frame = all_frames()[1].frame;
    const Vec3 middle = test::middle_of({21, 21, 21}, frame);
    const VoxelVolume volume =
        test::sampled({21, 21, 21}, frame, [&](const Vec3& p) { return 4e-3 - glm::length(p - middle); });
    const GridField field(volume, -1.0F);
    const auto sampler = field.make_sampler();
    SCOPED_TRACE("seed 11");
    std::mt19937_64 random(11);
    for (int n = 0; n < 500; ++n) {
        const double far = std::pow(10.0, std::uniform_real_distribution<double>(-1.0, 6.0)(random));
        const Vec3 from = middle + far * random_direction(random);
        const std::optional<double> t = sampler->first_root(from, middle, 0.0);
        ASSERT_TRUE(t);
        const Vec3 root = from + *t * (middle - from);
        // 4 mm less what a trilinear ball of 1.6 mm cells may lose, and the roundings of a position from far away
        ASSERT_NEAR(glm::length(root - middle), 4e-3, 0.4e-3 + 1e-15 * far);
        ASSERT_NEAR(sampler->value(root), 0.0, 1e-13 + 1e-15 * far);
    }
    EXPECT_FALSE(sampler->first_root(middle + Vec3(1.0), middle + Vec3(1e300), 0.0));
    EXPECT_FALSE(sampler->first_root({1e20, 3.0, 1e20}, {-1e20, 2.0, 1e20}, 0.0));
}

TEST(GridField, SegmentsWithoutLengthOrNumbersAreAnswered) {
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
        EXPECT_NEAR(field.typical_slope(0.0), 4e5, 4e3);  // 1 %: chords of a sphere of 9 mm across cells of 1.6 mm
        EXPECT_EQ(field.typical_slope(1e6), 0.0);
    }
}

TEST(GridField, TypicalSlopeOfManyCellsIsThinnedEvenly) {
    // 96^3 cells of noise pass the level: far more than are kept; the median must be that of all, whichever half is looked at.
    const VoxelVolume large = noise({96, 96, 96}, all_frames()[0].frame, 13);
    const VoxelVolume small = noise({46, 46, 46}, all_frames()[0].frame, 14);
    const double of_large = GridField(large, kBackground).typical_slope(0.0);
    const double of_small = GridField(small, kBackground).typical_slope(0.0);
    // The median of 1e5 slopes of relative spread 0.4 errs by 0.4 * 1.25 / sqrt(1e5) = 0.16 %; six of that
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
        const Vec3 p = frame.point(Vec3((corner & 1) != 0 ? 4.0 : 0.0, (corner & 2) != 0 ? 5.0 : 0.0,
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

/// Directed edges of a mesh, counted.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed_edges(const TriangleMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t e = 0; e < 3; ++e)
            ++edges[{t[e], t[(e + 1) % 3]}];
    return edges;
}

double signed_volume(const TriangleMesh& mesh) {
    double six_volumes = 0.0;
    for (const auto& t : mesh.triangles)
        six_volumes += glm::dot(mesh.vertices[t[0]], glm::cross(mesh.vertices[t[1]], mesh.vertices[t[2]]));
    return six_volumes / 6.0;
}

TEST(GridField, PreviewIsClosedOrientedAndOnTheLevel) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name);
        const std::array<int, 3> size{34, 30, 26};
        const Vec3 middle = test::middle_of(size, f.frame);
        // A ball, and one at the corner of the scan that is cut by three faces.
        const VoxelVolume volume = test::sampled(size, f.frame, [&](const Vec3& p) {
            return 1e3 * std::max(8e-3 - glm::length(p - middle), 4e-3 - glm::length(p - f.frame.offset));
        });
        const GridField field(volume, -20.0F);
        const TriangleMesh mesh = field.preview(0.0);
        ASSERT_GT(mesh.triangles.size(), 500U);

        const auto edges = directed_edges(mesh);
        for (const auto& [edge, count] : edges) {
            ASSERT_EQ(count, 1);
            ASSERT_EQ(edges.count({edge.second, edge.first}), 1U);
        }
        // Outwards: the ball 4/3 pi 8^3 = 2145 mm3 and a part of the other, less what chords cut off
        EXPECT_GT(signed_volume(mesh), 1.9e-6);
        const auto sampler = field.make_sampler();
        std::size_t off_level = 0;
        for (const Vec3& v : mesh.vertices)
            off_level += std::abs(sampler->value(v)) > 1e-6;  // U, 1e-9 m on a slope of 1000 U/m
        EXPECT_LT(off_level, mesh.vertices.size() / 50);  // at the cut, where slopes jump by a factor of 100
        std::size_t inwards = 0;
        for (const auto& t : mesh.triangles) {
            const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
            const Vec3 normal = glm::cross(b - a, c - a);
            inwards += glm::dot(normal, sampler->sample((a + b + c) / 3.0).gradient) > 0.0;
        }
        EXPECT_LT(inwards, mesh.triangles.size() / 50);  // slivers that projection turned over
    }
}

TEST(GridField, PreviewClosesAroundBadVoxelsAndTiles) {
    const AffineTransform frame = all_frames()[0].frame;
    VoxelVolume volume = test::sampled({32, 32, 32}, frame, [](const Vec3&) { return 100.0; });
    for (int k = 12; k < 20; ++k)
        for (int j = 12; j < 20; ++j)
            for (int i = 12; i < 20; ++i)
                volume.values[volume.index(i, j, k)] = std::nanf("");
    const TriangleMesh mesh = GridField(volume, -100.0F).preview(0.0);
    const auto edges = directed_edges(mesh);
    for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1);
        ASSERT_EQ(edges.count({edge.second, edge.first}), 1U);
    }
    // A block with a hole: levels half a voxel outside the outermost nodes, rounded at corners and edges
    const double voxel = 0.957e-3 * 0.957e-3 * 1.5e-3;
    EXPECT_NEAR(signed_volume(mesh) / voxel, 32.0 * 32.0 * 32.0 - 8.0 * 8.0 * 8.0, 250.0);
}

std::map<std::string, std::string> some_metadata() {
    return {{"iso_value", "226"}, {"source", "skull.nrrd"}, {"note", "two words, ümlaut"}};
}

TEST(GridField, ReadsBackTheSameBits) {
    const test::TemporaryFolder folder;
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name + ", seed 17");
        VoxelVolume volume = noise({21, 18, 30}, f.frame, 17);
        for (std::size_t n = 0; n < 4000; ++n)
            volume.values[n] = n < 100 ? std::nanf("") : (n < 2000 ? kBackground : 7.0F);
        const GridField field(volume, kBackground);
        const std::filesystem::path file = folder / "field.vdb";
        field.write_vdb(file, some_metadata());
        std::map<std::string, std::string> metadata{{"stale", "gone"}};
        const std::unique_ptr<GridField> back = GridField::read_vdb(file, metadata);
        EXPECT_EQ(metadata, some_metadata());
        EXPECT_EQ(back->replaced_voxels(), 100U);
        EXPECT_EQ(back->index_to_scene().linear, f.frame.linear);
        EXPECT_EQ(back->index_to_scene().offset, f.frame.offset);
        EXPECT_EQ(back->typical_slope(0.0), field.typical_slope(0.0));
        const auto a = field.make_sampler(), b = back->make_sampler();
        std::mt19937_64 random(17);
        for (int n = 0; n < 3000; ++n) {
            const Vec3 p = point_with_data(random, volume);
            const FieldSample s = a->sample(p), t = b->sample(p);
            ASSERT_EQ(s.value, t.value);
            ASSERT_EQ(s.slope, t.slope);
            ASSERT_EQ(s.gradient, t.gradient);
            ASSERT_EQ(s.hessian, t.hessian);
            ASSERT_EQ(s.valid, t.valid);
        }
        // Written again, it is the same field once more; and nothing is left beside it.
        back->write_vdb(file, metadata);
        std::size_t files = 0;
        for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path()))
            ++files;
        EXPECT_EQ(files, 1U);
    }
}

std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(GridField, FileErrorsNameTheFile) {
    const test::TemporaryFolder folder;
    const GridField field(noise({4, 4, 4}, all_frames()[0].frame, 18), kBackground);
    std::map<std::string, std::string> metadata;
    const auto expect_named = [&](const std::filesystem::path& file, const std::string& message) {
        EXPECT_EQ(message.rfind(file.string() + ": ", 0), 0U) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_GT(message.size(), file.string().size() + 10);
    };
    const std::filesystem::path missing = folder / "missing.vdb";
    expect_named(missing, message_of([&] { GridField::read_vdb(missing, metadata); }));
    const std::filesystem::path nowhere = folder / "no_folder/field.vdb";
    expect_named(nowhere, message_of([&] { field.write_vdb(nowhere, {}); }));

    const std::filesystem::path text = folder / "text.vdb";
    test::write_bytes(text, "this is not a grid");
    expect_named(text, message_of([&] { GridField::read_vdb(text, metadata); }));

    const std::filesystem::path whole = folder / "whole.vdb";
    field.write_vdb(whole, some_metadata());
    const std::string bytes = test::read_bytes(whole);
    for (const double share : {0.05, 0.3, 0.6, 0.9}) {
        const std::filesystem::path cut = folder / "cut.vdb";
        test::write_bytes(cut, bytes.substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes.size()))));
        expect_named(cut, message_of([&] { GridField::read_vdb(cut, metadata); }));
    }
}

}  // namespace
}  // namespace palpate
