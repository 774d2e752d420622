// SPDX-License-Identifier: Apache-2.0
#ifdef PALPATE_WITH_CGAL
#include <palpate/palpate_c_extraction.h>

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/geometry/isosurface.h>

#include "tests/c/c_ball.h"
#include "tests/c/c_data.h"
#include "tests/c/c_handles.h"
#include "tests/support/memory_scenes.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

TEST(ExtractionInC, AMeshOfVoxelsIsFeltAsThatOfCpp) {
    const VoxelVolume voxels = test::ball_voxels();
    SceneDescription description = test::ball_scene();
    description.volumes["ct"].voxels = std::make_shared<const VoxelVolume>(voxels);
    description.surfaces["ball"].contact = ContactKind::mesh;
    const std::vector<FrameReport> expected = test::frames_of(std::make_shared<const Scene>(
        description, SceneResources{.files = scene_files(), .extract = extract_isosurface}));

    const test::DataPtr data = test::no_data();
    const palpate_voxels given = test::in_c(voxels);
    palpate_error error = test::no_error();
    ASSERT_EQ(palpate_data_add_voxels(data.get(), "ct", &given, &error), PALPATE_OK)
        << error.message;
    const std::string text = "[volume.ct]\n[surface.ball]\nvolume = \"ct\"\niso_value = 500\n"
                             "contact = \"mesh\"\n[[effect]]\ntype = \"surface\"\n"
                             "surface = \"ball\"\n";
    auto options = test::sized<palpate_scene_options>();
    options.data = data.get();
    palpate_scene* scene = nullptr;
    EXPECT_EQ(palpate_scene_parse(text.c_str(), "ball.toml", &options, &scene, &error),
              PALPATE_BAD_INPUT)
        << "without an extractor";
    options.extractor = palpate_cgal_extractor();
    const test::LoopPtr loop = test::made(test::parsed(text, &options));
    std::size_t i = 0, queries = 0;
    for (const DeviceState& hand : test::around_ball()) {
        const palpate_frame frame = test::frame_of(loop.get(), test::probe_of(hand));
        ASSERT_EQ(test::vec(frame.proxy_m), expected[i].proxy) << i;
        ASSERT_EQ(test::vec(frame.force_n), expected[i].force) << i;
        ASSERT_EQ(frame.surface_queries, expected[i].surface_queries) << i;
        queries += frame.surface_queries;
        ++i;
    }
    EXPECT_GT(queries, 0U);
    const test::TemporaryFolder folder;
    test::make_file(folder / "cache", "no folder");
    const std::string cache = (folder / "cache").string();
    options.cache = cache.c_str();
    const test::ScenePtr uncached = test::parsed(text, &options);
    ASSERT_EQ(palpate_scene_warning_count(uncached.get()), 1u);
    EXPECT_NE(std::string(palpate_scene_warning(uncached.get(), 0)).find("cannot be written"),
              std::string::npos)
        << palpate_scene_warning(uncached.get(), 0);
}

} // namespace
} // namespace palpate
#endif
