// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/error_budget.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/study/converged_proxy.h>

#include "tests/engine/study/study_fixture.h"
#include "tests/support/made_labels.h"

namespace palpate {
namespace {

using namespace test::study;
using testing::HasSubstr;

const ErrorPart& part_of(const std::vector<ErrorPart>& parts, const std::string& source) {
    return *std::find_if(parts.begin(), parts.end(),
                         [&](const ErrorPart& part) { return part.source == source; });
}

TEST(ErrorBudget, VoxelisationFallsWithTheSquareOfTheVoxels) {
    const auto level_um = [](double voxel_mm) {
        const auto parts =
            error_budget(surface_cavity(), along_the_wall(1e-4), {}, {.voxel_mm = voxel_mm});
        const ErrorPart& part = part_of(parts, "voxelisation");
        EXPECT_EQ(part.why_not, "");
        // Linear interpolation is off by h^2 / 8 times the second derivatives along the axes, whose
        // sum is 2 / r for a distance; its slope is 1 but for the same.
        const double bound_um = 1e3 * voxel_mm * voxel_mm / (4.0 * 1e3 * kRadius_m);
        EXPECT_LT(part.level.max_um, 1.1 * bound_um) << voxel_mm << " mm";
        return part.level.rms_um;
    };
    EXPECT_NEAR(level_um(2.0) / level_um(1.0), 4.0, 0.6);
}

TEST(ErrorBudget, OfAPlaneIsZero) {
    // A linear field is what its voxels say, also smoothed; its level needs no sub-steps.
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"slab\"\nthickness_mm = 80\n[surface.s]\nvolume = "
                    "\"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                    "slab.toml"));
    std::vector<DeviceState> inputs(kFrames);
    for (std::size_t i = 0; i < kFrames; ++i) {
        const double at = static_cast<double>(i);
        inputs[i].time_s = 1e-3 * at;
        inputs[i].position = {1e-4 * at, 5e-5 * at, 0.0405 - std::min(1e-4 * at, 2e-3)};
    }
    const auto parts = error_budget(scene, inputs, {});
    // A value of v metres is a float to v 2^-24: 6e-4 um at 10 mm, the farthest voxels. The
    // gradient, of two values 2 mm apart, turns the way of 2 mm by no more than that. The Gaussian
    // adds its own rounding, of as many values.
    for (const char* source : {"voxelisation", "smoothing", "float32", "together"}) {
        EXPECT_EQ(part_of(parts, source).why_not, "") << source;
        EXPECT_LT(part_of(parts, source).position.max_um, 2e-2) << source;
    }
    EXPECT_EQ(part_of(parts, "stepping").position.max_um, 0.0);
    EXPECT_GT(part_of(parts, "solver").position.frames, kFrames / 2);
    EXPECT_LT(part_of(parts, "solver").position.max_um, 1e-9) << "rounding of 40 mm is 7e-12 um";
}

TEST(ErrorBudget, SaysWhatIsNotKnownAndWhy) {
    const auto parts = error_budget(gradient_cavity(kHard), along_the_wall(), {});
    for (const char* source : {"voxelisation", "smoothing", "float32", "extraction", "solver"})
        EXPECT_EQ(part_of(parts, source).why_not, "no surface with a level is felt") << source;
    EXPECT_EQ(part_of(parts, "stepping").why_not, "");
    EXPECT_GT(part_of(parts, "stepping").position.frames, 0u);
    EXPECT_THAT(error_budget_table(parts), HasSubstr("not known: no surface with a level"));

    const auto without_cgal = error_budget(surface_cavity(), along_the_wall(1e-4), {});
    EXPECT_EQ(part_of(without_cgal, "extraction").why_not, "this build extracts no meshes");
    std::vector<DeviceState> away(10);
    EXPECT_EQ(part_of(error_budget(surface_cavity(), away, {}), "stepping").why_not,
              "nothing was touched");
}

TEST(ErrorBudget, ExtractionIsTheSagittaOfItsFacets) {
    constexpr int splits = 5;
    SceneResources resources;
    resources.extract = [](const Isosurface& surface, const IsosurfaceSettings&, const Progress&) {
        EXPECT_LT(surface.value({2.0 * kRadius_m, 0.0, 0.0}), 0.0) << "a body, not its outside";
        EXPECT_GT(surface.value({0.0, 0.0, 0.01}), 0.0);
        EXPECT_FALSE(surface.seeds.empty());
        return ball(splits);
    };
    const auto parts = error_budget(surface_cavity(), along_the_wall(1e-4), resources);
    const ErrorPart& part = part_of(parts, "extraction");
    ASSERT_EQ(part.why_not, "");
    EXPECT_THAT(part.how, HasSubstr("8192 facets"));
    EXPECT_GT(part.level.frames, kFrames / 2) << "a mesh the wrong way round is not felt";
    // An edge is at most that of the octahedron's face middle, r sqrt(3/2) / 2^splits; the plane of
    // a facet is its circumradius squared over 2 r inside.
    const double edge_m = kRadius_m * std::sqrt(1.5) / (1 << splits);
    const double sagitta_um = 1e6 * edge_m * edge_m / 3.0 / (2.0 * kRadius_m);
    EXPECT_LT(part.level.max_um, 1.5 * sagitta_um);
    EXPECT_GT(part.level.rms_um, 0.1 * sagitta_um);
}

/// A cavity as a scan of it would be: voxels in memory, and no formula.
std::shared_ptr<const Scene> scanned(const Scene& formula, double spacing_m,
                                     const SceneResources& resources) {
    SceneDescription description = formula.description();
    const auto sampler = formula.surfaces().front().baked.field->make_sampler();
    const double reach_m = kRadius_m + 12.0 * spacing_m;
    auto voxels = std::make_shared<VoxelVolume>();
    const int size = static_cast<int>(std::lround(2.0 * reach_m / spacing_m));
    voxels->size = {size, size, size};
    // No node is at the centre or on an axis.
    voxels->index_to_scene = {Mat3(spacing_m), Vec3(-reach_m + 0.3 * spacing_m)};
    for (int k = 0; k < size; ++k)
        for (int j = 0; j < size; ++j)
            for (int i = 0; i < size; ++i)
                voxels->values.push_back(static_cast<float>(
                    sampler->value(voxels->index_to_scene.point(Vec3(i, j, k)))));
    description.volumes.at("v") = {};
    description.volumes.at("v").voxels = std::move(voxels);
    return std::make_shared<const Scene>(std::move(description), resources);
}

// What voxels alone let one estimate is what the formula says.
TEST(ErrorBudget, VoxelisationOfDataIsEstimatedFromCoarserVoxels) {
    SceneResources resources;
    resources.files = scene_files();
    const auto bumpy = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"bumpy_cavity\"\nradius_mm = 50\namplitude_mm = 1\n"
                    "wavelength_mm = 15\n[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = "
                    "\"surface\"\nsurface = \"s\"\n",
                    "bumpy.toml"));
    struct Case {
        std::shared_ptr<const Scene> formula;
        double spacing_m;
    };
    const std::vector<DeviceState> inputs = along_the_wall(3e-3);
    for (const auto& [formula, spacing_m] :
         {Case{surface_cavity(), 1e-3}, {surface_cavity(), 2e-3}, {bumpy, 1e-3}}) {
        const auto scene = scanned(*formula, spacing_m, resources);
        const auto parts = error_budget(scene, inputs, resources);
        const ErrorPart& part = part_of(parts, "voxelisation");
        ASSERT_EQ(part.why_not, "");
        EXPECT_THAT(part.how, HasSubstr("estimated from every 2nd and every 4th"));

        const ConvergedProxies with = converged_proxies(scene, inputs);
        const ConvergedProxies exact = converged_proxies(formula, inputs);
        EXPECT_NEAR(part.position.rms_um, distance_between(with, exact).rms_um, part.known_to_um);
        EXPECT_LT(part.known_to_um, 0.7 * part.position.rms_um) << "else it says nothing";

        const auto sampler = formula->surfaces().front().baked.field->make_sampler();
        double squares = 0.0, frames = 0.0;
        for (std::size_t i = 0; i < inputs.size(); ++i)
            if (with.in_contact[i]) {
                squares += std::pow(1e6 * level_distance(*sampler, with.proxies[i], 0.0, 1e-3), 2);
                ++frames;
            }
        EXPECT_NEAR(part.level.rms_um / std::sqrt(squares / frames), 1.0, 0.5);
    }
}

// Noise from voxel to voxel has no finer voxels to converge to.
TEST(ErrorBudget, VoxelisationOfNoiseIsNotKnown) {
    SceneResources resources;
    resources.files = scene_files();
    const auto clean = scanned(*surface_cavity(), 2e-3, resources);
    SceneDescription description = clean->description();
    auto voxels = std::make_shared<VoxelVolume>(*description.volumes.at("v").voxels);
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0.0F, 1e-3F);
    for (float& value : voxels->values)
        value += noise(random);
    description.volumes.at("v").voxels = std::move(voxels);
    const auto noisy = std::make_shared<const Scene>(std::move(description), resources);
    const auto parts = error_budget(noisy, along_the_wall(6e-3), resources);
    EXPECT_THAT(part_of(parts, "voxelisation").why_not, HasSubstr("does not fall with the voxels"));
    EXPECT_EQ(part_of(parts, "voxelisation").position.frames, 0u);
}

/// A block of labels, its top at z = 0, with a ball of 5 mm in it, 3 mm deep; soft, over the ball
/// `ratio` times as stiff a tissue. The ball may be a surface too, which is not felt.
std::shared_ptr<const Scene> block_with_lump(double ratio, const SceneResources& resources,
                                             bool lump_is_surface = false) {
    const AffineTransform frame{Mat3(1e-3), Vec3{-25.0, -25.0, -29.5} * 1e-3};
    SceneDescription scene;
    scene.volumes["v"].label_volume = std::make_shared<const LabelVolume>(
        test::made_labels({51, 51, 40}, frame, 2, [](const Vec3& at) {
            if (at.x < 5 || at.x > 45 || at.y < 5 || at.y > 45 || at.z > 29) return 0;
            return glm::distance(at, Vec3(25, 25, 21.5)) <= 5.0 ? 2 : 1;
        }));
    SurfaceDescription& block = scene.surfaces["block"];
    block.volume = "v";
    block.labels = {"1", "2"};
    block.contact = ContactKind::volume;
    block.softness = Softness::linear(150.0);
    if (ratio != 1.0) block.beneath["2"] = ratio;
    if (lump_is_surface) {
        scene.surfaces["lump"].volume = "v";
        scene.surfaces["lump"].labels = {"2"};
    }
    scene.effects.push_back(effects::Surface{.surface = "block"});
    return std::make_shared<const Scene>(std::move(scene), resources);
}

// `palpate study` refused a scene with lumps: its coarser voxels have no labels that could lie
// beneath. They need none: the errors are those of the front, and lumps do not move it.
TEST(ErrorBudget, OfASurfaceOverLumpsIsTheOneWithoutThem) {
    SceneResources resources;
    resources.files = scene_files();
    std::vector<DeviceState> inputs(kFrames);
    for (std::size_t i = 0; i < kFrames; ++i) {
        const double at = static_cast<double>(i);
        inputs[i].time_s = 1e-3 * at;
        inputs[i].position = {-10e-3 + 1e-4 * at, 3e-3, 1e-3 - std::min(5e-5 * at, 3e-3)};
    }
    const auto with = error_budget(block_with_lump(10.0, resources), inputs, resources);
    const auto without = error_budget(block_with_lump(1.0, resources), inputs, resources);
    const auto beside = error_budget(block_with_lump(1.0, resources, true), inputs, resources);
    ASSERT_EQ(with.size(), without.size());
    ASSERT_EQ(beside.size(), without.size());
    int known = 0;
    for (std::size_t i = 0; i < with.size(); ++i) {
        EXPECT_EQ(with[i].source, without[i].source);
        EXPECT_EQ(with[i].why_not, without[i].why_not);
        EXPECT_EQ(with[i].position.rms_um, without[i].position.rms_um) << with[i].source;
        EXPECT_EQ(beside[i].why_not, without[i].why_not);
        EXPECT_EQ(beside[i].position.rms_um, without[i].position.rms_um) << with[i].source;
        known += with[i].position.frames > 0 ? 1 : 0;
    }
    EXPECT_GE(known, 2);
}

TEST(ErrorBudget, StopsWhenAskedTo) {
    EXPECT_THROW(error_budget(surface_cavity(), along_the_wall(1e-4), {}, {},
                              [](double, std::string_view) { return false; }),
                 std::runtime_error);
}

} // namespace
} // namespace palpate
