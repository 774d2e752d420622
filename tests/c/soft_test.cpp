// SPDX-License-Identifier: Apache-2.0
// How soft a surface is, as C is told.
#include <palpate/palpate_c.h>

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/c/c_data.h"
#include "tests/support/made_labels.h"

namespace palpate {
namespace {

using test::sized;

const std::string kOrgan = "[volume.v]\n[surface.organ]\nvolume = \"v\"\nlabel = [\"1\", \"2\"]\n"
                           "stiffness_n_per_mm = 0.15\nbeneath = { 2 = 10.0 }\n"
                           "contact_radius_mm = 5\n"
                           "[[effect]]\ntype = \"surface\"\nsurface = \"organ\"\n";

/// A block of 41 x 41 x 30 voxels of 1 mm, with a ball of 5 mm, 3 mm beneath the middle of its top,
/// which is at z = 0.
LabelVolume block() {
    AffineTransform frame;
    frame.linear = Mat3(1e-3);
    frame.offset = {-25e-3, -25e-3, -29.5e-3};
    return test::made_labels({51, 51, 40}, frame, 2, [](const Vec3& at) {
        if (at.x < 5 || at.x > 45 || at.y < 5 || at.y > 45 || at.z > 29) return 0;
        return glm::distance(at, Vec3(25, 25, 21.5)) <= 5.0 ? 2 : 1;
    });
}

TEST(SoftnessInC, SaysWhatFramesFeel) {
    const LabelVolume labels = block();
    const std::vector<std::int32_t> values(labels.layers[0].begin(), labels.layers[0].end());
    const test::DataPtr data = test::no_data();
    const palpate_labels given = test::in_c(labels, values);
    ASSERT_EQ(palpate_data_add_labels(data.get(), "v", &given, nullptr), PALPATE_OK);
    const test::ScenePtr scene = test::parsed(kOrgan, data);
    ASSERT_TRUE(scene);
    auto softness = sized<palpate_softness>();
    ASSERT_EQ(palpate_scene_softness(scene.get(), 0, &softness), PALPATE_OK);
    EXPECT_EQ(softness.is_soft, 1);
    EXPECT_EQ(softness.has_beneath, 1);
    EXPECT_DOUBLE_EQ(softness.stiffness_n_per_m, 150.0);
    EXPECT_DOUBLE_EQ(softness.asked_radius_m, 5e-3);
    EXPECT_GE(softness.contact_radius_m, softness.asked_radius_m);
    EXPECT_NEAR(softness.node_spacing_m, 0.25 * softness.contact_radius_m, 1e-9);
    EXPECT_GT(softness.stiffest, 1.1);
    EXPECT_GT(softness.softest, 0.99);

    const test::LoopPtr loop = test::made(scene);
    DeviceState state;
    double most = 0.0;
    for (int i = 0; i < 400; ++i) { // down, and over the ball
        state.time_s = 1e-3 * i;
        state.position = {i < 100 ? -15e-3 : -15e-3 + 1e-4 * (i - 100), 0.0,
                          i < 100 ? 2e-3 - 4e-5 * i : -2e-3};
        const palpate_frame frame = test::frame_of(loop.get(), test::probe_of(state));
        if (!(frame.indentation_m > 0.0)) continue;
        double n_per_m = 0.0;
        ASSERT_EQ(palpate_scene_stiffness_at(scene.get(), 0, frame.front_m, &n_per_m), PALPATE_OK);
        EXPECT_NEAR(frame.stiffness_n_per_m, n_per_m, 1e-9) << i;
        most = std::max(most, n_per_m);
    }
    EXPECT_GT(most, 1.1 * 150.0);
    EXPECT_LE(most, softness.stiffest * 150.0 * 1.01); // the greatest of the mesh's triangles
}

TEST(SoftnessInC, OfAHardSurfaceIsTheCouplings) {
    const test::ScenePtr scene =
        test::parsed("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\n"
                     "volume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n");
    auto softness = sized<palpate_softness>();
    ASSERT_EQ(palpate_scene_softness(scene.get(), 0, &softness), PALPATE_OK);
    EXPECT_EQ(softness.is_soft, 0);
    EXPECT_EQ(softness.has_beneath, 0);
    EXPECT_EQ(softness.stiffness_n_per_m, 500.0);
    EXPECT_EQ(softness.stiffest, 1.0);
    const double place[3] = {0.02, 0.0, 0.0};
    double n_per_m = 0.0;
    EXPECT_EQ(palpate_scene_stiffness_at(scene.get(), 0, place, &n_per_m), PALPATE_OK);
    EXPECT_EQ(n_per_m, 500.0);
}

TEST(SoftnessInC, RefusesWhatItCannotTell) {
    const test::ScenePtr scene =
        test::parsed("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\n"
                     "volume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n");
    auto softness = sized<palpate_softness>();
    const double place[3] = {0.02, 0.0, 0.0};
    double n_per_m = 7.0;
    EXPECT_EQ(palpate_scene_softness(scene.get(), 1, &softness), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_scene_softness(scene.get(), 0, nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_scene_softness(nullptr, 0, &softness), PALPATE_BAD_CALL);
    softness.size -= 1;
    EXPECT_EQ(palpate_scene_softness(scene.get(), 0, &softness), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_scene_stiffness_at(scene.get(), 1, place, &n_per_m), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_scene_stiffness_at(scene.get(), 0, nullptr, &n_per_m), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_scene_stiffness_at(scene.get(), 0, place, nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(n_per_m, 7.0);
}

// What a scene's text says of softness is checked as it is in a file, with the same words.
TEST(SoftnessInC, IsRefusedInTheSameWordsAsInAFile) {
    palpate_error error = test::no_error();
    palpate_scene* scene = nullptr;
    const std::string text =
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\nvolume = \"v\"\n"
        "youngs_kpa = 10\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n";
    EXPECT_EQ(palpate_scene_parse(text.c_str(), "ball.toml", nullptr, &scene, &error),
              PALPATE_BAD_INPUT);
    EXPECT_NE(std::string(error.message).find("contact_radius_mm"), std::string::npos)
        << error.message;
    EXPECT_EQ(std::string(error.message).rfind("ball.toml:", 0), 0u) << error.message;
}

} // namespace
} // namespace palpate
