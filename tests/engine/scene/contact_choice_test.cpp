// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/contact_choice.h>

#include <optional>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>

namespace palpate {
namespace {

/// A scan, which nobody reads here, and a formula.
SceneDescription scene_with(const SurfaceDescription& surface) {
    SceneDescription scene;
    scene.volumes["scan"].file = "scan.nhdr";
    scene.volumes["ball"].analytic = "solid_sphere";
    scene.volumes["ball"].parameters["radius_mm"] = 20.0;
    scene.surfaces["s"] = surface;
    return scene;
}

SurfaceDescription surface_of(const std::string& volume, const std::string& mesh = "") {
    SurfaceDescription surface;
    surface.volume = volume;
    surface.mesh = mesh;
    return surface;
}

std::optional<ContactKind> previewed(const SurfaceDescription& surface) {
    return preview_of(scene_with(surface)).surfaces.at("s").contact;
}

TEST(PreviewOf, IsVolumeWhereAMeshWouldBeExtracted) {
    SurfaceDescription surface = surface_of("scan");
    EXPECT_EQ(previewed(surface), ContactKind::volume);
    for (const ContactKind contact :
         {ContactKind::volume, ContactKind::guarded, ContactKind::mesh, ContactKind::direct}) {
        surface.contact = contact;
        EXPECT_EQ(previewed(surface), ContactKind::volume) << name(contact);
    }
}

TEST(PreviewOf, LeavesWhatNeedsNoExtraction) {
    EXPECT_EQ(previewed(surface_of("ball")), std::nullopt);
    EXPECT_EQ(previewed(surface_of("scan", "bone.ply")), std::nullopt);
    EXPECT_EQ(previewed(surface_of("", "bone.ply")), std::nullopt);
}

TEST(PreviewOf, IsKeptInARecordingsOverrides) {
    SceneOverrides overrides;
    EXPECT_EQ(to_json(overrides).find("preview"), std::string::npos);
    overrides.preview = true;
    SceneDescription scene = scene_with(surface_of("scan"));
    apply(overrides_from_json(to_json(overrides)), scene);
    EXPECT_EQ(scene.surfaces.at("s").contact, ContactKind::volume);
}

} // namespace
} // namespace palpate
