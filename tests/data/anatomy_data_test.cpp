// SPDX-License-Identifier: Apache-2.0
// What real files become: surfaces where the anatomy is. scripts/fetch_data.sh gets them.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/mesh_sharpness.h>
#include <palpate/geometry/surface_seeds.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

std::filesystem::path real_data(const std::string& name) {
    const char* folder = std::getenv("PALPATE_REAL_DATA");
    return std::filesystem::path(folder ? folder : "") / name;
}

#define PALPATE_NEEDS(name)                                                                        \
    if (!std::filesystem::exists(real_data(name)))                                                 \
    GTEST_SKIP() << real_data(name) << " is not there; scripts/fetch_data.sh gets it"

BakedSurface bake(const SceneDescription& scene, const std::string& surface) {
    return bake_surface(scene, surface, {});
}

SceneDescription atlas(const std::vector<std::string>& names) {
    std::string text = "[volume.atlas]\nfile = \"aal.nii.gz\"\n";
    for (const std::string& name : names)
        text += fmt::format("[surface.{0}]\nvolume = \"atlas\"\nlabel = \"{0}\"\n"
                            "[[effect]]\ntype = \"surface\"\nsurface = \"{0}\"\n",
                            name);
    return parse_scene(text + "[device]\ntype = \"orbit\"\nduration_s = 16\nspeed_m_per_s = 0.1\n"
                              "depth_min_mm = 0.5\ndepth_max_mm = 2\nturns = 8\n",
                       real_data("scene.toml"));
}

const std::vector<std::string> kEight{"Hippocampus_L", "Hippocampus_R", "Thalamus_L",
                                      "Thalamus_R",    "Putamen_L",     "Putamen_R",
                                      "Precentral_L",  "Precentral_R"};

// Volumes that mricron's table of AAL gives by counting voxels of 1 mm3.
TEST(Labels, KeepTheirVolumeAndLoseTheirStairs) {
    PALPATE_NEEDS("aal.nii.gz");
    for (const std::string& name : kEight) {
        const SceneDescription scene = atlas({name}); // alone: it reaches over no neighbour
        const BakedSurface baked = bake(scene, name);
        EXPECT_NEAR(baked.volume_mm3, baked.volume_before_mm3, 0.01 * baked.volume_before_mm3)
            << name;
        EXPECT_LT(std::abs(baked.shift.mean_m), 0.02e-3) << name;
        const TriangleMesh preview = baked.grid->preview(baked.level);
        const double volume_mm3 = 1e9 * inspect(preview).volume_m3;
        EXPECT_NEAR(volume_mm3, baked.volume_before_mm3, 0.01 * baked.volume_before_mm3) << name;
#ifdef PALPATE_WITH_CGAL
        const auto mesh = mesh_surface(baked, mesh_settings(scene.surfaces.at(name), baked),
                                       extract_isosurface, {});
        EXPECT_LE(share_of_sharp_edges(*mesh.mesh, 40.0), 0.01) << name;
        EXPECT_NEAR(1e9 * inspect(*mesh.mesh).volume_m3, baked.volume_before_mm3,
                    0.01 * baked.volume_before_mm3)
            << name;
#endif
    }
}

// Left is left: x grows to the patient's left in the scene frame.
TEST(Labels, OfTheLeftSideLieOnTheLeft) {
    PALPATE_NEEDS("aal.nii.gz");
    const SceneDescription scene = atlas(kEight);
    for (const std::string& name : kEight) {
        const Box box = bake(scene, name).field->bounds();
        if (name.ends_with("_L"))
            EXPECT_GT(box.center().x, 5e-3) << name;
        else
            EXPECT_LT(box.center().x, -5e-3) << name;
    }
}

TEST(Labels, EightStructuresAreTracedByNameInOneScene) {
    PALPATE_NEEDS("aal.nii.gz");
    const auto scene =
        std::make_shared<const Scene>(atlas(kEight), SceneResources{.files = scene_files()});
    ASSERT_EQ(scene->surfaces().size(), 8u);
    test::ScriptedClock clock;
    const Trace trace = run_trace(scene, device_states(*scene), clock);
    std::vector<std::size_t> felt(8, 0);
    for (const FrameReport& frame : trace.frames) {
        EXPECT_TRUE(is_finite(frame.force));
        if (frame.contacts == 0) continue;
        for (std::size_t s = 0; s < 8; ++s) {
            const SceneSurface& surface = scene->surfaces()[s];
            const auto sampler = surface.baked.field->make_sampler();
            // A proxy in contact is on the level of what it touches, to well below a voxel.
            if (std::abs(sampler->value(frame.proxy) - surface.level.level) < 0.01) ++felt[s];
        }
    }
    for (std::size_t s = 0; s < 8; ++s)
        EXPECT_GT(felt[s], 200u) << scene->surfaces()[s].name << " of 2000 frames each";
}

TEST(Skull, ItsFieldAndItsMeshAreWithoutWhatWasRemoved) {
    PALPATE_NEEDS("skull.nhdr");
    const SceneDescription scene =
        parse_scene("[volume.head]\nfile = \"skull.nhdr\"\n[surface.bone]\nvolume = \"head\"\n"
                    "iso_value = 226\nsmooth_voxels = 0.7\nkeep = \"largest\"\n",
                    real_data("scene.toml"));
    const BakedSurface baked = bake(scene, "bone");
    EXPECT_LT(std::abs(baked.shift.mean_m), 0.02e-3);
    const auto sampler = baked.field->make_sampler();
    std::size_t removed = 0;
    for (const VolumeComponent& component : baked.components) {
        if (component.kept) continue;
        ++removed;
        // From its voxel two voxels along each axis: nothing of it is left to touch.
        for (const Vec3& d : {Vec3(2e-3, 0, 0), Vec3(0, 2e-3, 0), Vec3(0, 0, 3e-3)}) {
            EXPECT_FALSE(
                sampler->first_root(component.sample - d, component.sample + d, baked.level));
            EXPECT_LT(sampler->value(component.sample), baked.level);
        }
    }
    EXPECT_GT(removed, 10u) << "the table's two rails and crumbs";
#ifdef PALPATE_WITH_CGAL
    // What the field has, the mesh has, and the other way round.
    const IsosurfaceSettings settings = mesh_settings(scene.surfaces.at("bone"), baked);
    const auto mesh = mesh_surface(baked, settings, extract_isosurface, {});
    const TriangleMesh preview = baked.grid->preview(baked.level);
    EXPECT_TRUE(
        missing_components(preview, *mesh.mesh, kSmallestComponentTriangles, settings.facet_size_m)
            .empty());
    // Specks far below a voxel are matched by a few vertices only, and may be missed either way.
    constexpr double speck_m2 = 1e-6;
    for (const ComponentMatch& match :
         missing_components(*mesh.mesh, preview, 1, settings.facet_size_m))
        EXPECT_LT(match.component.area_m2, speck_m2);
#endif
}

TEST(Macaque, ImageAndAtlasAreOfOnePlace) {
    PALPATE_NEEDS("inia19-NeuroMaps.nii.gz");
    const VoxelVolume image = read_volume(real_data("inia19-t1-brain.nii.gz"));
    const LabelVolume atlas = read_label_volume(real_data("inia19-NeuroMaps.nii.gz"));
    EXPECT_EQ(image.source_type, "float32");
    EXPECT_EQ(atlas.source_type, "int16");
    EXPECT_EQ(image.size, atlas.size);
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_LT(
            glm::length(image.index_to_scene.linear[axis] - atlas.index_to_scene.linear[axis]),
            1e-9);
    EXPECT_LT(glm::length(image.index_to_scene.offset - atlas.index_to_scene.offset), 1e-9)
        << "its qform says otherwise, by 77 mm";
    EXPECT_EQ(atlas.labels.size(), 724u) << "725 values, of which 0 is the background";
    // Labelled voxels are brain, which is bright.
    std::size_t labelled = 0, bright = 0;
    for (std::size_t voxel = 0; voxel < image.voxels(); ++voxel) {
        if (atlas.layers[0][voxel] == 0) continue;
        ++labelled;
        bright += image.values[voxel] > 0.0F ? 1 : 0;
    }
    EXPECT_GT(static_cast<double>(bright), 0.95 * static_cast<double>(labelled));
}

} // namespace
} // namespace palpate
