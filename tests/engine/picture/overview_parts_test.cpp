// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/picture/internal/preview_surface.h>
#include <palpate/engine/picture/internal/principal_direction.h>
#include <palpate/engine/picture/internal/surface_tile.h>
#include <palpate/engine/picture/internal/value_sample.h>
#include <palpate/geometry/mesh_report.h>

#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate::internal {
namespace {

ValueSample sample_of(const std::vector<double>& values) {
    return {values.size(), values.size(), [&](std::size_t i) { return values[i]; }};
}

// --- Samples of values

TEST(ValueSample, PercentilesAreValuesByRankAndWhatIsNotFiniteIsLeftOut) {
    std::vector<double> values;
    for (int i = 100; i >= 0; --i)
        values.push_back(i);
    values.push_back(std::numeric_limits<double>::quiet_NaN());
    values.push_back(-std::numeric_limits<double>::infinity());
    const ValueSample sample = sample_of(values);
    EXPECT_EQ(sample.percentile(0.0), 0.0);
    EXPECT_EQ(sample.percentile(0.01), 1.0);
    EXPECT_EQ(sample.percentile(0.99), 99.0);
    EXPECT_EQ(sample.percentile(1.0), 100.0);
    EXPECT_TRUE(sample_of({std::nan("")}).empty());
    EXPECT_EQ(sample_of({}).percentile(0.5), 0.0);
    EXPECT_FALSE(sample_of({}).otsu_threshold().has_value());
}

TEST(ValueSample, EveryColumnOfALargeVolumeIsMet) {
    // Rows of 4096 values that rise along the row. Every fourth value of them, which is what a
    // million out of four would be, has the first column in it again and again, and no fifth one.
    constexpr std::size_t kRow = 4096;
    std::vector<bool> met(kRow, false);
    const ValueSample sample(1024 * kRow, kRow, [&](std::size_t i) {
        met[i % kRow] = true;
        return static_cast<double>(i % kRow);
    });
    EXPECT_EQ(std::count(met.begin(), met.end(), true), static_cast<std::ptrdiff_t>(kRow));
    // Columns are met equally often, but for one: a rank is good to a column.
    EXPECT_NEAR(sample.percentile(0.5), 0.5 * kRow, 1.0);
}

/// Variance between two classes by its definition: the weighted squares of means from the mean.
double variance_between(const std::vector<double>& values, double threshold) {
    double sum[2]{}, count[2]{};
    for (const double v : values) {
        sum[v > threshold] += v;
        count[v > threshold] += 1.0;
    }
    if (count[0] == 0.0 || count[1] == 0.0) return 0.0;
    const double n = count[0] + count[1];
    const double mean = (sum[0] + sum[1]) / n;
    double variance = 0.0;
    for (int c = 0; c < 2; ++c)
        variance += count[c] / n * std::pow(sum[c] / count[c] - mean, 2);
    return variance;
}

TEST(ValueSample, OtsusThresholdHasTheLargestVarianceBetweenItsClasses) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        std::normal_distribution<double> low(100.0, 20.0), high(400.0, 60.0);
        std::vector<double> values;
        for (int i = 0; i < 120; ++i) // floats, as volumes have them
            values.push_back(static_cast<float>(i % 3 ? low(random) : high(random)));
        const std::optional<double> threshold = sample_of(values).otsu_threshold();
        ASSERT_TRUE(threshold.has_value());
        const double found = variance_between(values, *threshold);
        // Brute force: a threshold at every value. Rounding of sums of 120 numbers.
        for (const double v : values)
            EXPECT_LE(variance_between(values, v), found * (1.0 + 1e-12));
        EXPECT_EQ(std::count(values.begin(), values.end(), *threshold), 0);
    }
}

TEST(ValueSample, OtsusThresholdPartsTwoValuesEvenFarFromZero) {
    // Offset 1e6 and a difference of 1: sums of squares would have lost it.
    EXPECT_EQ(sample_of({1e6, 1e6, 1e6, 1e6 + 1, 1e6 + 1}).otsu_threshold(), 1e6 + 0.5);
    EXPECT_FALSE(sample_of({5.0, 5.0}).otsu_threshold().has_value());
}

// --- Tensors

Mat3 matrix(const SymmetricTensor& t) {
    return {t[0], t[1], t[2], t[1], t[3], t[4], t[2], t[4], t[5]};
}

TEST(PrincipalDirection, IsAUnitEigenvectorAndNoDirectionIsStretchedMore) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int n = 0; n < 200; ++n) {
        SCOPED_TRACE(n);
        SymmetricTensor t{};
        const double scale = std::pow(10.0, 12.0 * uniform(random)); // any unit
        for (double& element : t)
            element = scale * uniform(random);
        if (n % 10 == 0) t[1] = t[2] = t[4] = 0.0; // along the axes
        const Vec3 v = principal_direction(t);
        EXPECT_NEAR(glm::length(v), 1.0, 1e-12);
        const Vec3 turned = matrix(t) * v;
        const double value = glm::dot(v, turned);
        // Jacobi's rotations are good to rounding times the tensor's size.
        EXPECT_LE(glm::length(turned - value * v), 1e-12 * frobenius_norm(t));
        for (int i = 0; i < 200; ++i) {
            const Vec3 w = Vec3(uniform(random), uniform(random), uniform(random));
            EXPECT_LE(glm::dot(w, matrix(t) * w),
                      (value + 1e-12 * frobenius_norm(t)) * glm::dot(w, w));
        }
    }
}

TEST(PrincipalDirection, OfWhatIsNoTensorIsFinite) {
    EXPECT_EQ(principal_direction({std::nan(""), 0, 0, 0, 0, 0}), Vec3(0.0));
    EXPECT_NEAR(glm::length(principal_direction({0, 0, 0, 0, 0, 0})), 1.0, 1e-15);
    EXPECT_NEAR(glm::length(principal_direction({1, 0, 0, 1, 0, 1})), 1.0, 1e-15);
}

TEST(FractionalAnisotropy, IsOneForALineAndZeroForABall) {
    EXPECT_DOUBLE_EQ(fractional_anisotropy({0, 0, 0, 3, 0, 0}), 1.0);
    EXPECT_NEAR(fractional_anisotropy({2, 0, 0, 2, 0, 2}), 0.0, 1e-15);
    EXPECT_EQ(fractional_anisotropy({0, 0, 0, 0, 0, 0}), 0.0);
    // Eigenvalues 1, 1, 0: sqrt(3/2 * (2/3) / 2).
    EXPECT_NEAR(fractional_anisotropy({1, 0, 0, 1, 0, 0}), std::sqrt(0.5), 1e-15);
    EXPECT_EQ(fractional_anisotropy({1, 0, 0, -1, 0, 0}), 1.0); // noise: clamped
}

// --- Surfaces of pictures

/// Distance into a ball of 20 mm around the middle of 32 voxels of 2 mm.
VoxelVolume ball() {
    return test::sampled({32, 32, 32}, {2e-3 * Mat3(1.0), Vec3(-0.031)},
                         [](const Vec3& p) { return 0.020 - glm::length(p); });
}

TEST(PreviewSurface, BlocksOfALargeVolumeKeepTheSurfaceInItsPlace) {
    const VoxelVolume volume = ball();
    for (const std::size_t most : {std::size_t{32768}, std::size_t{4096}}) {
        const TriangleMesh mesh = preview_surface(volume, 0.0, most);
        ASSERT_FALSE(mesh.triangles.empty());
        // The distance's second derivatives are 1/r across, r > R - h in the cells that count:
        // linear interpolation over a block's edge h is off by h^2 / (4 r) at most, the mean over
        // a block by h^2 / (16 r).
        const double h = most < volume.voxels() ? 4e-3 : 2e-3;
        for (const Vec3& p : mesh.vertices)
            EXPECT_NEAR(glm::length(p), 0.020, h * h * (1.0 / 4.0 + 1.0 / 16.0) / (0.020 - h));
    }
}

TEST(PreviewSurface, BlocksThatDoNotFitTheVolumeAreMeansOfWhatIsThere) {
    // 33 voxels in blocks of 2: the last ones have half of their voxels. The surface is elsewhere.
    const VoxelVolume volume =
        test::sampled({33, 33, 33}, {2e-3 * Mat3(1.0), Vec3(-0.031)}, [](const Vec3& p) {
            return p.x > 0.032 ? std::nan("") : 0.020 - glm::length(p);
        });
    const TriangleMesh mesh = preview_surface(volume, 0.0, 5000);
    ASSERT_FALSE(mesh.triangles.empty());
    constexpr double h = 4e-3; // the tolerance is that of the blocks that fit
    for (const Vec3& p : mesh.vertices)
        EXPECT_NEAR(glm::length(p), 0.020, h * h * (1.0 / 4.0 + 1.0 / 16.0) / (0.020 - h));
}

TEST(PreviewSurface, LabelsInBlocksEncloseNearlyAsMuch) {
    const VoxelVolume values = ball();
    LabelVolume labels;
    labels.size = values.size;
    labels.index_to_scene = values.index_to_scene;
    labels.layers.emplace_back();
    std::size_t inside = 0;
    for (const float value : values.values) {
        labels.layers[0].push_back(value > 0.0F ? 7 : 0);
        inside += value > 0.0F ? 1 : 0;
    }
    const double wanted = 8e-9 * static_cast<double>(inside);
    // A Gaussian of one block's edge h moves a ball's level 0.5 by sigma^2 / R inwards, three times
    // that share of R in volume: 3 % at 2 mm, 12 % at 4 mm; half as much again for stairs.
    for (const auto& [most, share] :
         {std::pair{std::size_t{32768}, 0.045}, {std::size_t{2000}, 0.18}}) {
        const MeshReport report = inspect(preview_surface(labels, most));
        EXPECT_TRUE(report.closed());
        EXPECT_NEAR(report.volume_m3, wanted, share * wanted);
    }
}

// --- Edges drawn red

TEST(BadEdges, AreThoseThatTheReportCounts) {
    TriangleMesh mesh = test::icosphere(0.02, 2);
    EXPECT_TRUE(bad_edges(mesh).empty());
    std::mt19937 random(3);
    for (int n = 0; n < 30; ++n) { // holes, turned triangles, doubled ones, needles
        const auto t = random() % mesh.triangles.size();
        switch (n % 4) {
        case 0:
            mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(t));
            break;
        case 1:
            std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
            break;
        case 2:
            mesh.triangles.push_back(mesh.triangles[t]);
            break;
        default:
            mesh.triangles.push_back({mesh.triangles[t][0], mesh.triangles[t][0], 5});
            break;
        }
        const MeshReport report = inspect(mesh);
        // An edge that is open and shared oddly may count as both.
        const std::size_t bad = bad_edges(mesh).size();
        EXPECT_LE(bad, report.border_edges + report.non_manifold_edges);
        EXPECT_GE(bad, std::max(report.border_edges, report.non_manifold_edges));
    }
    EXPECT_EQ(bad_edges(test::sheet(0.1, 5)).size(), 20U);
}

} // namespace
} // namespace palpate::internal
