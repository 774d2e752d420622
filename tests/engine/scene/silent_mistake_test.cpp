// SPDX-License-Identifier: Apache-2.0
// Mistakes in a scene, a path or an option that were taken without a word, or told without a line.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/loop/scene_warnings.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/truth/no_contact.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

constexpr double kMm = 1e-3;

std::string complaint(const std::function<void()>& act) {
    try {
        act();
    } catch (const std::exception& error) {
        return error.what();
    }
    return {};
}

class BakedMistakes : public testing::Test {
protected:
    void write(const std::string& name, const std::function<double(const Vec3&)>& value) const {
        write_volume(test::sampled({24, 24, 24}, {Mat3(kMm), Vec3(0.0)}, value), folder_ / name);
    }
    std::string bake(const std::string& file, const std::string& keys,
                     const ResultCache& cache = {}) const {
        const SceneDescription scene =
            parse_scene("[volume.v]\nfile = \"" + file + "\"\n[surface.s]\nvolume = \"v\"\n" + keys,
                        folder_ / "scene.toml");
        return complaint([&] { bake_surface(scene, "s", cache); });
    }

    test::TemporaryFolder folder_;
};

/// Three regions, side by side.
double regions(const Vec3& p) {
    const Vec3 from_middle = p - Vec3(12 * kMm);
    if (glm::length(from_middle) > 9 * kMm) return 0.0;
    return p.x < 9 * kMm ? 3.0 : p.x < 15 * kMm ? 4.0 : 9.0;
}

TEST_F(BakedMistakes, AnIsoValueOfALabelMapIsRefused) {
    write("atlas.nrrd", regions);
    const std::string said = bake("atlas.nrrd", "iso_value = 3.5\n");
    EXPECT_THAT(said, HasSubstr("scene.toml:3: [surface.s]: iso_value 3.5 is of the label map"));
    EXPECT_THAT(said, HasSubstr("give label"));
    EXPECT_EQ(bake("atlas.nrrd", "label = 4\n"), "");
    // Two values are a mask; with names beside it, it is a label map.
    write("mask.nrrd", [](const Vec3& p) { return regions(p) > 0.0 ? 1.0 : 0.0; });
    // What was kept before does not change that.
    const ResultCache cache(folder_ / "cache");
    EXPECT_EQ(bake("mask.nrrd", "iso_value = 0.5\n", cache), "");
    test::make_file(folder_ / "mask.txt", "Scanned on Monday\n");
    EXPECT_EQ(bake("mask.nrrd", "iso_value = 0.5\n", cache), "");
    test::make_file(folder_ / "mask.txt", "1 Tumour\n");
    EXPECT_THAT(bake("mask.nrrd", "iso_value = 0.5\n", cache), HasSubstr("is of the label map"));
    write("mask.seg.nrrd", [](const Vec3& p) { return regions(p) > 0.0 ? 1.0 : 0.0; });
    EXPECT_THAT(bake("mask.seg.nrrd", "iso_value = 0.5\n", cache),
                HasSubstr("is of the label map"));
}

TEST_F(BakedMistakes, HowAVolumeOfAnEffectWasReadIsTold) {
    const std::string header = "NRRD0004\nencoding: raw\nsizes: ";
    test::make_file(folder_ / "s.nrrd", header +
                                            "2 2 2\ndimension: 3\ntype: uchar\nspacings: 1 "
                                            "1 1\n\n" +
                                            std::string(8, '\1'));
    test::make_file(folder_ / "v.nrrd", header +
                                            "3 2 2 2\ndimension: 4\ntype: int8\nkinds: vector "
                                            "space space space\nspacings: nan 1 1 1\n\n" +
                                            std::string(24, '\1'));
    const Scene scene(parse_scene("[volume.s]\nfile = \"s.nrrd\"\n[volume.v]\nfile = \"v.nrrd\"\n"
                                  "[[effect]]\ntype = \"gradient_force\"\nvolume = \"s\"\n"
                                  "strength_n = 1.0\n"
                                  "[[effect]]\ntype = \"vector_force\"\nvolume = \"v\"\n"
                                  "strength_n = 1.0\n",
                                  folder_ / "scene.toml"),
                      SceneResources{.files = scene_files()});
    EXPECT_THAT(source_warnings(scene),
                testing::UnorderedElementsAre(
                    HasSubstr((folder_ / "s.nrrd").string() + ": states no patient space"),
                    HasSubstr((folder_ / "v.nrrd").string() + ": states no patient space"),
                    AllOf(HasSubstr((folder_ / "v.nrrd").string() + ": does not state the axes"),
                          HasSubstr("with a measurement frame"))));
}

// Between fat and bone lies no muscle. A map of numbers without names may be a property.
TEST_F(BakedMistakes, AnEffectOfALabelMapIsRefused) {
    const auto felt = [&](const std::string& file) {
        return complaint([&] {
            Scene(parse_scene("[volume.v]\nfile = \"" + file +
                                  "\"\n[[effect]]\ntype = \"gradient_force\"\nvolume = \"v\"\n"
                                  "strength_n = 1.0\n",
                              folder_ / "scene.toml"),
                  SceneResources{.files = scene_files()});
        });
    };
    write("tissue.seg.nrrd", regions);
    EXPECT_THAT(felt("tissue.seg.nrrd"), HasSubstr("not to be interpolated"));
    write("tissue.nrrd", regions);
    EXPECT_EQ(felt("tissue.nrrd"), "");
    test::make_file(folder_ / "tissue.txt", "3 fat\n4 muscle\n9 bone\n");
    EXPECT_THAT(felt("tissue.nrrd"), HasSubstr("scene.toml:1: [volume.v]: "));
}

TEST_F(BakedMistakes, AChoiceThatAVolumeOfVectorsHasNotIsRefusedWithItsLine) {
    test::make_file(folder_ / "v.nrrd",
                    "NRRD0004\nencoding: raw\nsizes: 3 1 1 1\ndimension: 4\ntype: int8\nkinds: "
                    "vector space space space\nspacings: nan 1 1 1\n\n\1\2\3");
    for (const char* choice : {"grid = \"density\"", "series = \"7\"", "slices = \"repair\"",
                               "nifti_transform = \"qform\""})
        EXPECT_THAT(complaint([&] {
                        Scene(parse_scene(std::string("[volume.v]\nfile = \"v.nrrd\"\n") + choice +
                                              "\n[[effect]]\ntype = \"vector_force\"\nvolume = "
                                              "\"v\"\nstrength_n = 1.0\n",
                                          folder_ / "scene.toml"),
                              SceneResources{.files = scene_files()});
                    }),
                    testing::StartsWith((folder_ / "scene.toml").string() +
                                        ":1: [volume.v]: " + (folder_ / "v.nrrd").string()))
            << choice;
}

TEST_F(BakedMistakes, AStructureOfAFewVoxelsIsTooSmallToMesh) {
    write("dot.nrrd", [](const Vec3& p) { return glm::length(p - Vec3(12 * kMm)) < 0.5 * kMm; });
    const SceneDescription scene = parse_scene(
        "[volume.v]\nfile = \"dot.nrrd\"\n[surface.s]\nvolume = \"v\"\niso_value = 0.5\n",
        folder_ / "scene.toml");
    const BakedSurface baked = bake_surface(scene, "s", ResultCache{});
    const IsosurfaceExtractor extract = [](const Isosurface&, const IsosurfaceSettings&,
                                           const Progress&) { return TriangleMesh{}; };
    EXPECT_THAT(complaint([&] { mesh_surface(baked, {}, extract, ResultCache{}); }),
                testing::HasSubstr("too small to make a mesh of; use contact = \"volume\""));
}

TEST_F(BakedMistakes, AMeshThatTheCacheCannotGiveIsMadeAgain) {
    write("ball.nrrd", [](const Vec3& p) { return glm::length(p - Vec3(12 * kMm)) < 8 * kMm; });
    const ResultCache cache(folder_ / "cache");
    const SceneDescription scene = parse_scene(
        "[volume.v]\nfile = \"ball.nrrd\"\n[surface.s]\nvolume = \"v\"\niso_value = 0.5\n",
        folder_ / "scene.toml");
    const BakedSurface baked = bake_surface(scene, "s", cache);
    const IsosurfaceExtractor extract = [](const Isosurface&, const IsosurfaceSettings&,
                                           const Progress&) { return test::icosphere(8 * kMm, 2); };
    const auto mesh = [&] { return mesh_surface(baked, {}, extract, cache); };
    const BakedMesh first = mesh();
    EXPECT_FALSE(first.from_cache);
    EXPECT_TRUE(mesh().from_cache);
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache"))
        if (entry.path().extension() == ".ply")
            cache.keep(entry.path().filename().string(),
                       [](const std::filesystem::path& file) { test::make_file(file, "x"); });
    const BakedMesh again = mesh();
    EXPECT_FALSE(again.from_cache);
    EXPECT_EQ(again.mesh->triangles, first.mesh->triangles);
    EXPECT_TRUE(mesh().from_cache);
}

TEST_F(BakedMistakes, WhatHasNoLineIsToldWithoutOne) {
    const auto of_device = [](const std::string& text, const std::filesystem::path& file) {
        return complaint([&] {
            SceneDescription scene = parse_scene(text, file);
            scene.device.kind = DeviceDescription::Kind::orbit;
            make_device(Scene(std::move(scene)));
        });
    };
    const std::string words = "there is no surface that is felt to go to";
    EXPECT_THAT(of_device("[loop]\nrate_hz = 1000\n", "v.toml"),
                testing::StartsWith("v.toml: [device]: " + words));
    EXPECT_THAT(of_device("", ""), testing::StartsWith("device: " + words));
    EXPECT_THAT(of_device("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\n"
                          "volume = \"v\"\n[device]\ntype = \"orbit\"\n",
                          ""),
                testing::StartsWith("scene:6: [device]: " + words));
}

TEST_F(BakedMistakes, AVolumeThatCannotBeReadIsToldWithTheScenesLine) {
    test::make_file(folder_ / "empty.nrrd", "");
    EXPECT_THAT(bake("empty.nrrd", "iso_value = 1\n"),
                HasSubstr("scene.toml:1: [volume.v]: " + (folder_ / "empty.nrrd").string()));
}

// Baking closes the groove between labels that touch; between two meshes of their own it stays.
TEST_F(BakedMistakes, LabelsWithMeshesOfTheirOwnBesideEachOtherAreWarnedOf) {
    write("atlas.nrrd", regions);
    test::make_file(folder_ / "three.ply", test::ascii_ply(test::icosphere(5 * kMm, 3)));
    const auto warnings = [&](const std::string& three, const std::string& four) {
        const auto surface = [](const std::string& name, const std::string& keys) {
            return "[surface." + name + "]\nvolume = \"v\"\n" + keys +
                   "[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
        };
        const Scene scene(
            parse_scene("[volume.v]\nfile = \"atlas.nrrd\"\n" +
                            surface("three", "label = 3\ncontact = \"volume\"\n" + three) +
                            surface("four", "label = 4\ncontact = \"volume\"\n" + four),
                        folder_ / "scene.toml"),
            SceneResources{.files = scene_files()});
        return scene.plan().warnings;
    };
    const std::string mesh = "mesh = \"three.ply\"\n";
    EXPECT_TRUE(warnings("", "").empty());
    EXPECT_TRUE(warnings(mesh, "").empty());
    const std::vector<std::string> said = warnings(mesh, mesh);
    ASSERT_EQ(said.size(), 2u);
    EXPECT_THAT(said[0], HasSubstr("surface four: where it touches other labels that are felt "));
}

TEST_F(BakedMistakes, ALabelOfAMeasuredImageIsRefused) {
    int n = 0; // whole numbers, as a CT has, of which hardly two neighbours are equal
    write("ct.nrrd", [&n](const Vec3& p) {
        n = (n * 1103 + 12345) % 2039;
        return std::floor(1e5 * (0.03 - glm::length(p - Vec3(12 * kMm)))) + n % 40 - 1000;
    });
    const std::string said = bake("ct.nrrd", "label = 100\n");
    EXPECT_THAT(said, HasSubstr("scene.toml:3: [surface.s]: label is of "));
    EXPECT_THAT(said, HasSubstr("which is no label map"));
    EXPECT_THAT(bake("ct.nrrd", "label = \"Femur\"\n"), HasSubstr("which is no label map"));
}

// Outside is -1 in some atlases: it is a label, and what tells images from label maps is who is
// beside whom.
TEST_F(BakedMistakes, ALabelMapWithANegativeOutsideIsOne) {
    write("atlas.nrrd", [](const Vec3& p) {
        const auto block = [](double m) { return static_cast<int>(std::lround(m / kMm)) / 4; };
        const int i = block(p.x), j = block(p.y), k = block(p.z); // 0 to 5: 64 within
        if (std::min({i, j, k}) < 1 || std::max({i, j, k}) > 5) return -1.0;
        return 1.0 + (i - 1) + 5 * (j - 1) + 25 * (k - 1);
    });
    EXPECT_EQ(bake("atlas.nrrd", "label = 37\n"), "");
}

// A Gaussian takes what is no number to all voxels around: it is background before.
TEST_F(BakedMistakes, OneVoxelThatIsNoNumberIsOneHole) {
    const auto ball = [](double hole) {
        return [hole](const Vec3& p) {
            const Vec3 from_middle = p - Vec3(12 * kMm);
            if (glm::length(from_middle - Vec3(0, 0, 7 * kMm)) < 0.5 * kMm) return hole;
            return glm::length(from_middle) < 9 * kMm ? 1000.0 : 0.0;
        };
    };
    const auto field_of = [&](const char* file) {
        const SceneDescription scene =
            parse_scene(std::string("[volume.v]\nfile = \"") + file +
                            "\"\n[surface.s]\nvolume = \"v\"\niso_value = 500\nsmooth_voxels = 1\n",
                        folder_ / "scene.toml");
        return bake_surface(scene, "s", {});
    };
    write("hole.nrrd", ball(0.0));
    const BakedSurface expected = field_of("hole.nrrd");
    for (const double no_number :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        write("none.nrrd", ball(no_number));
        const BakedSurface found = field_of("none.nrrd");
        EXPECT_EQ(found.level, expected.level);
        const auto at = found.field->make_sampler(), there = expected.field->make_sampler();
        for (double z = 0.0; z < 24 * kMm; z += 0.25 * kMm) {
            const Vec3 p{12.3 * kMm, 11.8 * kMm, z};
            EXPECT_EQ(at->value(p), there->value(p)) << z;
        }
    }
}

// "level_keeping_position: ..." had neither file nor line.
TEST_F(BakedMistakes, SmoothingThatLeavesNoLevelIsToldWithItsLine) {
    // Single voxels that stand apart: a Gaussian of five voxels leaves nothing of them.
    write("dots.nrrd", [](const Vec3& p) {
        const auto at = [](double m) { return static_cast<int>(std::lround(m / kMm)); };
        const bool dot = at(p.x) % 8 == 4 && at(p.y) % 8 == 4 && at(p.z) % 8 == 4;
        return dot ? 1000.0 + 0.25 * at(p.x) : 0.5;
    });
    const std::string said = bake("dots.nrrd", "iso_value = 990\nsmooth_voxels = 5\n");
    EXPECT_THAT(said, HasSubstr("scene.toml:3: [surface.s]: "));
    EXPECT_THAT(said, HasSubstr("smooth"));
}

TEST(SilentMistakes, ADeepDocumentIsRefusedWithItsLine) {
    const auto said = [](const std::string& text) {
        return complaint([&] { parse_scene(text, "x.toml"); });
    };
    const auto times = [](int n, const std::string& what) {
        std::string text;
        for (int i = 0; i < n; ++i)
            text += what;
        return text;
    };
    EXPECT_THAT(said("\n" + times(40000, "a.") + "a = 1\n"),
                HasSubstr("x.toml:2: a key of more than 16 parts"));
    EXPECT_THAT(said("[" + times(40000, "a . ") + "a]\n"), HasSubstr("x.toml:1: a key of more"));
    EXPECT_THAT(said("[" + times(40000, "\"a\".") + "a]\n"), HasSubstr("x.toml:1: a key of more"));
    EXPECT_THAT(said("a = " + times(100000, "[") + "\n"), HasSubstr("x.toml:1: brackets in more"));
    EXPECT_THAT(said("a = " + times(100000, "{b=") + "\n"),
                HasSubstr("x.toml:1: brackets in more"));
    // What is no key may have as many dots and brackets as it likes.
    EXPECT_EQ(said("# " + times(99, "a.") + "\n[volume.v]\nanalytic = \"slab\" # " +
                   times(99, "[") + "\nthickness_mm = 1.5\n"),
              "");
    EXPECT_THAT(said("[volume.v]\nanalytic = \"" + times(99, ".[{") + "\"\n"),
                HasSubstr("x.toml:2: unknown analytic"));
    EXPECT_THAT(said("[volume.v]\nanalytic = '''\n" + times(99, ".") + "'''\n"),
                HasSubstr("x.toml:2: unknown analytic"));
    EXPECT_THAT(said(times(1, std::string(17000000, '#'))), HasSubstr("is larger than 16 MB"));
}

TEST(SilentMistakes, AnUnknownUnitOfAMeshIsToldTheKnownOnes) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "bone.ply", "");
    const std::string said = complaint([&] {
        parse_scene("[surface.s]\nmesh = \"bone.ply\"\nmesh_unit = \"cm\"\n", folder / "x.toml");
    });
    EXPECT_THAT(said, HasSubstr("x.toml:3: unknown mesh_unit = \"cm\""));
    EXPECT_THAT(said, HasSubstr("known are \"mm\" and \"m\""));
}

TEST(SilentMistakes, TheFramesOfATraceAreNoPathAndPointToItsRecording) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "frames.csv", "frame,trial,time_s,probe_x_m\n0,0,0,0\n");
    test::make_file(folder / "r.h5", "\x89HDF\r\n\x1a\n");
    EXPECT_THAT(complaint([&] { read_probe_path(folder / "frames.csv", 1000.0); }),
                HasSubstr("(--device recording:" + (folder / "recording.h5").string() + ")"));
    EXPECT_THAT(complaint([&] { read_probe_path(folder / "r.h5", 1000.0); }),
                HasSubstr("(--device recording:" + (folder / "r.h5").string() + ")"));
}

TEST(SilentMistakes, OverridesThatChangeNothingAreRefusedAndThoseThatDoAreNot) {
    SceneDescription scene =
        parse_scene("[volume.v]\nanalytic = \"slab\"\nthickness_mm = 5\n[surface.s]\nvolume = "
                    "\"v\"\n",
                    "x.toml");
    SceneOverrides steps, tolerance, budget;
    steps.sub_steps = 8;
    tolerance.tolerance_um = 1.0;
    budget.budget_us = 100.0;
    using Method = SteppingMethod;
    for (const Method method : {Method::single, Method::paper, Method::fixed, Method::adaptive}) {
        scene.loop.method = method;
        EXPECT_EQ(complaint([&] { check_used(steps, scene); }).empty(), method == Method::fixed);
        EXPECT_EQ(complaint([&] { check_used(tolerance, scene); }).empty(),
                  method == Method::adaptive);
        EXPECT_EQ(complaint([&] { check_used(budget, scene); }).empty(), method == Method::paper);
    }
}

/// A ball of 20 mm about 60 mm in front of the patient, felt along a path.
Scene ball_in_front() {
    SceneDescription description = parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
        "x.toml");
    description.device.kind = DeviceDescription::Kind::path;
    description.device.file = "path.csv";
    return Scene(description);
}

TEST(NoContact, NamesBothBoxesTheDistanceAndWhatAnotherUnitOrFrameWouldGive) {
    const Scene scene = ball_in_front();
    // In millimetres, from 30 to 21 mm from the middle along x: 1 mm away when read as such.
    std::vector<Vec3> probes;
    for (int i = 0; i <= 9; ++i)
        probes.emplace_back(30.0 - i, 0.0, 0.0);
    const std::string said = no_contact_in_words(scene, probes);
    EXPECT_THAT(said, HasSubstr("nothing is touched in any of the 10 frames"));
    EXPECT_THAT(said, HasSubstr("the probe is within 2.1e+04 0 0 to 3e+04 0 0 mm"));
    EXPECT_THAT(said, HasSubstr("the nearest 2.098e+04 mm away"));
    EXPECT_THAT(said, HasSubstr("in millimetres it would be 1 mm, in RAS 2.098e+04 mm, in both 1 "
                                "mm away"));
}

TEST(NoContact, IsSilentWhereSomethingWasTouched) {
    const Scene scene = ball_in_front();
    std::vector<FrameReport> frames(3);
    for (FrameReport& frame : frames)
        frame.probe = {0.05, 0.0, 0.0};
    EXPECT_THAT(no_contact_warning(scene, frames), HasSubstr("nearest 30 mm away"));
    frames[1].contacts = 1;
    EXPECT_EQ(no_contact_warning(scene, frames), "");
    EXPECT_EQ(no_contact_warning(scene, {}), "");
}

} // namespace
} // namespace palpate
