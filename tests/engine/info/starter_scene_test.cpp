// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/starter_scene.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/made_labels.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A ball of 1000 in air of -1000, 30 voxels of 1 mm along each axis, as a file.
class StarterScene : public testing::Test {
protected:
    StarterScene() {
        write_volume(test::sampled({30, 30, 30}, {Mat3(1e-3), Vec3(0.0)},
                                   [](const Vec3& at) {
                                       return glm::length(at - Vec3(0.015)) < 0.009 ? 1000 : -1000;
                                   }),
                     folder_ / "ball.nii.gz");
    }

    /// Two boxes with labels, whose names a table of that text gives.
    DataFile labels(const std::string& table) {
        write_volume(test::sampled({24, 12, 12}, {Mat3(1e-3), Vec3(0.0)},
                                   [](const Vec3& at) {
                                       if (at.y < 0.003 || at.y > 0.008) return 0;
                                       if (at.x > 0.003 && at.x < 0.009) return 4;
                                       return at.x > 0.013 && at.x < 0.021 ? 7 : 0;
                                   }),
                     folder_ / "two.nii.gz");
        test::make_file(folder_ / "two.txt", table);
        return read_data_file(folder_ / "two.nii.gz");
    }

    /// What is said of a choice that is no choice; empty where it is taken.
    std::string refusal(const DataFile& data, const StarterChoice& choice) {
        try {
            starter_scene(starter_data(data), choice, folder_ / "scene.toml");
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return {};
    }

    const test::TemporaryFolder folder_;
};

/// The only entry of a map.
template <class Map>
const typename Map::mapped_type& only(const Map& map) {
    EXPECT_EQ(map.size(), 1u);
    return map.begin()->second;
}

TEST_F(StarterScene, OfAVolumeIsReadBackWithItsFileAndALevelBetweenItsTwoValues) {
    const DataFile data = read_data_file(folder_ / "ball.nii.gz");
    const std::filesystem::path file = folder_ / "scene.toml";
    const SceneDescription scene = parse_scene(starter_scene(starter_data(data), {}, file), file);
    EXPECT_EQ(only(scene.volumes).file, folder_ / "ball.nii.gz");
    const SurfaceDescription& surface = only(scene.surfaces);
    EXPECT_EQ(surface.iso_value, 0.0); // half way: there are no values between
    EXPECT_EQ(surface.keep.kind, ComponentPolicy::Kind::largest);
    EXPECT_EQ(scene.effects.size(), 1u);
    EXPECT_EQ(scene.device.kind, DeviceDescription::Kind::orbit);
    // 2 % of 30 mm: a path of 5 mm would go through.
    EXPECT_EQ(scene.device.depth_max_mm, 0.6);

    const SceneDescription chosen =
        parse_scene(starter_scene(starter_data(data), {226.5, {}}, file), file);
    EXPECT_EQ(only(chosen.surfaces).iso_value, 226.5);
}

TEST_F(StarterScene, OfAVolumeWithGapsSmoothesNothing) {
    DataFile data = read_data_file(folder_ / "ball.nii.gz");
    const std::filesystem::path file = folder_ / "scene.toml";
    EXPECT_GT(
        only(parse_scene(starter_scene(starter_data(data), {}, file), file).surfaces).smooth_voxels,
        0.0);
    auto& values = std::get<VoxelVolume>(data.content).values;
    values[values.size() / 2] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(
        only(parse_scene(starter_scene(starter_data(data), {}, file), file).surfaces).smooth_voxels,
        0.0);
}

TEST_F(StarterScene, GoesSlowlyAroundSmallThingsWithSmallFacets) {
    StarterData data = starter_data(read_data_file(folder_ / "ball.nii.gz"));
    const std::filesystem::path file = folder_ / "scene.toml";
    const SceneDescription usual = parse_scene(starter_scene(data, {}, file), file);
    EXPECT_EQ(usual.device.speed_m_per_s, 0.2);
    EXPECT_FALSE(only(usual.surfaces).facet_size_mm);
    data.bounds.lower = Vec3(0.0);
    for (const double size_mm : {10.0, 1.0, 0.01}) {
        data.bounds.upper = Vec3(1e-3 * size_mm);
        const SceneDescription small = parse_scene(starter_scene(data, {}, file), file);
        EXPECT_NEAR(*only(small.surfaces).facet_size_mm, std::max(0.02 * size_mm, 1e-3), 1e-9);
        EXPECT_NEAR(*only(small.surfaces).facet_distance_mm,
                    0.1 * *only(small.surfaces).facet_size_mm, 1e-9);
        if (size_mm == 1.0) {
            EXPECT_EQ(small.device.speed_m_per_s, 0.01);
        }
    }
}

TEST_F(StarterScene, NamesItsFileFromTheScenesFolderAlsoWhereThatIsALink) {
    std::filesystem::create_directories(folder_ / "a/b");
    std::filesystem::create_directory_symlink(folder_ / "a/b", folder_ / "link");
    const StarterData data = starter_data(read_data_file(folder_ / "ball.nii.gz"));
    for (const char* name : {"scene.toml", "a/scene.toml", "link/scene.toml"}) {
        const std::filesystem::path file = folder_ / name;
        const std::string text = starter_scene(data, {}, file);
        EXPECT_THAT(text, Not(HasSubstr(folder_.path().string()))) << name;
        for (const auto& opened : {file, std::filesystem::canonical(file.parent_path()) / "s"}) {
            const SceneDescription scene = parse_scene(text, opened);
            EXPECT_TRUE(
                std::filesystem::equivalent(only(scene.volumes).file, folder_ / "ball.nii.gz"))
                << opened;
        }
    }
}

TEST_F(StarterScene, OfLabelsNamesEachByWhatIsItsAlone) {
    const DataFile data = labels("4 Left Lobe \\ one\n7 left lobe one\n");
    const std::filesystem::path file = folder_ / "scene.toml";
    const SceneDescription scene = parse_scene(starter_scene(starter_data(data), {}, file), file);
    std::set<std::string> named;
    for (const auto& [key, surface] : scene.surfaces) {
        EXPECT_THAT(key, testing::MatchesRegex("[a-z0-9_]+"));
        EXPECT_EQ(surface.labels.size(), 1u);
        named.insert(surface.labels.front());
    }
    EXPECT_EQ(named, (std::set<std::string>{"Left Lobe \\ one", "left lobe one"}));
    EXPECT_EQ(only(scene.volumes).labels, folder_ / "two.txt");

    // It points to softness and lumps: without the #, they are of the last surface.
    std::string text = starter_scene(starter_data(data), {}, file);
    EXPECT_THAT(text, HasSubstr("# beneath = { LUMP = 10.0 }"));
    EXPECT_THAT(text, HasSubstr("docs/palpation.md"));
    text.erase(text.find("# stiffness_n_per_mm"), 2);
    const SceneDescription soft = parse_scene(text, file);
    EXPECT_EQ(std::count_if(soft.surfaces.begin(), soft.surfaces.end(),
                            [](const auto& one) { return !one.second.softness.none(); }),
              1);

    // One name for both: their numbers tell them apart.
    const DataFile same = labels("4 lobe\n7 lobe\n");
    const SceneDescription apart = parse_scene(starter_scene(starter_data(same), {}, file), file);
    std::set<std::string> numbers;
    for (const auto& [key, surface] : apart.surfaces)
        numbers.insert(surface.labels.front());
    EXPECT_EQ(numbers, (std::set<std::string>{"4", "7"}));
}

TEST_F(StarterScene, OfLabelsWithNamesLongerThanALine) {
    const std::string one(100, 'a'), two(120, 'b');
    const DataFile data = labels("4 " + one + "\n7 " + two + "\n");
    const std::filesystem::path file = folder_ / "scene.toml";
    const SceneDescription scene = parse_scene(starter_scene(starter_data(data), {}, file), file);
    EXPECT_TRUE(scene.surfaces.contains(one));
    EXPECT_TRUE(scene.surfaces.contains(two));
}

TEST_F(StarterScene, ATextBesideDataThatNamesNothingIsNoTable) {
    test::make_file(folder_ / "ball.txt", "Scanned on Monday\n");
    EXPECT_TRUE(
        std::holds_alternative<VoxelVolume>(read_data_file(folder_ / "ball.nii.gz").content));
    EXPECT_EQ(labels("Scanned on Monday\n").labels, std::filesystem::path());
    EXPECT_EQ(labels("4 Four\n").labels, folder_ / "two.txt");
    // A file that names its own labels.
    test::make_file(folder_ / "own.seg.nrrd",
                    "NRRD0004\nencoding: raw\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nspace: "
                    "LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
                    "Segment0_Name:=Liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n\n" +
                        std::string(8, '\1'));
    test::make_file(folder_ / "own.txt", "1 Other\n");
    const DataFile own = read_data_file(folder_ / "own.seg.nrrd");
    EXPECT_EQ(std::get<LabelVolume>(own.content).labels.at(0).name, "Liver");
    EXPECT_EQ(own.labels, std::filesystem::path());
}

TEST_F(StarterScene, OfManyLabelsFeelsTheLargest) {
    DataFile data;
    data.file = folder_ / "many.nii.gz";
    test::make_file(data.file, "");
    // Label n has n voxels, of 1 to 20.
    data.content =
        test::made_labels({20, 20, 1}, {Mat3(1e-3), Vec3(0.0)}, 20, [](const Vec3& index) {
            return index.x <= index.y ? static_cast<int>(index.y) + 1 : 0;
        });
    const std::vector<std::size_t> largest = largest_labels(starter_data(data));
    EXPECT_EQ(largest, (std::vector<std::size_t>{12, 13, 14, 15, 16, 17, 18, 19}));
}

TEST_F(StarterScene, OfAMeshKeepsItsUnitAndFrame) {
    const std::filesystem::path file = folder_ / "scene.toml";
    write_ply(test::icosphere(0.02, 2), folder_ / "ball.ply");
    for (const MeshUnit unit : {MeshUnit::as_stated, MeshUnit::metre}) {
        FileInfoSettings settings;
        settings.mesh.unit = unit;
        const DataFile data = read_data_file(folder_ / "ball.ply", settings);
        const SceneDescription scene =
            parse_scene(starter_scene(starter_data(data), {}, file), file);
        const SurfaceDescription& surface = only(scene.surfaces);
        EXPECT_EQ(surface.mesh, folder_ / "ball.ply");
        EXPECT_EQ(surface.mesh_file.unit,
                  unit == MeshUnit::metre ? MeshUnit::metre : MeshUnit::millimetre);
        EXPECT_EQ(surface.mesh_file.frame, MeshFrame::lps);
    }
}

TEST_F(StarterScene, SaysWhatThereIsInsteadOfAChoiceThatIsNone) {
    const DataFile ball = read_data_file(folder_ / "ball.nii.gz");
    for (const double iso : {-1000.0, 1000.5, -2000.0})
        EXPECT_THAT(refusal(ball, {iso, {}}), HasSubstr("go from -1000 to 1000")) << iso;
    EXPECT_EQ(refusal(ball, {1000.0, {}}), "");
    EXPECT_THAT(refusal(ball, {{}, {"bone"}}), HasSubstr("has measured values"));
    const DataFile two = labels("4 Hippocampus_L\n7 Hippocampus_R\n");
    EXPECT_THAT(refusal(two, {1.5, {}}), HasSubstr("choose labels"));
    EXPECT_THAT(refusal(two, {{}, {"Hipocampus_L"}}), HasSubstr("Hippocampus_L"));
    EXPECT_EQ(refusal(two, {{}, {"hippocampus_r", "4"}}), "");

    write_volume(test::sampled({4, 4, 4}, {Mat3(1e-3), Vec3(0.0)}, [](const Vec3&) { return 0.5; }),
                 folder_ / "plain.nii.gz");
    EXPECT_THAT(refusal(read_data_file(folder_ / "plain.nii.gz"), {}),
                HasSubstr("it has no surface"));
}

// A number stands for a label in each layer, as a segmentation with overlaps has them.
TEST_F(StarterScene, OfLayersNoNumberStandsForAnotherStructure) {
    LabelVolume volume;
    volume.size = {4, 1, 1};
    volume.index_to_scene.linear = Mat3(1e-3);
    volume.layers.emplace_back(std::vector<std::int32_t>{1, 2, 0, 0});
    volume.layers.emplace_back(std::vector<std::int32_t>{0, 0, 1, 1});
    volume.labels = {{"nodule", 1, 0, {}}, {"nodule", 2, 0, {}}, {"liver", 1, 1, {}}};
    test::make_file(folder_ / "a.seg.nrrd", "its name alone is looked at");
    const StarterData data = starter_data(DataFile{folder_ / "a.seg.nrrd", {}, {}, volume});
    for (const StarterLabel& label : data.labels)
        for (const std::size_t found : find_labels(volume, {&label.named, 1}))
            EXPECT_EQ(volume.labels[found].name, label.name);
    const std::string text = starter_scene(data, {}, folder_ / "scene.toml");
    const auto first = text.find("label = \"nodule\"");
    ASSERT_NE(first, std::string::npos) << text;
    EXPECT_EQ(text.find("label = \"nodule\"", first + 1), std::string::npos)
        << "one surface of both";
    const std::string one = "1";
    try {
        find_labels(volume, {&one, 1});
        FAIL() << "which layer's 1?";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("is \"nodule\" in one layer and \"liver\" in "
                                                     "another; give a name"));
    }
}

} // namespace
} // namespace palpate
