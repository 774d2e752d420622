// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/explore_view.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/view/explore_preview.h>

#include "tests/engine/view/container_reader.h"
#include "tests/engine/view/live_client.h"
#include "tests/support/made_labels.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr double kSpacing_m = 1e-3;

/// Values that rise towards the middle of 40 voxels of 1 mm along each axis: at v, a sphere of
/// radius 20 - v mm.
VoxelVolume cone() {
    return test::sampled({40, 40, 40}, {Mat3(kSpacing_m), Vec3(0.0)}, [](const Vec3& at) {
        return 20.0 - 1e3 * glm::length(at - Vec3(0.0195));
    });
}

/// Label 1 a block, label 2 a single voxel.
LabelVolume block_and_crumb() {
    return test::made_labels({24, 24, 24}, {Mat3(kSpacing_m), Vec3(0.0)}, 2, [](const Vec3& at) {
        if (at == Vec3(20.0, 20.0, 20.0)) return 2;
        return glm::all(glm::lessThan(glm::abs(at - Vec3(9.0)), Vec3(5.0))) ? 1 : 0;
    });
}

/// Radius of a mesh around the cone's middle: least and most, mm.
std::array<double, 2> radii_mm(const json& structure) {
    std::array<double, 2> radii{1e9, 0.0};
    for (int axis = 0; axis < 3; ++axis)
        for (const json& corner : structure.at("box_m")) {
            const double radius = std::abs(1e3 * corner.at(axis).get<double>() - 19.5);
            radii = {std::min(radii[0], radius), std::max(radii[1], radius)};
        }
    return radii;
}

class Explores : public testing::Test {
protected:
    DataFile data(std::variant<VoxelVolume, LabelVolume, MeshFile> content) const {
        DataFile file;
        file.file = folder_ / "data.nii.gz";
        test::make_file(file.file, "");
        file.content = std::move(content);
        return file;
    }
    std::unique_ptr<ExploreView> view_of(DataFile file) const {
        ExploreSettings settings;
        settings.scene = folder_ / "scene.toml";
        return std::make_unique<ExploreView>(std::move(file), settings, "<html></html>");
    }

    const test::TemporaryFolder folder_;
};
using ExploreViewTest = Explores;

/// A page that has read what every page is sent first.
struct Page {
    explicit Page(const ExploreView& view) : client(view.server()) {
        EXPECT_TRUE(client.open(view.server()));
        const std::string bytes = client.next();
        scene = test::ContainerReader(bytes).document;
        client.next(); // the state
    }
    json ask(const std::string& command) {
        client.send(command);
        return next();
    }
    json next() {
        const std::string bytes = client.next();
        return client.is_text() ? json::parse(bytes) : test::ContainerReader(bytes).document;
    }

    test::LiveClient client;
    json scene;
};

TEST_F(ExploreViewTest, AnIsoValueIsAnsweredByTheSurfaceThere) {
    const auto view = view_of(data(cone()));
    Page page(*view);
    EXPECT_EQ(page.scene.at("mode"), "explore");
    const json& choice = page.scene.at("choice");
    EXPECT_EQ(choice.at("data"), "volume");
    std::uint64_t voxels = 0;
    for (const json& count : choice.at("histogram"))
        voxels += count.get<std::uint64_t>();
    // All but those beyond the 0.1st and the 99.9th percentile.
    EXPECT_NEAR(static_cast<double>(voxels), 64'000.0, 0.003 * 64'000.0);
    for (const double level : {8.0, 4.0}) {
        const json answer = page.ask(fmt::format(R"({{"do":"iso","value":{}}})", level));
        EXPECT_EQ(answer.at("iso").at("value"), level);
        const auto [least, most] = radii_mm(answer.at("chosen").at(0));
        // Smoothed by 0.7 voxels, the level chosen again: within a tenth of a voxel of the sphere.
        EXPECT_NEAR(least, 20.0 - level, 0.1);
        EXPECT_NEAR(most, 20.0 - level, 0.1);
    }
}

TEST_F(ExploreViewTest, GarbageIsAnsweredAndThePageGoesOn) {
    const auto view = view_of(data(cone()));
    Page page(*view);
    for (const char* wrong :
         {R"({"do":"iso","value":NaN})", R"({"do":"iso","value":null})",
          R"({"do":"iso","value":1e999})", R"({"do":"iso","value":300})",
          R"({"do":"iso","value":-300})", R"({"do":"iso"})", R"({"do":"iso","value":8,"fine":1})",
          R"({"do":"labels"})", R"({"do":"labels","structures":[0]})",
          R"({"do":"save","structures":[0]})", R"({"do":"save","iso":900})",
          R"({"do":"save","file":"/etc/passwd"})", R"({"do":"restart"})"}) {
        const json answer = page.ask(wrong);
        EXPECT_EQ(answer.at("kind"), "error") << wrong;
        EXPECT_FALSE(answer.at("say").get<std::string>().empty()) << wrong;
    }
    EXPECT_EQ(page.ask(R"({"do":"iso","value":8})").at("kind"), "mesh");
    EXPECT_EQ(test::files_in(folder_.path()), 1u); // no scene
}

// Those at places a multiple of eight apart had one colour, and are what is shown first.
TEST_F(ExploreViewTest, LabelsThatAreShownFirstHaveColoursOfTheirOwn) {
    const auto view = view_of(
        data(test::made_labels({32, 32, 8}, {Mat3(kSpacing_m), Vec3(0.0)}, 64, [](const Vec3& at) {
            const int place = static_cast<int>(at.x / 4) + 8 * static_cast<int>(at.y / 4);
            const bool is_large = place % 8 == 0;
            return is_large || std::fmod(at.z, 4.0) == 0.0 ? 1 + place : 0;
        })));
    const Page page(*view);
    std::set<std::string> colors, all;
    const json& chosen = page.scene.at("choice").at("chosen");
    ASSERT_EQ(chosen.size(), 8u);
    for (const json& structure : page.scene.at("structures"))
        all.insert(structure.at("color").get<std::string>());
    for (const json& id : chosen)
        colors.insert(page.scene.at("structures").at(id.get<std::size_t>()).at("color"));
    EXPECT_EQ(colors.size(), 8u);
    EXPECT_EQ(all.size(), 64u);
}

TEST_F(ExploreViewTest, LabelsAreDrawnByNumberAndWhatIsNoneIsRefused) {
    const auto view = view_of(data(block_and_crumb()));
    Page page(*view);
    EXPECT_EQ(page.scene.at("choice").at("chosen"), json({0, 1}));
    const json answer = page.ask(R"({"do":"labels","structures":[0,1]})");
    ASSERT_EQ(answer.at("chosen").size(), 2u);
    for (const json& structure : answer.at("chosen"))
        EXPECT_FALSE(structure.at("levels").empty()) << structure;
    for (const char* wrong :
         {R"({"do":"labels","structures":[2]})", R"({"do":"labels","structures":[-1]})",
          R"({"do":"labels","structures":["1"]})", R"({"do":"labels","structures":[]})",
          R"({"do":"iso","value":1})", R"({"do":"save","structures":[7]})"})
        EXPECT_EQ(page.ask(wrong).at("kind"), "error") << wrong;
}

// The newest wish is answered, however many came before it, and each answer is of a wish.
TEST_F(ExploreViewTest, OfAFloodOfWishesTheLastOneIsAnswered) {
    const auto view = view_of(data(cone()));
    Page page(*view);
    constexpr int kWishes = 2000;
    for (int i = 0; i < kWishes; ++i)
        page.client.send(fmt::format(R"({{"do":"iso","value":{}}})", 1.0 + 0.005 * i));
    const double last = 1.0 + 0.005 * (kWishes - 1);
    int answers = 0;
    for (json answer = page.next(); ++answers, answer.at("iso").at("value") != last;)
        answer = page.next();
    EXPECT_LT(answers, kWishes);
    EXPECT_EQ(view->server().counts().dropped, 0u);
}

TEST_F(ExploreViewTest, ASavedSceneIsNeverAnotherOnesFile) {
    const auto view = view_of(data(cone()));
    Page page(*view);
    const auto save = [&](double iso) {
        const json answer = page.ask(fmt::format(R"({{"do":"save","iso":{}}})", iso));
        EXPECT_EQ(answer.at("kind"), "info") << answer;
    };
    const auto iso_of = [&](const char* name) {
        return read_scene(folder_ / name).surfaces.begin()->second.iso_value;
    };
    test::make_file(folder_ / "scene.toml", "of a user");
    save(8.0);
    EXPECT_EQ(test::content_of(folder_ / "scene.toml"), "of a user");
    EXPECT_EQ(iso_of("scene-2.toml"), 8.0);
    save(9.0); // its own, which nobody has changed
    EXPECT_EQ(iso_of("scene-2.toml"), 9.0);
    const std::string changed = test::content_of(folder_ / "scene-2.toml") + "# mine\n";
    test::make_file(folder_ / "scene-2.toml", changed);
    save(10.0);
    EXPECT_EQ(test::content_of(folder_ / "scene-2.toml"), changed);
    EXPECT_EQ(iso_of("scene-3.toml"), 10.0);
}

TEST_F(ExploreViewTest, DataWithoutASurfaceAreRefused) {
    VoxelVolume plain = cone();
    plain.values.assign(plain.voxels(), 3.0F);
    EXPECT_THROW(view_of(data(std::move(plain))), std::runtime_error);
    LabelVolume none = block_and_crumb();
    none.labels.clear();
    EXPECT_THROW(view_of(data(std::move(none))), std::runtime_error);
}

TEST(ExplorePreview, MeansOfBlocksKeepPlaceAndMean) {
    const VoxelVolume volume = cone();
    const VoxelVolume coarse = block_means(volume, 20 * 20 * 20);
    EXPECT_EQ(coarse.size, (std::array<int, 3>{20, 20, 20}));
    EXPECT_NEAR(glm::length(coarse.index_to_scene.point(Vec3(0.0)) - Vec3(0.5e-3)), 0.0, 1e-12);
    double sum = 0.0, coarse_sum = 0.0;
    for (const float value : volume.values)
        sum += value;
    for (const float value : coarse.values)
        coarse_sum += 8.0 * value;
    // Floats of 24 bits, rounded once more each.
    EXPECT_NEAR(sum, coarse_sum, 64'000 * 20.0 * 1.2e-7);
}

// A wire of one voxel is 3000 there, and 750 in the mean of a block of 8: single voxels are asked.
TEST(ExplorePreview, WhatMeansOfBlocksDoNotReachIsDrawnFromTheVoxels) {
    DataFile data;
    data.content =
        test::sampled({130, 130, 130}, {Mat3(kSpacing_m), Vec3(0.0)}, [](const Vec3& at) {
            const bool is_wire = std::abs(at.x - 0.064) < 1e-4 && std::abs(at.y - 0.064) < 1e-4;
            return is_wire ? 3000.0 : 1e3 * at.z; // up to 129
        });
    ExplorePreview preview(std::move(data));
    const TriangleMesh wire =
        preview.isosurface(800.0, kSoonVoxels, [](double, std::string_view) { return true; });
    EXPECT_GT(wire.triangles.size(), 100u);
}

// A wish that nobody has any more ends at the next step of its work.
TEST(ExplorePreview, IsCancelledByItsProgress) {
    DataFile data;
    data.content = cone();
    ExplorePreview preview(std::move(data));
    int calls = 0;
    EXPECT_THROW(
        preview.isosurface(8.0, kSoonVoxels, [&](double, std::string_view) { return ++calls < 2; }),
        std::runtime_error);
    EXPECT_EQ(calls, 2);
}

// A pit of -3000 is -750 in the means of blocks that it shares: all of them are above the level.
TEST(ExplorePreview, WhatMeansOfBlocksAreAllAboveIsDrawnFromTheVoxels) {
    DataFile data;
    data.content =
        test::sampled({130, 130, 130}, {Mat3(kSpacing_m), Vec3(0.0)}, [](const Vec3& at) {
            const bool is_pit = std::abs(at.x - 0.0655) < 1e-3 && std::abs(at.y - 0.0655) < 1e-3;
            return is_pit ? -3000.0 : 1e3 * at.z; // from 0 on
        });
    ExplorePreview preview(std::move(data));
    const TriangleMesh pit =
        preview.isosurface(-800.0, kSoonVoxels, [](double, std::string_view) { return true; });
    EXPECT_GT(pit.triangles.size(), 100u);
}

} // namespace
} // namespace palpate
