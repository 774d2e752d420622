// SPDX-License-Identifier: Apache-2.0
// A scene's text beside data that a program has in memory.
#include <palpate/engine/scene/scene_file.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/run/trace.h>

#include "tests/support/memory_scenes.h"
#include "tests/support/same_reports.h"

namespace palpate {
namespace {

const std::string kText = "[volume.ct]\n"
                          "[surface.ball]\nvolume = \"ct\"\niso_value = 500\n"
                          "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";
const std::string kMeshText =
    "[surface.ball]\n[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

SceneData voxels() {
    SceneData data;
    data.volumes["ct"].voxels = std::make_shared<const VoxelVolume>(test::ball_voxels());
    return data;
}

SceneData mesh() {
    SceneData data;
    data.meshes["ball"] = std::make_shared<const TriangleMesh>(test::ball_mesh());
    return data;
}

std::string refusal(const std::string& text, const SceneData& data) {
    try {
        parse_scene(text, "s.toml", data);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

Trace felt(const SceneDescription& description) {
    test::ScriptedClock clock;
    const auto scene = std::make_shared<const Scene>(description, test::ball_resources());
    return run_trace(scene, test::around_ball(), clock);
}

void expect_the_same(const SceneDescription& text, const SceneDescription& code) {
    const Trace found = felt(text), expected = felt(code);
    std::size_t in_contact = 0;
    for (std::size_t i = 0; i < expected.frames.size(); ++i) {
        ASSERT_EQ(test::difference(found.frames[i], expected.frames[i]), "") << "frame " << i;
        in_contact += expected.frames[i].contacts;
    }
    EXPECT_GT(in_contact, 100u);
}

TEST(SceneData, VoxelsAreFeltAsInASceneMadeInCode) {
    const SceneData data = voxels();
    SceneDescription code = test::ball_scene();
    code.volumes["ct"].voxels = data.volumes.at("ct").voxels;
    const SceneDescription text = parse_scene(kText, "s.toml", data);
    EXPECT_EQ(text.volumes.at("ct").voxels, code.volumes["ct"].voxels) << "it was copied";
    expect_the_same(text, code);
}

TEST(SceneData, AViewOfTheProgramsMemoryIsFeltAsItsOwnVoxelsAre) {
    const SceneData own = voxels();
    VoxelVolume viewed = *own.volumes.at("ct").voxels;
    const auto memory =
        std::make_shared<std::vector<float>>(viewed.values.begin(), viewed.values.end());
    viewed.values = VoxelNumbers<float>::view(*memory, memory);
    SceneData view;
    view.volumes["ct"].voxels = std::make_shared<const VoxelVolume>(std::move(viewed));
    expect_the_same(parse_scene(kText, "s.toml", view), parse_scene(kText, "s.toml", own));
}

TEST(SceneData, AMeshIsFeltAsInASceneMadeInCode) {
    const SceneData data = mesh();
    SceneDescription code;
    code.surfaces["ball"].triangle_mesh = data.meshes.at("ball");
    code.effects.push_back(effects::Surface{.surface = "ball"});
    expect_the_same(parse_scene(kMeshText, "s.toml", data), code);
}

TEST(SceneData, ATableWithASourceOfItsOwnIsRefusedAtItsLine) {
    EXPECT_TRUE(refusal("[volume.ct]\nfile = \"a.nrrd\"\n", voxels())
                    .starts_with("s.toml:2: file in [volume.ct] and data in memory exclude each "
                                 "other; keep one of them"));
    EXPECT_TRUE(refusal("[volume.ct]\nanalytic = \"slab\"\n", voxels())
                    .starts_with("s.toml:2: analytic in [volume.ct] and data in memory exclude"));
    EXPECT_TRUE(refusal("[volume.ct]\nlabels = \"a.txt\"\n", voxels())
                    .starts_with("s.toml:2: unknown key \"labels\" in [volume.ct] beside data in "
                                 "memory; "));
    EXPECT_TRUE(refusal("[surface.ball]\nmesh = \"a.ply\"\n", mesh())
                    .starts_with("s.toml:2: mesh in [surface.ball] is of a mesh file, and the mesh "
                                 "is in memory; "));
    EXPECT_TRUE(
        refusal("[surface.ball]\nfacet_size_mm = 1\n", mesh())
            .starts_with("s.toml:2: facet_size_mm in [surface.ball] does not go with mesh"));
}

TEST(SceneData, DataWithoutATableAndATableWithoutDataAreRefused) {
    EXPECT_EQ(refusal("", voxels()), "s.toml: data in memory is for [volume \"ct\"], which the "
                                     "scene does not have; add [volume.ct]");
    EXPECT_EQ(refusal("", mesh()), "s.toml: data in memory is for [surface \"ball\"], which the "
                                   "scene does not have; add [surface.ball]");
    EXPECT_TRUE(
        refusal(kText, {}).starts_with("s.toml:1: key \"file\" is missing in [volume.ct]; "));
}

TEST(SceneData, WhatIsWrongWithTheDataIsToldAtTheTablesLine) {
    SceneData data = voxels();
    VoxelVolume wrong = *data.volumes["ct"].voxels;
    wrong.values.pop_back();
    data.volumes["ct"].voxels = std::make_shared<const VoxelVolume>(std::move(wrong));
    EXPECT_TRUE(refusal("\n" + kText, data)
                    .starts_with("s.toml:2: volumes[\"ct\"].voxels.values has 26999 numbers"));
}

} // namespace
} // namespace palpate
