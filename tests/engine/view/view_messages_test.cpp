// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/view/coarse_mesh.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/view_document.h>
#include <palpate/engine/view/view_page.h>

#include "tests/engine/view/frame_columns.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::shared_ptr<const Scene> cavity(const std::string& of_surface = "strength_n = 3.0\n") {
    return std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 40\n[surface.wall]\n"
                    "volume = \"v\"\n" +
                        of_surface + "[[effect]]\ntype = \"surface\"\nsurface = \"wall\"\n",
                    "cavity.toml"));
}

TEST(ViewDocument, OfAFormulaHasItsSurface) {
    const auto scene = cavity();
    const ViewDocument document = view_document(*scene, ViewMode::live);
    ASSERT_EQ(document.structures.size(), 1u);
    EXPECT_EQ(document.structures[0].name, "wall");
    EXPECT_EQ(document.structures[0].bit, 0);
    EXPECT_NE(document.structures[0].material.find("yields above 3 N"), std::string::npos);
    ASSERT_TRUE(document.structures[0].mesh);
    const TriangleMesh& mesh = *document.structures[0].mesh;
    ASSERT_GT(mesh.triangles.size(), 1000u);
    // Nothing of the box that the formula was sampled in: all is on the sphere. The trilinear value
    // between nodes of some 1 mm is off by their squared distance over the radius at most.
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t vertex : triangle)
            EXPECT_NEAR(glm::length(mesh.vertices[vertex]), 0.04, 1e-3 * 1e-3 / 0.04);
    ASSERT_EQ(document.effects.size(), 1u);
    EXPECT_EQ(document.effects[0].name, "wall");
}

TEST(ViewDocument, SaysOfASurfaceWhatIsFelt) {
    const auto material = [](const std::string& of_surface) {
        return view_document(*cavity(of_surface), ViewMode::live).structures.at(0).material;
    };
    const std::string coupling = "\n[coupling]\nstiffness_n_per_m = 500\n";
    const std::string soft = material("stiffness_n_per_mm = 0.2" + coupling);
    EXPECT_THAT(soft, HasSubstr("soft: 0.2 N/mm"));
    EXPECT_THAT(soft, Not(HasSubstr("hard")));
    // What is not softer than the coupling cannot be felt to be soft.
    const std::string stiff = material("stiffness_n_per_mm = 0.6" + coupling);
    EXPECT_THAT(stiff, HasSubstr("hard"));
    EXPECT_THAT(stiff, Not(HasSubstr("soft:")));
    const std::string both = material("stiffness_n_per_mm = 0.2\nstrength_n = 1" + coupling);
    EXPECT_THAT(both, AllOf(HasSubstr("soft: 0.2 N/mm"), HasSubstr("yields above 1 N")));
}

TEST(SceneMessage, SaysWhatThePageExpects) {
    const auto scene = cavity();
    ViewDocument document = view_document(*scene, ViewMode::playback);
    document.device = "orbit";
    document.marks = {{"here", {0.01, 0.02, 0.03}, 1.5, "wall"}};
    const std::vector<FrameReport> frames = test::odd_frames(17);
    const ViewFrames sent{frames, 0, 0};
    const std::string bytes = scene_message(document, {{2000, 1'000'000}}, &sent);
    const test::ContainerReader read(bytes);
    EXPECT_EQ(read.document.at("kind"), "scene");
    EXPECT_EQ(read.document.at("mode"), "playback");
    EXPECT_EQ(read.document.at("title"), "cavity.toml");
    EXPECT_EQ(read.document.at("method"), "adaptive");
    EXPECT_EQ(read.document.at("axes"), "LPS");
    EXPECT_EQ(read.document.at("flags").at(3).at("name"), "inside_at_start");
    EXPECT_EQ(read.document.at("effects").at(0).at("parts").at(0).at("name"), "strength");
    EXPECT_EQ(read.document.at("marks").at(0).at("name"), "here");
    EXPECT_NEAR(read.document.at("view").at("radius_m").get<double>(), 0.04 * std::sqrt(3.0), 1e-3);

    const auto& structure = read.document.at("structures").at(0);
    ASSERT_EQ(structure.at("levels").size(), 2u); // coarse first
    const std::size_t all = document.structures[0].mesh->triangles.size();
    EXPECT_EQ(structure.at("facets_most"), all);
    EXPECT_LE(structure.at("levels")[0].at("facets").get<std::size_t>(), 2000u);
    EXPECT_EQ(structure.at("levels")[1].at("facets").get<std::size_t>(), all);
    for (const auto& level : structure.at("levels")) {
        const auto positions = read.blob<std::uint16_t>(level.at("positions"), "u16");
        const auto indices = read.blob<std::uint32_t>(level.at("indices"), "u32");
        EXPECT_EQ(indices.size(), 3 * level.at("facets").get<std::size_t>());
        for (const std::uint32_t index : indices)
            ASSERT_LT(index, positions.size() / 3);
        // In the box of the structure, each vertex is on the sphere or, of a coarse one, inside it.
        const auto low = structure.at("box_m")[0].get<std::vector<double>>();
        const auto high = structure.at("box_m")[1].get<std::vector<double>>();
        for (std::size_t at = 0; at < positions.size(); at += 3) {
            Vec3 place{0.0};
            for (std::size_t axis = 0; axis < 3; ++axis)
                place[static_cast<int>(axis)] =
                    low[axis] + (high[axis] - low[axis]) * positions[at + axis] / 65535.0;
            EXPECT_NEAR(glm::length(place), 0.04, 1e-3);
        }
    }
    const std::vector<FrameReport> back = test::frames_in(read);
    ASSERT_EQ(back.size(), frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i)
        EXPECT_TRUE(test::is_as_sent(frames[i], back[i])) << "frame " << i;
}

TEST(FramesMessage, TellsHowASoftSurfaceIsPressedIn) {
    std::vector<FrameReport> frames = test::odd_frames(3);
    const std::string hard = frames_message({frames, 0, 0});
    EXPECT_FALSE(
        test::ContainerReader(hard).document.at("frames").at("columns").contains("indentation_m"));
    frames[1].indentation_m = 3.25e-3;
    frames[1].stiffness_n_per_m = 187.5;
    frames[1].pressed_surface = 4;
    frames[1].front = {0.1 / 3.0, -0.0, 5e-324};
    const std::string bytes = frames_message({frames, 0, 0});
    const test::ContainerReader read(bytes);
    EXPECT_EQ(read.column<float>("indentation_m", "f32"),
              (std::vector<float>{0.0F, 3.25e-3F, 0.0F}));
    EXPECT_EQ(read.column<float>("stiffness_n_per_m", "f32"),
              (std::vector<float>{0.0F, 187.5F, 0.0F}));
    EXPECT_EQ(read.column<std::uint32_t>("pressed", "u32"), (std::vector<std::uint32_t>{0, 5, 0}));
    const auto front = read.column<double>("front_m", "f64");
    ASSERT_EQ(front.size(), 9u);
    EXPECT_EQ(front[0], frames[0].proxy.x) << "where nothing is pressed in, it is the proxy";
    EXPECT_EQ(front[3], frames[1].front.x);
    EXPECT_EQ(front[8], frames[2].proxy.z);
}

TEST(FramesMessage, HasTheTrialOfEachFrame) {
    std::vector<FrameReport> frames(3);
    frames[1].trial = 1;
    frames[2].trial = 0xffff'ffff;
    const std::string bytes = frames_message({frames, 0, 0});
    EXPECT_EQ(test::ContainerReader(bytes).column<std::uint32_t>("trial", "u32"),
              (std::vector<std::uint32_t>{0, 1, 0xffff'ffff}));
}

TEST(FramesMessage, CountsWhatWasLost) {
    const std::vector<FrameReport> frames = test::odd_frames(5);
    const std::string bytes = frames_message({frames, 1000, 12});
    const test::ContainerReader read(bytes);
    EXPECT_EQ(read.document.at("kind"), "frames");
    EXPECT_EQ(read.document.at("frames").at("first"), 1000);
    EXPECT_EQ(read.document.at("frames").at("lost"), 12);
    EXPECT_EQ(test::frames_in(read).size(), 5u);
    const std::string empty = frames_message({});
    EXPECT_TRUE(test::frames_in(test::ContainerReader(empty)).empty());
}

TEST(MeshMessage, IsOneStructureInMoreDetail) {
    const ViewDocument document = view_document(*cavity(), ViewMode::live);
    const std::string bytes = mesh_message(document, 0, 5000);
    const test::ContainerReader read(bytes);
    EXPECT_EQ(read.document.at("kind"), "mesh");
    const auto& levels = read.document.at("structures").at(0).at("levels");
    ASSERT_EQ(levels.size(), 1u);
    EXPECT_LE(levels[0].at("facets").get<std::size_t>(), 5000u);
    EXPECT_THROW(mesh_message(document, 1, 5000), std::invalid_argument);
    EXPECT_THROW(mesh_message(document, 0, 0), std::invalid_argument);
}

std::string unpacked(const std::string& page) {
    const std::string begin = "data-encoding=\"gzip+base64\">";
    const std::size_t from = page.find(begin) + begin.size();
    const std::string text = page.substr(from, page.find("</script>", from) - from);
    std::string packed;
    std::uint32_t bits = 0;
    int count = 0;
    constexpr std::string_view digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (const char c : text) {
        if (c == '=') break;
        bits = bits << 6 | static_cast<std::uint32_t>(digits.find(c));
        if ((count += 6) >= 8) packed += static_cast<char>(bits >> (count -= 8) & 0xffu);
    }
    std::string bytes(1u << 24, '\0');
    z_stream stream{};
    inflateInit2(&stream, 15 + 16);
    stream.next_in = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_out = static_cast<uInt>(bytes.size());
    EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
    bytes.resize(stream.total_out);
    inflateEnd(&stream);
    return bytes;
}

TEST(PlaybackPage, HasTheContainerInItByteForByte) {
    const std::string page = "<html><!-- PALPATE-DATA --><script>let it = 1;</script></html>";
    const std::vector<FrameReport> frames = test::odd_frames(1000);
    const std::string container = frames_message({frames, 0, 0});
    const std::string whole = playback_page(page, container);
    EXPECT_EQ(unpacked(whole), container);
    EXPECT_TRUE(whole.starts_with("<html><script type=\"application/octet-stream\""));
    EXPECT_TRUE(whole.ends_with("</script><script>let it = 1;</script></html>"));
    EXPECT_THROW(playback_page("<html></html>", container), std::invalid_argument);
}

TEST(ViewPage, OfAFileIsRefusedWhereItIsNone) {
    test::TemporaryFolder folder;
    test::make_file(folder / "page.html", "<html></html>");
    EXPECT_THROW(view_page(folder / "page.html"), std::runtime_error);
    EXPECT_THROW(view_page(folder / "none.html"), std::runtime_error);
    test::make_file(folder / "page.html", "<html><!-- PALPATE-DATA --></html>");
    EXPECT_EQ(view_page(folder / "page.html"), "<html><!-- PALPATE-DATA --></html>");
}

TEST(ViewMarks, ComeBackFromTheirFile) {
    test::TemporaryFolder folder;
    EXPECT_EQ(marks_file("/a/recording-001.h5"), "/a/recording-001.mrk.json");
    EXPECT_TRUE(read_marks(folder / "none.mrk.json").empty());
    const std::vector<ViewMark> marks{{"Sella \"turcica\"", {0.0123, -0.04, 0.1}, 1.25, "bone"},
                                      {"", {0.0, 0.0, 0.0}, 0.0, ""}};
    test::make_file(folder / "a.mrk.json", marks_as_json(marks));
    const std::vector<ViewMark> back = read_marks(folder / "a.mrk.json");
    ASSERT_EQ(back.size(), 2u);
    EXPECT_EQ(back[0].name, marks[0].name);
    EXPECT_LT(glm::length(back[0].at - marks[0].at), 1e-15); // m to mm and back rounds twice
    EXPECT_EQ(back[0].time_s, 1.25);
    EXPECT_EQ(back[0].felt, "bone");
    test::make_file(folder / "b.mrk.json", "{\"markups\": 3}");
    EXPECT_THROW(read_marks(folder / "b.mrk.json"), std::runtime_error);
    // One that somebody set in Slicer has no time.
    test::make_file(folder / "c.mrk.json",
                    R"({"markups": [{"controlPoints": [{"label": "F-1", "description": "",
                    "position": [1, 2, 3]}]}]})");
    ASSERT_EQ(read_marks(folder / "c.mrk.json").size(), 1u);
    EXPECT_FALSE(read_marks(folder / "c.mrk.json")[0].time_s);
}

TEST(SceneMessage, HasTheNumbersOfFramesBetweenWhichSomeWereNotRecorded) {
    const ViewDocument document = view_document(*cavity(), ViewMode::playback);
    std::vector<FrameReport> frames = test::odd_frames(4);
    const ViewFrames row{frames, 0, 0};
    const std::string whole = scene_message(document, {}, &row);
    EXPECT_FALSE(
        test::ContainerReader(whole).document.at("frames").at("columns").contains("number"));
    frames[2].frame = 7;
    frames[3].frame = 8;
    const ViewFrames gap{frames, 0, 0};
    const std::string bytes = scene_message(document, {}, &gap);
    EXPECT_EQ(test::ContainerReader(bytes).column<std::uint32_t>("number", "u32"),
              (std::vector<std::uint32_t>{0, 1, 7, 8}));
}

TEST(ViewMarks, ThatSlicerHasSavedAreWhereSlicerHasThem) {
    test::TemporaryFolder folder;
    test::make_file(folder / "a.mrk.json",
                    R"({"markups": [{"coordinateSystem": "RAS", "controlPoints": [
                    {"label": "here", "position": [1, 2, 3], "positionStatus": "defined"},
                    {"label": "not yet", "position": "", "positionStatus": "undefined"}]}]})");
    const std::vector<ViewMark> marks = read_marks(folder / "a.mrk.json");
    ASSERT_EQ(marks.size(), 1u);
    EXPECT_LT(glm::length(marks[0].at - Vec3(-1e-3, -2e-3, 3e-3)), 1e-15);
}

TEST(ViewDocument, WhatNothingFeelsMayBeWhatNoSliceShows) {
    test::TemporaryFolder folder;
    test::make_file(folder / "fibres.nrrd",
                    "NRRD0004\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\n"
                    "sizes: 3 2 2 2\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"
                    "kinds: vector domain domain domain\nspace origin: (0,0,0)\n"
                    "encoding: raw\n\n" +
                        std::string(24, 'v'));
    const Scene scene(
        parse_scene("[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 40\n[volume.fibres]\n"
                    "file = \"fibres.nrrd\"\n[surface.wall]\nvolume = \"v\"\n[[effect]]\n"
                    "type = \"surface\"\nsurface = \"wall\"\n",
                    folder / "cavity.toml"));
    const ViewDocument document = view_document(scene, ViewMode::live);
    EXPECT_EQ(document.structures.size(), 1u);
    EXPECT_TRUE(document.volumes.empty());
    ASSERT_EQ(document.not_shown.size(), 1u);
    EXPECT_THAT(document.not_shown[0], testing::HasSubstr("fibres.nrrd"));
}

} // namespace
} // namespace palpate
