// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/output_files.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/record/trace_files.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/internal/film_mark.h>
#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

std::string complaint(const std::filesystem::path& output,
                      const std::vector<std::filesystem::path>& inputs,
                      Replace replace = Replace::own) {
    try {
        check_outputs(std::array{output}, inputs, replace);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

TEST(OutputFiles, OwnFilesAreKnownByWhatIsInThem) {
    const test::TemporaryFolder folder;
    write_frames_csv(folder / "frames.csv", {}, {});
    write_timing_csv(folder / "timing.csv", {});
    write_recording(folder / "recording.h5", {});
    write_ply(test::icosphere(0.01, 1, Vec3(0.0)), folder / "mesh.ply");
    test::make_file(folder / "drift.csv",
                    "frame,time_s,single_radius_mm,fixed_46_level_um\n0,0,1,2\n");
    test::make_file(folder / "view.html",
                    "<!DOCTYPE html>\n<html><head><title>Palpate</title></head></html>");
    const std::string film = std::string("\0\0\0\x08"
                                         "ftyp",
                                         8) +
                             std::string(internal::kFilmMark);
    test::make_file(folder / "film.mp4", film);
    for (const char* own : {"frames.csv", "timing.csv", "recording.h5", "mesh.ply", "drift.csv",
                            "view.html", "film.mp4"})
        EXPECT_TRUE(is_written_by_palpate(folder / own)) << own;

    test::make_file(folder / "a", "");
    test::make_file(folder / "b", "t_s,x_m,y_m,z_m\n0,0,0,0\n");
    test::make_file(folder / "c", "frame,time_s,my_force\n0,0,1\n");
    test::make_file(folder / "d", "ply\nformat ascii 1.0\ncomment SPACE=LPS\nend_header\n");
    test::make_file(folder / "e", "{\"version\": 3, \"scene\": \"mine\", \"machine\": 1}");
    test::make_file(folder / "f", "{ no json");
    test::make_file(folder / "g", "<!DOCTYPE html><title>Palpate, notes</title>");
    test::make_file(folder / "h", "\x89PNG\r\n\x1a\n and 40 more bytes of somebody else's picture");
    test::make_file(folder / "i", "\x89HDF\r\n\x1a\n");
    test::make_file(folder / "j", film + "more");
    for (const char* foreign : {"a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "none"})
        EXPECT_FALSE(is_written_by_palpate(folder / foreign)) << foreign;
}

TEST(OutputFiles, AnInputIsRefusedByAnyOfItsNamesAndForceDoesNotHelp) {
    const test::TemporaryFolder folder;
    write_frames_csv(folder / "frames.csv", {}, {});
    std::filesystem::create_symlink("frames.csv", folder / "soft.csv");
    std::filesystem::create_hard_link(folder / "frames.csv", folder / "hard.csv");
    for (const char* name : {"frames.csv", "soft.csv", "hard.csv", "./frames.csv"})
        for (const Replace replace : {Replace::own, Replace::any}) {
            EXPECT_NE(complaint(folder / name, {folder / "frames.csv"}, replace).find("is read as"),
                      std::string::npos)
                << name;
            EXPECT_NE(complaint(folder / "frames.csv", {folder / name}, replace), "") << name;
        }
    EXPECT_EQ(complaint(folder / "frames.csv", {folder / "none"}), "") << "own";
    EXPECT_EQ(complaint(folder / "new.csv", {folder / "frames.csv"}), "");
    EXPECT_NE(complaint(folder / "none/new.csv", {}).find("its folder does not exist"),
              std::string::npos);
}

TEST(OutputFiles, EverythingThatASceneIsReadFromIsAnInput) {
    const test::TemporaryFolder folder;
    for (const char* name :
         {"ct.nhdr", "aal.nii.gz", "names.txt", "aal.nii.txt", "bone.ply", "line.csv", "probe.csv"})
        test::make_file(folder / name, "NRRD0004\ndata file: ct.raw\n");
    const SceneDescription scene =
        parse_scene("[volume.a]\nfile = \"ct.nhdr\"\n[volume.b]\nfile = \"aal.nii.gz\"\nlabels = "
                    "\"names.txt\"\n[surface.s]\nmesh = \"bone.ply\"\n[[effect]]\ntype = "
                    "\"surface\"\nsurface = "
                    "\"s\"\n[device]\ntype = \"path\"\nfile = \"probe.csv\"\n",
                    folder / "scene.toml");
    const std::vector<std::filesystem::path> files = input_files(scene);
    for (const char* name : {"scene.toml", "ct.nhdr", "ct.raw", "aal.nii.gz", "names.txt",
                             "aal.nii.txt", "bone.ply", "probe.csv"})
        EXPECT_NE(std::find(files.begin(), files.end(), folder / name), files.end()) << name;
}

} // namespace
} // namespace palpate
