// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/file_info.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/record/recording.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/dicom_writer.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using nlohmann::json;
using test::TemporaryFolder;
using Picture = FileInfoSettings::Picture;

json document(const FileInfo& info) { return json::parse(info.json); }

json document(const std::filesystem::path& file, const FileInfoSettings& settings = {}) {
    return document(file_info(file, settings));
}

FileInfoSettings with_picture() {
    FileInfoSettings settings;
    settings.picture = Picture::overview;
    return settings;
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

bool is_png(const std::string& bytes) { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

std::string refusal(const std::filesystem::path& file, const FileInfoSettings& settings = {}) {
    try {
        file_info(file, settings);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    ADD_FAILURE() << "nothing was wrong with " << file;
    return {};
}

/// int16 or uint8 values as an NRRD file.
void write_nrrd(const std::filesystem::path& file, const std::string& type,
                const std::string& sizes, const std::string& more, const std::string& bytes) {
    test::make_file(file, "NRRD0004\ntype: " + type + "\nspace: left-posterior-superior\nsizes: " +
                              sizes + "\nendian: little\nencoding: raw\n" + more + "\n" + bytes);
}
const std::string kScalarGeometry =
    "dimension: 3\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (-5,10,20)\n";

/// 8 x 8 x 8 voxels: 0, and blocks of 2 x 2 x 2 of the values 1 to `labels`, at most 64.
std::string blocks(int labels) {
    std::string bytes;
    for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 8; ++i) {
                const int value = 1 + i / 2 + 4 * (j / 2) + 16 * (k / 2);
                test::append<std::int16_t>(bytes,
                                           static_cast<std::int16_t>(value <= labels ? value : 0));
            }
    return bytes;
}

void write_blocks(const std::filesystem::path& file, int labels) {
    write_nrrd(file, "int16", "8 8 8", kScalarGeometry, blocks(labels));
}

// --- Volumes

TEST(FileInfo, VolumeHasItsSizePlaceAndRangeWhereverItLies) {
    const TemporaryFolder folder;
    const AffineTransform frame = test::oblique_frame({1e-3, 2e-3, 0.5e-3}, {0.1, -0.2, 0.3});
    VoxelVolume volume = test::sampled({7, 6, 5}, frame, [](const Vec3& p) { return p.x * p.y; });
    volume.values[3] = -2.5F;
    volume.values[4] = 17.0F;
    write_volume(volume, folder / "scan.nrrd");
    const FileInfo info = file_info(folder / "scan.nrrd");
    const json said = document(info);
    EXPECT_EQ(said["kind"], "volume");
    EXPECT_EQ(said["size"], json({7, 6, 5}));
    EXPECT_EQ(said["range"], json({-2.5, 17.0}));
    EXPECT_FALSE(said.contains("labels"));
    const std::array<double, 3> spacing_mm{1.0, 2.0, 0.5};
    for (int column = 0; column < 3; ++column) {
        const auto c = static_cast<std::size_t>(column);
        // Files keep decimal numbers of 15 digits and more.
        EXPECT_NEAR(said["spacing_mm"][c].get<double>(), spacing_mm[c], 1e-9);
        EXPECT_NEAR(said["origin_mm"][c].get<double>(), 1e3 * frame.offset[column], 1e-9);
        const Vec3 direction = glm::normalize(frame.linear[column]);
        for (int row = 0; row < 3; ++row)
            EXPECT_NEAR(said["directions"][static_cast<std::size_t>(row)][c].get<double>(),
                        direction[row], 1e-9);
    }
    EXPECT_TRUE(contains(info.words, "7 x 6 x 5 voxels of 1 x 2 x 0.5 mm"));
    EXPECT_TRUE(contains(info.words, "values -2.5 to 17"));
    EXPECT_TRUE(contains(info.words, "runs to the patient's"));
    EXPECT_TRUE(contains(info.words, "840 bytes in memory"));
    EXPECT_EQ(info.picture, "");
}

TEST(FileInfo, PictureSaysWhereItsSurfaceIsAndTakesAnother) {
    const TemporaryFolder folder;
    const VoxelVolume volume =
        test::sampled({12, 12, 12}, {1e-3 * Mat3(1.0), Vec3(0.0)},
                      [](const Vec3& p) { return p.x < 0.0055 ? 10.25 : 90.25; });
    write_volume(volume, folder / "two.nii");
    FileInfoSettings settings = with_picture();
    const FileInfo found = file_info(folder / "two.nii", settings);
    EXPECT_TRUE(is_png(found.picture));
    EXPECT_TRUE(contains(found.words, "50.25, Otsu's threshold"));
    EXPECT_EQ(document(found)["picture_iso"], 50.25);
    settings.iso = 30.0;
    const FileInfo asked = file_info(folder / "two.nii", settings);
    EXPECT_TRUE(contains(asked.words, "at 30, as asked"));
    EXPECT_EQ(document(asked)["picture_iso"], 30.0);
    settings.iso = 5000.0;
    const std::string message = refusal(folder / "two.nii", settings);
    EXPECT_TRUE(message.starts_with((folder / "two.nii").string() + ": ")) << message;
    EXPECT_TRUE(contains(message, "10.25 to 90.25; choose one between")) << message;
}

TEST(FileInfo, VolumeOfOneValueSaysThatThereIsNoSurface) {
    const TemporaryFolder folder;
    const VoxelVolume volume =
        test::sampled({4, 4, 4}, {1e-3 * Mat3(1.0), Vec3(0.0)}, [](const Vec3&) { return 0.5; });
    write_volume(volume, folder / "flat.nrrd");
    const FileInfo info = file_info(folder / "flat.nrrd", with_picture());
    EXPECT_TRUE(contains(info.words, "no surface: all values are equal"));
    EXPECT_TRUE(document(info)["picture_iso"].is_null());
    EXPECT_TRUE(is_png(info.picture));
}

TEST(FileInfo, ValuesThatAreNotFiniteAreCounted) {
    const TemporaryFolder folder;
    VoxelVolume volume =
        test::sampled({4, 4, 4}, {1e-3 * Mat3(1.0), Vec3(0.0)}, [](const Vec3& p) { return p.x; });
    volume.values[1] = volume.values[2] = std::nanf("");
    write_volume(volume, folder / "holes.nrrd");
    const FileInfo info = file_info(folder / "holes.nrrd");
    EXPECT_EQ(document(info)["not_finite"], 2);
    EXPECT_TRUE(contains(info.words, "2 values are not finite"));
}

// --- Labels

TEST(FileInfo, ALevelOfWhatIsNotMeasuredIsRefused) {
    const TemporaryFolder folder;
    write_blocks(folder / "atlas.nrrd", 6);
    test::make_file(folder / "atlas.txt", "1 Femur\n2 Tibia\n");
    FileInfoSettings settings = with_picture();
    settings.iso = 3.0;
    EXPECT_THROW(file_info(folder / "atlas.nrrd", settings), std::invalid_argument);
}

TEST(FileInfo, LabelsAreListedWithNameSizeAndPlace) {
    const TemporaryFolder folder;
    write_blocks(folder / "atlas.nrrd", 6);
    test::make_file(folder / "atlas.txt", "1 Femur\n2 Tibia\n6 Patella\n");
    const FileInfo info = file_info(folder / "atlas.nrrd", with_picture());
    const json said = document(info);
    EXPECT_EQ(said["kind"], "volume");
    EXPECT_EQ(said["range"], json({0, 6}));
    ASSERT_EQ(said["labels"].size(), 6U);
    const json& second = said["labels"][1];
    EXPECT_EQ(second["name"], "Tibia");
    EXPECT_EQ(second["value"], 2);
    EXPECT_EQ(second["voxels"], 8);
    EXPECT_NEAR(second["volume_mm3"].get<double>(), 8 * 6.0, 1e-9);
    // Voxels 2 and 3 along i, 0 and 1 along j and k, of 1 x 2 x 3 mm from -5, 10, 20, with their
    // borders.
    const std::array<std::array<double, 3>, 2> bounds{{{-3.5, 9.0, 18.5}, {-1.5, 13.0, 24.5}}};
    for (std::size_t end = 0; end < 2; ++end)
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(second["bounds_mm"][end][axis].get<double>(), bounds[end][axis], 1e-9);
    EXPECT_TRUE(contains(info.words, "6 labels"));
    EXPECT_TRUE(contains(info.words, "Tibia"));
    EXPECT_TRUE(contains(info.words, "-3.5 9.0 18.5 to -1.5 13.0 24.5"));
    EXPECT_TRUE(is_png(info.picture));
}

TEST(FileInfo, LabelsAreToldByTheirLooksAndByAGivenTable) {
    const TemporaryFolder folder;
    write_blocks(folder / "seg.nrrd", 5);
    EXPECT_EQ(document(folder / "seg.nrrd")["labels"][2]["name"], "3");
    test::make_file(folder / "names.txt", "3 Liver\n");
    FileInfoSettings settings;
    settings.labels = folder / "names.txt";
    EXPECT_EQ(document(folder / "seg.nrrd", settings)["labels"][2]["name"], "Liver");
}

TEST(FileInfo, WordsNameFortyLabelsAndJsonAll) {
    const TemporaryFolder folder;
    write_blocks(folder / "many.nrrd", 64);
    test::make_file(folder / "many.txt", "40 fortieth\n41 forty_first\n");
    const FileInfo info = file_info(folder / "many.nrrd");
    EXPECT_EQ(document(info)["labels"].size(), 64U);
    EXPECT_TRUE(contains(info.words, "fortieth"));
    EXPECT_FALSE(contains(info.words, "forty_first"));
    EXPECT_TRUE(contains(info.words, "and 24 more; --json lists all"));
    write_blocks(folder / "many.nrrd", 40);
    EXPECT_FALSE(contains(file_info(folder / "many.nrrd").words, "more; --json"));
}

TEST(FileInfo, SegmentationHasItsNamesColoursAndLayers) {
    const TemporaryFolder folder;
    std::string bytes;
    for (int voxel = 0; voxel < 64; ++voxel) {
        bytes += static_cast<char>(voxel < 32 ? 1 : 0); // layer 0
        bytes += static_cast<char>(voxel < 16 ? 1 : 0); // layer 1
    }
    write_nrrd(folder / "knee.seg.nrrd", "uint8", "2 4 4 4",
               "dimension: 4\nkinds: list domain domain domain\n"
               "space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
               "Segment0_ID:=a\nSegment0_Name:=Bone\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
               "Segment0_Color:=1 0.5 0\n"
               "Segment1_ID:=b\nSegment1_Name:=Cyst\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n",
               bytes);
    const FileInfo info = file_info(folder / "knee.seg.nrrd", with_picture());
    const json said = document(info);
    ASSERT_EQ(said["labels"].size(), 2U);
    EXPECT_EQ(said["labels"][0]["name"], "Bone");
    EXPECT_EQ(said["labels"][0]["color"], json({255, 128, 0}));
    EXPECT_EQ(said["labels"][1]["name"], "Cyst");
    EXPECT_EQ(said["labels"][1]["voxels"], 16);
    EXPECT_EQ(said["labels"][1]["layer"], 1);
    EXPECT_TRUE(contains(info.words, "2 labels in 2 layers"));
    EXPECT_TRUE(is_png(info.picture));
    test::make_file(folder / "knee.seg.nhdr", test::content_of(folder / "knee.seg.nrrd"));
    EXPECT_EQ(document(file_info(folder / "knee.seg.nhdr"))["labels"].size(), 2U);
}

TEST(FileInfo, NotesBesideAScanDoNotMakeItLabels) {
    const TemporaryFolder folder;
    write_volume(test::random_volume({1e-3 * Mat3(1.0), Vec3(0.0)}), folder / "scan.nrrd");
    test::make_file(folder / "scan.txt", "Patient moved during the scan, please repeat.\n");
    const FileInfo info = file_info(folder / "scan.nrrd");
    EXPECT_FALSE(document(info).contains("labels"));
    EXPECT_TRUE(contains(info.words, "warning: is not read as labels, though it has scan.txt"));
    // Nor where its values are whole numbers.
    int voxel = 0;
    const auto whole_number = [&](const Vec3&) { return ++voxel * 37 % 1000 - 500; };
    write_volume(test::sampled({11, 7, 5}, {1e-3 * Mat3(1.0), Vec3(0.0)}, whole_number),
                 folder / "scan.nrrd");
    const FileInfo whole = file_info(folder / "scan.nrrd");
    EXPECT_FALSE(document(whole).contains("labels"));
    EXPECT_TRUE(contains(whole.words, "warning: is not read as labels, though it has scan.txt"));
}

TEST(FileInfo, GivenTableOfAScanThatIsNoLabelVolumeIsAnError) {
    const TemporaryFolder folder;
    write_volume(test::random_volume({1e-3 * Mat3(1.0), Vec3(0.0)}), folder / "scan.nrrd");
    test::make_file(folder / "names.txt", "1 one\n");
    FileInfoSettings settings;
    settings.labels = folder / "names.txt";
    EXPECT_TRUE(refusal(folder / "scan.nrrd", settings)
                    .starts_with((folder / "scan.nrrd").string() + ": "));
}

TEST(FileInfo, NamesThatAreNotUtf8StillMakeADocument) {
    const TemporaryFolder folder;
    write_blocks(folder / "atlas.nrrd", 2);
    test::make_file(folder / "atlas.txt", "1 Kn\xF6"
                                          "chel\n2 b\n"); // Latin-1
    const json said = document(folder / "atlas.nrrd");
    ASSERT_EQ(said["labels"].size(), 2U);
    EXPECT_TRUE(contains(said["labels"][0]["name"].get<std::string>(), "chel"));
}

// --- Several volumes

TEST(FileInfo, FolderWithTwoSeriesListsThemUntilOneIsChosen) {
    const TemporaryFolder folder;
    const VoxelVolume volume =
        test::sampled({5, 4, 3}, {1e-3 * Mat3(1.0), Vec3(0.0)},
                      [](const Vec3& p) { return std::round(1e3 * (p.x + 7 * p.y - 3 * p.z)); });
    test::DicomSeriesOptions first;
    first.description = "thick";
    test::write_dicom_series(folder.path(), volume, first);
    test::DicomSeriesOptions second;
    second.number = 2;
    second.description = "thin";
    second.series_uid += ".2";
    second.prefix = "other_";
    test::write_dicom_series(folder.path(), volume, second);

    const FileInfo info = file_info(folder.path(), with_picture());
    const json said = document(info);
    EXPECT_EQ(said["kind"], "volumes");
    ASSERT_EQ(said["entries"].size(), 2U);
    EXPECT_TRUE(contains(info.words, "choose one with --series"));
    EXPECT_TRUE(contains(info.words, "thin"));
    EXPECT_EQ(info.picture, "");
    FileInfoSettings settings;
    for (const json& entry : said["entries"]) {
        EXPECT_TRUE(entry["readable"]);
        settings.selection.series = entry["selector"];
        EXPECT_EQ(document(folder.path(), settings)["size"], json({5, 4, 3}));
    }
    settings.selection.series = "thin";
    EXPECT_EQ(document(folder.path(), settings)["kind"], "volume");
}

// --- Vectors

TEST(FileInfo, VectorsSayTheirComponentsFrameAndMagnitude) {
    const TemporaryFolder folder;
    std::string bytes;
    for (int voxel = 0; voxel < 27; ++voxel)
        for (const float component : {3.0F, 0.0F, 4.0F})
            test::append<float>(bytes, voxel % 3 == 0 ? component : 0.0F);
    const std::string geometry =
        "dimension: 4\nkinds: vector domain domain domain\n"
        "space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
        "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n";
    write_nrrd(folder / "flow.nrrd", "float", "3 3 3 3", geometry, bytes);
    const FileInfo info = file_info(folder / "flow.nrrd", with_picture());
    const json said = document(info);
    EXPECT_EQ(said["kind"], "vectors");
    EXPECT_EQ(said["size"], json({3, 3, 3}));
    EXPECT_EQ(said["components"], 3);
    EXPECT_EQ(said["content"], "vector");
    EXPECT_EQ(said["magnitude_range"], json({0.0, 5.0}));
    EXPECT_NEAR(said["nonzero_share"].get<double>(), 1.0 / 3.0, 1e-12);
    EXPECT_TRUE(contains(info.words, "33.3 % of the voxels are not zero"));
    EXPECT_TRUE(contains(info.words, "measurement frame"));
    EXPECT_TRUE(is_png(info.picture));
}

TEST(FileInfo, TensorsSayThatTheyAre) {
    const TemporaryFolder folder;
    std::string bytes;
    for (int voxel = 0; voxel < 8; ++voxel)
        for (const float component : {1.0F, 2.0F, 0.0F, 0.0F, 2.0F, 2.0F})
            test::append<float>(bytes, component);
    write_nrrd(folder / "dti.nrrd", "float", "6 2 2 2",
               "dimension: 4\nkinds: 3D-symmetric-matrix domain domain domain\n"
               "space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
               "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n",
               bytes);
    const FileInfo info = file_info(folder / "dti.nrrd");
    EXPECT_EQ(document(info)["content"], "symmetric_tensor");
    EXPECT_EQ(document(info)["components"], 6);
    // 1 + 4 on the diagonal, twice 4 and 4 beside it.
    EXPECT_NEAR(document(info)["magnitude_range"][1].get<double>(), std::sqrt(21.0), 1e-12);
    EXPECT_TRUE(contains(info.words, "tensor volume"));
}

// --- Meshes

TEST(FileInfo, MeshHasTheKeysThatScriptsRelyOn) {
    const TemporaryFolder folder;
    write_ply(test::box_mesh({-0.01, 0.0, 0.02}, {0.01, 0.03, 0.04}), folder / "box.ply");
    FileInfoSettings settings = with_picture();
    settings.count_intersections = [](const TriangleMesh& mesh) { return mesh.triangles.size(); };
    const FileInfo info = file_info(folder / "box.ply", settings);
    const json said = document(info);
    EXPECT_EQ(said["kind"], "mesh");
    EXPECT_EQ(said["vertices"], 8);
    EXPECT_EQ(said["triangles"], 12);
    EXPECT_EQ(said["degenerate"], 0);
    EXPECT_EQ(said["closed"], true);
    EXPECT_EQ(said["manifold"], true);
    EXPECT_EQ(said["frame"], "LPS");
    EXPECT_EQ(said["frame_stated"], true);
    EXPECT_EQ(said["unit"], "mm");
    EXPECT_EQ(said["self_intersections"], 12);
    const std::array<std::array<double, 3>, 2> bounds{{{-10, 0, 20}, {10, 30, 40}}};
    for (std::size_t end = 0; end < 2; ++end)
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(said["bounds_mm"][end][axis].get<double>(), bounds[end][axis], 1e-9);
    EXPECT_TRUE(contains(info.words, "12 self-intersecting pairs"));
    EXPECT_TRUE(is_png(info.picture));
    EXPECT_TRUE(document(folder / "box.ply")["self_intersections"].is_null());
}

TEST(FileInfo, MeshIsReadInTheFrameAndUnitThatAreAskedFor) {
    const TemporaryFolder folder;
    test::make_file(folder / "leaf.obj", "v 0.1 0.2 0.3\nv 0.2 0.2 0.3\nv 0.1 0.3 0.3\nf 1 2 3\n");
    const FileInfo assumed = file_info(folder / "leaf.obj");
    EXPECT_EQ(document(assumed)["frame"], "LPS");
    EXPECT_EQ(document(assumed)["frame_stated"], false);
    EXPECT_TRUE(contains(assumed.words, "frame LPS (assumed), unit mm (assumed)"));
    EXPECT_NEAR(document(assumed)["bounds_mm"][0][0].get<double>(), 0.1, 1e-12);
    FileInfoSettings settings;
    settings.mesh = {MeshFrame::ras, MeshUnit::metre};
    const FileInfo asked = file_info(folder / "leaf.obj", settings);
    EXPECT_EQ(document(asked)["frame"], "RAS");
    EXPECT_EQ(document(asked)["unit"], "m");
    EXPECT_NEAR(document(asked)["bounds_mm"][0][0].get<double>(), -200.0, 1e-9);
    EXPECT_TRUE(contains(asked.words, "frame RAS (as asked), unit m (as asked)"));
}

TEST(FileInfo, DefectsOfAMeshAreCountedAndExplained) {
    const TemporaryFolder folder;
    TriangleMesh mesh = test::box_mesh(Vec3(-0.01), Vec3(0.01));
    mesh.triangles.pop_back();
    write_ply(mesh, folder / "open.ply");
    const FileInfo info = file_info(folder / "open.ply", with_picture());
    const json said = document(info);
    EXPECT_EQ(said["closed"], false);
    EXPECT_EQ(said["border_edges"], 3);
    EXPECT_FALSE(said["contact"].empty());
    for (const json& sentence : said["contact"])
        EXPECT_TRUE(contains(info.words, sentence.get<std::string>()));
    EXPECT_TRUE(contains(info.words, "not closed: 3 open edges"));
    EXPECT_TRUE(contains(info.words, "edges that are open or not manifold are red"));
    write_ply(test::reversed(test::icosphere(0.02, 1)), folder / "reversed.ply");
    EXPECT_EQ(document(folder / "reversed.ply")["inside_out"], 1);
    EXPECT_TRUE(contains(file_info(folder / "reversed.ply").words, "1 component is inside out"));
}

TEST(FileInfo, MeshWithoutAnAreaHasNoPictureAndSaysWhy) {
    const TemporaryFolder folder;
    test::make_file(folder / "line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    EXPECT_EQ(document(folder / "line.obj")["degenerate"], 1);
    EXPECT_TRUE(contains(refusal(folder / "line.obj", with_picture()), "line.obj: no picture: "));
}

// --- Scenes and recordings

TEST(FileInfo, ScenesAndRecordingsHaveNoPicture) {
    const TemporaryFolder folder;
    test::make_file(folder / "a.toml", "[volume.ball]\nanalytic = \"solid_sphere\"\n"
                                       "radius_mm = 10.0\n[surface.skin]\nvolume = \"ball\"\n"
                                       "iso_value = 0.0\n[[effect]]\ntype = \"surface\"\n"
                                       "surface = \"skin\"\n");
    const FileInfo scene = file_info(folder / "a.toml", with_picture());
    EXPECT_EQ(document(scene)["kind"], "scene");
    EXPECT_EQ(document(scene)["effects"], json({"surface"}));
    EXPECT_EQ(scene.picture, "");
    Recording recording;
    recording.scene_file = "a.toml";
    recording.frames.resize(3);
    recording.inputs.resize(3);
    recording.frames[1].contacts = 1;
    write_recording(folder / "a.h5", recording);
    const FileInfo played = file_info(folder / "a.h5", with_picture());
    EXPECT_EQ(document(played)["kind"], "recording");
    EXPECT_EQ(document(played)["frames_in_contact"], 1);
    EXPECT_EQ(played.picture, "");
}

TEST(FileInfo, WhatIsNotThereIsNamed) {
    const TemporaryFolder folder;
    for (const char* name : {"a.nrrd", "a.seg.nrrd", "a.nii.gz", "a.vdb", "a.ply", "a.stl",
                             "a.toml", "a.h5", "folder", "a.xyz"}) {
        const std::string message = refusal(folder / name);
        EXPECT_TRUE(message.starts_with((folder / name).string() + ":")) << message;
        EXPECT_TRUE(contains(message, "; ")) << "no remedy: " << message;
        EXPECT_FALSE(contains(message, "\n")) << message;
    }
}

} // namespace
} // namespace palpate
