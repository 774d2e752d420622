// SPDX-License-Identifier: Apache-2.0
// Where two labels touch their levels are tangent: the proxy froze in the groove between them.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/scripted_clock.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

constexpr double kMm = 1e-3;

/// Two bodies that touch at x = 16 mm: a slab whose halves are labels 1 and 2, and on it the
/// rounded half balls 3 and 4, which leave a valley between them.
class TouchingLabels : public testing::Test {
protected:
    TouchingLabels() {
        write_volume(test::sampled({32, 32, 24}, {Mat3(kMm), Vec3(0.0)},
                                   [](const Vec3& p) {
                                       const Vec3 v = p / kMm;
                                       if (v.x < 4 || v.x > 27 || v.y < 4 || v.y > 27 || v.z < 4)
                                           return 0;
                                       if (v.z < 10) return v.x < 16 ? 1 : 2;
                                       if (glm::length(v - Vec3(10.3, 16, 10)) < 6.2) return 3;
                                       if (glm::length(v - Vec3(21.7, 16, 10)) < 6.2) return 4;
                                       return 0;
                                   }),
                     folder_ / "labels.nrrd");
    }

    SceneDescription scene(const std::string& more = {}) const {
        std::string text = "[volume.v]\nfile = \"labels.nrrd\"\n";
        for (int label = 1; label <= 4; ++label)
            text += fmt::format("[surface.s{0}]\nvolume = \"v\"\nlabel = {0}\n{1}"
                                "contact = \"volume\"\n[[effect]]\ntype = \"surface\"\n"
                                "surface = \"s{0}\"\n",
                                label, more);
        return parse_scene(text, folder_ / "scene.toml");
    }

    test::TemporaryFolder folder_;
};

/// Strokes 2 mm below the slab's face and through the valley, along the border and across it.
std::vector<std::pair<Vec3, Vec3>> strokes() {
    return {{{16, 2, 8}, {16.4, 30, 8}},    {{15.8, 30, 7.5}, {16.1, 2, 8.2}},
            {{8, 5, 8}, {24, 7, 8}},        {{6, 26, 7.9}, {26, 25, 7.4}},
            {{16, 4, 11}, {16, 28, 11}},    {{10, 15, 13}, {22, 17, 13}},
            {{16.3, 28, 9}, {15.7, 4, 9.5}}};
}

/// The longest run of stalled frames over all strokes. Each ends in free space, where nothing may
/// hold the proxy.
int longest_stall(const std::shared_ptr<const Scene>& scene, SteppingMethod method) {
    LoopDescription loop = scene->description().loop;
    loop.method = method;
    loop.sub_steps = 64;
    test::ScriptedClock clock(4.0); // us: paper has some 225 readings in its budget
    HapticLoop haptics(scene, clock, loop);
    DeviceState state;
    int run = 0, longest = 0;
    for (const auto& [from, to] : strokes()) {
        ++state.trial;
        // Down onto it from above, along, and up again: 0.1 m/s.
        const auto go = [&](const Vec3& a, const Vec3& b, int frames) {
            for (int i = 0; i <= frames; ++i) {
                state.position = kMm * (a + (1.0 * i / frames) * (b - a));
                state.time_s += 1e-3;
                const FrameReport report = haptics.frame(state);
                run = report.flags & kStalled ? run + 1 : 0;
                longest = std::max(longest, run);
            }
        };
        go({from.x, from.y, 20}, from, 100);
        go(from, to, 280);
        go(to, {to.x, to.y, 22}, 140);
        EXPECT_LT(glm::length(haptics.path().back() - state.position), 1e-9)
            << "method " << static_cast<int>(method);
    }
    return longest;
}

TEST_F(TouchingLabels, TheProxySlidesAlongTheBorderAndOverIt) {
    const auto loaded =
        std::make_shared<const Scene>(scene(), SceneResources{.files = scene_files()});
    // Method single has no second evaluation to look round an obstacle with; docs/paper.md.
    for (const SteppingMethod method :
         {SteppingMethod::paper, SteppingMethod::fixed, SteppingMethod::adaptive})
        EXPECT_LE(longest_stall(loaded, method), 5) << "method " << static_cast<int>(method);
}

TEST_F(TouchingLabels, AndWhereOneOfThemHasAMeshOfItsOwn) {
    SceneDescription alone = scene();
    alone.effects.resize(1);
    const BakedSurface baked = bake_surface(alone, "s1", {});
    write_ply(baked.grid->preview(baked.level), folder_ / "s1.ply");
    for (const ContactKind contact : {ContactKind::guarded, ContactKind::mesh}) {
        SceneDescription with_mesh = scene();
        with_mesh.surfaces.at("s1").mesh = folder_ / "s1.ply";
        with_mesh.surfaces.at("s1").contact = contact;
        const auto loaded =
            std::make_shared<const Scene>(with_mesh, SceneResources{.files = scene_files()});
        for (const SteppingMethod method :
             {SteppingMethod::paper, SteppingMethod::fixed, SteppingMethod::adaptive})
            EXPECT_LE(longest_stall(loaded, method), 5) << "contact " << static_cast<int>(contact)
                                                        << ", method " << static_cast<int>(method);
    }
}

TEST_F(TouchingLabels, OnlyLabelsThatAreFeltAlikeAreJoined) {
    EXPECT_EQ(labels_felt_alike(scene(), "s1"), (std::vector<std::string>{"2", "3", "4"}));
    EXPECT_TRUE(bake_surface(scene(), "s1", {}).joined);
    EXPECT_NE(baked_in_words(bake_surface(scene(), "s1", {})).find("no groove"), std::string::npos);

    EXPECT_TRUE(labels_felt_alike(scene("strength_n = 2\n"), "s1").empty());
    EXPECT_TRUE(labels_felt_alike(scene("keep = \"largest\"\n"), "s1").empty());
    EXPECT_TRUE(labels_felt_alike(scene("smooth_voxels = 0\n"), "s1").empty());
    SceneDescription one_is_soft = scene();
    one_is_soft.surfaces.at("s3").strength_n = 1.0;
    EXPECT_EQ(labels_felt_alike(one_is_soft, "s1"), (std::vector<std::string>{"2", "4"}));
    // What gives way ends where it does, and what is hard behind it begins there.
    SceneDescription one_is_pressed = scene();
    one_is_pressed.surfaces.at("s3").softness = Softness::linear(150.0);
    EXPECT_EQ(labels_felt_alike(one_is_pressed, "s1"), (std::vector<std::string>{"2", "4"}));
    EXPECT_TRUE(labels_felt_alike(one_is_pressed, "s3").empty());
    // A mesh is of its label alone, and so is the field that is felt beside it; others close the
    // groove from their side.
    SceneDescription one_has_a_mesh = scene();
    one_has_a_mesh.surfaces.at("s3").mesh = "s3.ply";
    EXPECT_EQ(labels_felt_alike(one_has_a_mesh, "s1"), (std::vector<std::string>{"2", "3", "4"}));
    EXPECT_TRUE(labels_felt_alike(one_has_a_mesh, "s3").empty());
    SceneDescription one_is_not_felt = scene();
    one_is_not_felt.effects.pop_back();
    EXPECT_EQ(labels_felt_alike(one_is_not_felt, "s1"), (std::vector<std::string>{"2", "3"}));
}

TEST_F(TouchingLabels, AJoinedLabelKeepsItsVolumeBesideTheReachOverItsNeighbours) {
    SceneDescription alone = scene();
    alone.effects.resize(1);
    const BakedSurface apart = bake_surface(alone, "s1", {});
    const BakedSurface joined = bake_surface(scene(), "s1", {});
    EXPECT_FALSE(apart.joined);
    EXPECT_EQ(joined.volume_mm3, apart.volume_mm3);
    EXPECT_EQ(joined.level, apart.level);
    // Away from the neighbours it is the same, up to the kernel's cut tail.
    const auto a = apart.field->make_sampler(), j = joined.field->make_sampler();
    for (double y = 6; y < 26; y += 0.7) {
        const Vec3 at = kMm * Vec3(4.0, y, 7.0);
        EXPECT_NEAR(a->value(at), j->value(at), 1e-3) << y;
    }
}

} // namespace
} // namespace palpate
