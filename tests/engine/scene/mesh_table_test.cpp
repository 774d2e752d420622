// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/scene_overrides.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using test::kBone;
using test::kSkin;

const std::string kMeshAlone = "[surface.bone]\nmesh = \"bone.ply\"\n"; // lines 1, 2

class MeshTable : public test::SceneFolder {
protected:
    MeshTable() { test::make_file(scene_file().parent_path() / "bone.ply", ""); }
    SurfaceDescription surface(const std::string& text) const {
        return parse(text).surfaces.begin()->second;
    }
};

TEST_F(MeshTable, AMeshAloneIsReadWithUnitAndFrame) {
    const SurfaceDescription bone =
        surface(kMeshAlone + "mesh_unit = \"m\"\nmesh_frame = \"RAS\"\ncontact = \"mesh\"\n"
                             "strength_n = 3\nyield = \"opens\"\n");
    EXPECT_EQ(bone.mesh, scene_file().parent_path() / "bone.ply");
    EXPECT_TRUE(bone.volume.empty());
    EXPECT_EQ(bone.mesh_file.unit, MeshUnit::metre);
    EXPECT_EQ(bone.mesh_file.frame, MeshFrame::ras);
    EXPECT_EQ(bone.contact, ContactKind::mesh);
    EXPECT_EQ(bone.strength_n, 3.0);
    EXPECT_EQ(bone.yielding, Yielding::opens);

    const SurfaceDescription plain = surface(kMeshAlone);
    EXPECT_EQ(plain.mesh_file.unit, MeshUnit::as_stated);
    EXPECT_EQ(plain.mesh_file.frame, MeshFrame::as_stated);
}

TEST_F(MeshTable, AMeshMayGoWithAVolumeAndAnyContact) {
    for (const char* contact : {"mesh", "volume", "guarded", "direct"}) {
        const SurfaceDescription bone =
            surface(kBone + "mesh = \"bone.ply\"\ncontact = \"" + contact + "\"\n");
        EXPECT_EQ(bone.volume, "head");
        EXPECT_EQ(bone.iso_value, 226.0);
        ASSERT_TRUE(bone.contact);
        EXPECT_EQ(name(*bone.contact), contact);
    }
    const SurfaceDescription guarded = surface(kBone + "mesh = \"bone.ply\"\nleash_mm = 0.5\n");
    EXPECT_FALSE(guarded.contact);
    EXPECT_EQ(guarded.leash_mm, 0.5);
}

TEST_F(MeshTable, WhatDoesNotGoTogetherIsRefusedWithLineAndRemedy) {
    const std::vector<std::pair<std::string, std::string>> wrong{
        {kMeshAlone + "iso_value = 1\n",
         "scene.toml:3: iso_value in [surface.bone] is of a volume, and the surface is a mesh "
         "alone; name the volume with volume = \"...\", or remove iso_value"},
        {kMeshAlone + "label = 1\n", "scene.toml:3: label in "},
        {kMeshAlone + "region_mm = [[0, 0, 0], [1, 1, 1]]\n", "scene.toml:3: region_mm in "},
        {kMeshAlone + "smooth_voxels = 1\n", "scene.toml:3: smooth_voxels in "},
        {kMeshAlone + "iso_after_smoothing = \"as_given\"\n",
         "scene.toml:3: iso_after_smoothing in "},
        {kMeshAlone + "keep = \"all\"\n", "scene.toml:3: keep in "},
        {kMeshAlone + "facet_size_mm = 1\n",
         "scene.toml:3: facet_size_mm in [surface.bone] does not go with mesh, which is taken as "
         "it is; leave mesh out, or remove facet_size_mm"},
        {kBone + "mesh = \"bone.ply\"\nfacet_distance_mm = 1\n",
         "scene.toml:7: facet_distance_mm in "},
        {kMeshAlone + "strength_n = [[0, 1], [1, 2]]\n",
         "scene.toml:3: strength_n in [surface.bone] is a function of a volume's value, and the "
         "surface is a mesh alone; name the volume with strength_volume"},
        {kMeshAlone + "contact = \"volume\"\n",
         "scene.toml:3: contact = \"volume\" in [surface.bone] needs a volume, and the surface is "
         "a "
         "mesh alone; give a volume too, or take contact = \"mesh\""},
        {kMeshAlone + "contact = \"guarded\"\n", "scene.toml:3: contact = "},
        {kMeshAlone + "contact = \"direct\"\n", "scene.toml:3: contact = "},
        {kMeshAlone + "leash_mm = 1\n",
         "scene.toml:3: leash_mm in [surface.bone] does not go with contact \"mesh\"; take contact "
         "= \"guarded\", or remove leash_mm"},
        {kBone + "contact = \"volume\"\nleash_mm = 1\n", "scene.toml:7: leash_mm in "},
        {kBone + "leash_mm = 0\n",
         "scene.toml:6: leash_mm = 0 in [surface.bone] is out of range; give a number in (0, 10]"},
        {kBone + "leash_mm = 10.5\n", "scene.toml:6: leash_mm = 10.5 in "},
        {kBone + "contact = \"direct\"\nyield = \"holds\"\n",
         "scene.toml:7: yield in [surface.bone] does not go with contact \"direct\", which never "
         "yields; take another contact, or remove yield"},
        {kBone + "mesh_unit = \"mm\"\n",
         "scene.toml:6: mesh_unit in [surface.bone] is of a mesh file, and there is none; name it "
         "with mesh = \"...\", or remove mesh_unit"},
        {kBone + "mesh_frame = \"LPS\"\n", "scene.toml:6: mesh_frame in "},
        {"[surface.bone]\nmesh = \"none.ply\"\n",
         "scene.toml:2: mesh = \"none.ply\" in [surface.bone] does not exist"},
        {kMeshAlone + "mesh_unit = \"cm\"\n", "scene.toml:3: unknown mesh_unit = \"cm\""},
        {kBone + "yield = \"breaks\"\n", "scene.toml:6: unknown yield = \"breaks\""},
        {kSkin + "leash_mm = 1\n", "scene.toml:6: leash_mm in "},
    };
    for (const auto& [text, start] : wrong) {
        const std::string message = complaint(text);
        EXPECT_TRUE(message.starts_with(start)) << message << "\nof\n" << text;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
    }
}

TEST_F(MeshTable, AFormulaIsNotMeshedButMayComeWithAMesh) {
    for (const char* contact : {"mesh", "guarded", "direct"}) {
        const std::string line = std::string("contact = \"") + contact + "\"\n";
        EXPECT_EQ(complaint(kSkin + line),
                  std::string("scene.toml:6: contact = \"") + contact +
                      "\" in [surface.skin] needs a mesh, and a surface given by a formula is not "
                      "meshed; name a mesh file, or take contact = \"volume\"");
        EXPECT_EQ(complaint(kSkin + "mesh = \"bone.ply\"\n" + line), "");
    }
}

// One table: what data and build allow decides, unless the scene says.
TEST_F(MeshTable, WithoutAContactTheSafestIsChosenThatDataAndBuildAllow) {
    struct Case {
        std::string text;
        ContactKind with_extraction, without;
    };
    const std::vector<Case> cases{
        {kMeshAlone, ContactKind::mesh, ContactKind::mesh},
        {kBone, ContactKind::guarded, ContactKind::volume},
        {kBone + "mesh = \"bone.ply\"\n", ContactKind::guarded, ContactKind::guarded},
        {kSkin, ContactKind::volume, ContactKind::volume},
        {kSkin + "mesh = \"bone.ply\"\n", ContactKind::guarded, ContactKind::guarded},
        {kBone + "contact = \"volume\"\n", ContactKind::volume, ContactKind::volume},
        {kBone + "contact = \"mesh\"\n", ContactKind::mesh, ContactKind::mesh},
    };
    for (const Case& one : cases) {
        const SceneDescription scene = parse(one.text);
        const SurfaceDescription& surface = scene.surfaces.begin()->second;
        const ContactChoice with = choose_contact(scene, surface, Extraction::possible);
        EXPECT_EQ(with.kind, one.with_extraction) << one.text;
        EXPECT_EQ(choose_contact(scene, surface, Extraction::impossible).kind, one.without)
            << one.text;
        EXPECT_TRUE(with.why.starts_with("contact " + std::string(name(with.kind)) + ": "))
            << with.why;
    }
}

TEST_F(MeshTable, AnOptionChangesTheContactOfEverySurfaceThatCan) {
    for (const char* contact : {"mesh", "volume", "guarded", "direct"}) {
        SceneDescription scene = parse(kBone);
        SceneOverrides overrides;
        overrides.contact = contact;
        apply(overrides, scene);
        ASSERT_TRUE(scene.surfaces.at("bone").contact);
        EXPECT_EQ(name(*scene.surfaces.at("bone").contact), contact);
    }
    const auto refused = [&](const std::string& text, const char* contact) {
        SceneDescription scene = parse(text);
        SceneOverrides overrides;
        overrides.contact = contact;
        try {
            apply(overrides, scene);
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_TRUE(refused(kMeshAlone, "volume")
                    .starts_with("--contact volume: [surface.bone]: needs a volume"));
    EXPECT_TRUE(refused(kSkin, "guarded").starts_with("--contact guarded: [surface.skin]: "));
    EXPECT_EQ(refused(kBone, "glue"),
              "--contact glue: must be one of mesh, volume, guarded, direct");
}

} // namespace
} // namespace palpate
