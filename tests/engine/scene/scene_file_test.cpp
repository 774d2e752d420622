// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene_file.h>
#include <palpate/volume/formats/volume_file.h>

#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using test::kBone;
using test::kHead;
using test::kSkin;
using SceneFile = test::SceneFolder;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST_F(SceneFile, CompleteSceneOfAnAnatomyIsRead) {
    const std::string text = R"([volume.head]
file = "skull.nhdr"
[surface.bone]
volume = "head"
iso_value = 226.0
smooth_voxels = 0.7
iso_after_smoothing = "as_given"
keep = "largest"
contact = "direct"
strength_n = 12
facet_size_mm = 3
facet_distance_mm = 0.1
[[effect]]
type = "surface"
surface = "bone"
[[effect]]
type = "gradient_surface"
volume = "head"
strength_n = [[-100, 0], [226.0, 1.5], [1000, 4]]
[[effect]]
type = "constant_force"
force_n = [0, -0.5, 1]
[coupling]
stiffness_n_per_m = 800
damping_n_s_per_m = 1.5
[limits]
force_n = 3.5
slew_n_per_s = 500
[loop]
rate_hz = 2000
budget_us = 400
method = "fixed"
sub_steps = 16
tolerance_um = 0.5
evaluation_cap = 12
[device]
type = "path"
file = "probe.csv"
)";
    const SceneDescription scene = parse(text);
    EXPECT_EQ(scene.file, scene_file());
    EXPECT_EQ(scene.text, text);
    ASSERT_EQ(scene.volumes.size(), 1u);
    EXPECT_EQ(scene.volumes.at("head").file, scene_file().parent_path() / "skull.nhdr");
    EXPECT_EQ(scene.volumes.at("head").line, 1);

    const SurfaceDescription& bone = scene.surfaces.at("bone");
    EXPECT_EQ(bone.volume, "head");
    EXPECT_EQ(bone.iso_value, 226.0);
    EXPECT_EQ(bone.smooth_voxels, 0.7);
    EXPECT_EQ(bone.iso_after_smoothing, SurfaceDescription::IsoAfterSmoothing::as_given);
    EXPECT_EQ(bone.keep.kind, ComponentPolicy::Kind::largest);
    EXPECT_EQ(bone.contact, ContactKind::direct);
    EXPECT_EQ(bone.strength_n, 12.0);
    EXPECT_EQ(bone.facet_size_mm, 3.0);
    EXPECT_EQ(bone.facet_distance_mm, 0.1);
    EXPECT_EQ(bone.line, 3);

    ASSERT_EQ(scene.effects.size(), 3u);
    EXPECT_EQ(std::get<effects::Surface>(scene.effects[0].settings).surface, "bone");
    const auto& plane = std::get<effects::GradientSurface>(scene.effects[1].settings);
    EXPECT_EQ(plane.volume, "head");
    EXPECT_EQ(scene.effects[1].line, 16);
    ASSERT_EQ(plane.strength.count, 3u);
    EXPECT_EQ(plane.strength(226.0), 1.5);
    EXPECT_EQ(std::get<effects::ConstantForce>(scene.effects[2].settings).force_n,
              Vec3(0.0, -0.5, 1.0));

    EXPECT_EQ(scene.coupling.stiffness_n_per_m, 800.0);
    EXPECT_EQ(scene.coupling.damping_n_s_per_m, 1.5);
    EXPECT_EQ(scene.limits.force_n, 3.5);
    EXPECT_EQ(scene.limits.slew_n_per_s, 500.0);
    EXPECT_EQ(scene.loop.rate_hz, 2000.0);
    EXPECT_EQ(scene.loop.budget_us, 400.0);
    EXPECT_EQ(scene.loop.method, SteppingMethod::fixed);
    EXPECT_EQ(scene.loop.sub_steps, 16);
    EXPECT_EQ(scene.loop.tolerance_um, 0.5);
    EXPECT_EQ(scene.loop.evaluation_cap, 12);
    EXPECT_EQ(scene.device.kind, DeviceDescription::Kind::path);
    EXPECT_EQ(scene.device.file, scene_file().parent_path() / "probe.csv");
}

TEST_F(SceneFile, EmptySceneIsLegalAndHasTheDefaults) {
    const SceneDescription scene = parse("");
    EXPECT_TRUE(scene.volumes.empty() && scene.surfaces.empty() && scene.effects.empty());
    EXPECT_EQ(scene.device.kind, DeviceDescription::Kind::none);
    EXPECT_EQ(scene.loop.method, SteppingMethod::adaptive);
    EXPECT_EQ(budget_of(scene.loop), 900.0);
    EXPECT_EQ(scene.coupling.stiffness_n_per_m, 500.0);
}

TEST_F(SceneFile, SurfaceDefaultsAreThoseOfTheDescription) {
    const SurfaceDescription bone = parse(kBone).surfaces.at("bone");
    EXPECT_EQ(smoothing_of(bone), 0.0);
    EXPECT_EQ(iso_rule_of(bone), SurfaceDescription::IsoAfterSmoothing::keep_position);
    EXPECT_EQ(bone.keep.kind, ComponentPolicy::Kind::all);
    EXPECT_FALSE(bone.contact) << "choose_contact() decides";
    EXPECT_FALSE(bone.leash_mm);
    EXPECT_EQ(bone.yielding, Yielding::holds);
    EXPECT_EQ(bone.strength_n, kInfinity);
}

TEST_F(SceneFile, FilesAreRelativeToTheSceneUnlessAbsolute) {
    const auto absolute = scene_file().parent_path() / "skull.nhdr";
    const SceneDescription scene = parse("[volume.a]\nfile=\"" + absolute.string() +
                                         "\"\n[volume.b]\nfile=\"./x/../skull.nhdr\"\n");
    EXPECT_EQ(scene.volumes.at("a").file, absolute);
    EXPECT_EQ(scene.volumes.at("b").file, absolute);
}

TEST_F(SceneFile, ReadsFromAFileAndNamesTheOneThatIsMissing) {
    test::make_file(scene_file(), kBone);
    EXPECT_EQ(read_scene(scene_file()).surfaces.at("bone").iso_value, 226.0);
    EXPECT_EQ(read_scene(scene_file()).text, kBone);
    const std::filesystem::path missing = scene_file().parent_path() / "missing.toml";
    for (const auto& [file, what] : {std::pair{missing, "cannot be read"},
                                     std::pair{scene_file().parent_path(), "is a folder"}})
        try {
            read_scene(file);
            ADD_FAILURE() << file << " was read";
        } catch (const std::runtime_error& error) {
            EXPECT_TRUE(std::string(error.what()).starts_with(file.string() + ": " + what))
                << error.what();
        }
}

TEST_F(SceneFile, EveryFormulaHasItsParametersAndNoOther) {
    const std::vector<std::pair<std::string, std::vector<std::string>>> formulas{
        {"sphere_cavity", {"radius_mm"}},
        {"solid_sphere", {"radius_mm"}},
        {"bumpy_cavity", {"radius_mm", "amplitude_mm", "wavelength_mm"}},
        {"slab", {"thickness_mm"}},
        {"wedge", {"angle_deg"}},
        {"torus", {"radius_mm", "tube_mm"}},
    };
    for (const auto& [formula, keys] : formulas) {
        SCOPED_TRACE(formula);
        const std::string begin = "[volume.v]\nanalytic = \"" + formula + "\"\n";
        std::string all = begin;
        for (std::size_t i = 0; i < keys.size(); ++i)
            all += fmt::format("{} = {}\n", keys[i], 9 - i);
        const VolumeDescription volume = parse(all).volumes.at("v");
        EXPECT_EQ(volume.analytic, formula);
        EXPECT_TRUE(volume.file.empty());
        EXPECT_EQ(volume.parameters.size(), keys.size());
        for (std::size_t i = 0; i < keys.size(); ++i)
            EXPECT_EQ(volume.parameters.at(keys[i]), 9.0 - static_cast<double>(i));

        for (const std::string& left_out : keys) {
            std::string some = begin;
            for (const std::string& key : keys)
                if (key != left_out) some += key + " = 1\n";
            EXPECT_TRUE(complaint(some).starts_with("scene.toml:1: key \"" + left_out +
                                                    "\" is missing in [volume.v]; "))
                << complaint(some);
        }
        const std::string foreign = keys[0] == "angle_deg" ? "radius_mm" : "angle_deg";
        const std::string message = complaint(all + foreign + " = 5\n");
        EXPECT_NE(message.find("unknown key \"" + foreign + "\" in [volume.v] with analytic = \"" +
                               formula),
                  std::string::npos)
            << message;
    }
}

TEST_F(SceneFile, AnalyticSurfaceNeedsNoLevelAndNoFilters) {
    EXPECT_EQ(parse(kSkin).surfaces.at("skin").iso_value, 0.0);
    EXPECT_EQ(parse(kSkin + "iso_value = -0.001\n").surfaces.at("skin").iso_value, -0.001);
    EXPECT_EQ(complaint(kSkin + "smooth_voxels = 0\nkeep = \"all\"\n"), "")
        << "these change nothing";
    EXPECT_EQ(complaint(kSkin + "smooth_voxels = 0.7\n"),
              "scene.toml:6: smooth_voxels in [surface.skin] does not go with the analytic volume "
              "\"ball\"; remove smooth_voxels");
    EXPECT_TRUE(complaint(kSkin + "keep = \"largest\"\n")
                    .starts_with("scene.toml:6: keep in [surface.skin] does not go"));
    EXPECT_TRUE(complaint(kHead + "[surface.bone]\nvolume = \"head\"\n")
                    .starts_with("scene.toml:3: key \"iso_value\" is missing in [surface.bone]; "));
}

TEST_F(SceneFile, KeepIsAWordACountOrASmallestVolume) {
    using Kind = ComponentPolicy::Kind;
    const auto keep = [&](const std::string& value) {
        return parse(kBone + "keep = " + value + "\n").surfaces.at("bone").keep;
    };
    EXPECT_EQ(keep("\"all\"").kind, Kind::all);
    EXPECT_EQ(keep("\"largest\"").kind, Kind::largest);
    EXPECT_EQ(keep("3").kind, Kind::count);
    EXPECT_EQ(keep("3").count, 3u);
    EXPECT_EQ(keep("\">50\"").kind, Kind::volume);
    EXPECT_EQ(keep("\">50\"").volume_mm3, 50.0);
    EXPECT_EQ(keep("\">0.5\"").volume_mm3, 0.5);
    for (const char* value :
         {"0", "-2", "2.0", "\"3\"", "\"\"", "\"some\"", "\">\"", "\">x\"", "\">-1\"", "\">inf\"",
          "\">nan\"", "\"50\"", "\">50 mm3\"", "true", "[1]"}) {
        const std::string message = complaint(kBone + "keep = " + value + "\n");
        EXPECT_TRUE(message.starts_with("scene.toml:6: keep ")) << value << ": " << message;
        EXPECT_NE(message.find("\"largest\""), std::string::npos) << message;
    }
}

TEST_F(SceneFile, KeepOfAnOptionIsSpelledLikeThatOfAScene) {
    using Kind = ComponentPolicy::Kind;
    EXPECT_EQ(parse_keep("all").kind, Kind::all);
    EXPECT_EQ(parse_keep("largest").kind, Kind::largest);
    EXPECT_EQ(parse_keep("12").count, 12u);
    EXPECT_EQ(parse_keep(">7.5").volume_mm3, 7.5);
    for (const char* text : {"", "0", "-1", "1.5", "bigest", ">", ">nan"})
        EXPECT_THROW(parse_keep(text), std::invalid_argument) << text;
}

TEST_F(SceneFile, StrengthIsANumberOrAFunctionOfTheValue) {
    const auto strength = [&](const std::string& value) {
        const SceneDescription scene = parse(
            kBone + "[[effect]]\ntype = \"gradient_surface\"\nvolume = \"head\"\nstrength_n = " +
            value + "\n");
        return std::get<effects::GradientSurface>(scene.effects[0].settings).strength;
    };
    EXPECT_EQ(strength("2")(99.0), 2.0);
    EXPECT_EQ(strength("inf")(99.0), kInfinity);
    EXPECT_EQ(strength("[[0, 1]]")(99.0), 1.0);
    const TransferFunction ramp = strength("[[0, 1], [10, 3]]");
    EXPECT_EQ(ramp(-5.0), 1.0);
    EXPECT_EQ(ramp(5.0), 2.0);
    EXPECT_EQ(ramp(50.0), 3.0);
    std::string nodes;
    for (int i = 0; i < 32; ++i)
        nodes += fmt::format("[{}, {}],", i, 2 * i);
    EXPECT_EQ(strength("[" + nodes + "]").count, 32u);
    EXPECT_EQ(strength("[" + nodes + "]")(30.5), 61.0);
}

TEST_F(SceneFile, StrengthOfASurfaceAsAFunctionIsItsValueOnTheLevel) {
    const auto scene = parse(kBone + "strength_n = [[126, 0], [326, 4]]\n");
    EXPECT_EQ(scene.surfaces.at("bone").strength_n, 2.0) << "iso_value 226 is half way";
}

TEST_F(SceneFile, BudgetFollowsAFasterRate) {
    EXPECT_EQ(budget_of(parse("[loop]\nrate_hz = 4000\n").loop), 0.9 * 250.0);
    EXPECT_EQ(budget_of(parse("[loop]\nrate_hz = 100\n").loop), 900.0);
    EXPECT_EQ(parse("[loop]\nrate_hz = 4000\nbudget_us = 250\n").loop.budget_us, 250.0);
    EXPECT_NE(complaint("[loop]\nrate_hz = 4000\nbudget_us = 900\n"), "");
}

TEST_F(SceneFile, OrbitGoesAroundOneSurfaceOrAll) {
    const auto device =
        parse(kSkin + "[device]\ntype = \"orbit\"\nspeed_m_per_s = 1\ndepth_min_mm = 7\n").device;
    EXPECT_EQ(device.kind, DeviceDescription::Kind::orbit);
    EXPECT_EQ(device.surface, "") << "each that is felt";
    EXPECT_EQ(device.speed_m_per_s, 1.0);
    EXPECT_EQ(device.depth_max_mm, 7.0) << "the default of 5 mm follows a deeper minimum";
    EXPECT_EQ(device.turns, 0) << "as many as there is time for";
    EXPECT_EQ(parse(kSkin + "[device]\ntype = \"orbit\"\nsurface = \"skin\"\n").device.surface,
              "skin");
    EXPECT_EQ(complaint("[device]\ntype = \"orbit\"\n"),
              "scene.toml:1: the orbit in [device] has no surface to go around; add a "
              "[surface.NAME]");
}

TEST_F(SceneFile, ALabelIsSmoothedAndKeepsItsVolume) {
    const auto surface = [&](const std::string& keys) {
        return parse(kHead + "[surface.part]\nvolume = \"head\"\n" + keys).surfaces.at("part");
    };
    using Iso = SurfaceDescription::IsoAfterSmoothing;
    const SurfaceDescription one = surface("label = \"Hippocampus_L\"\n");
    EXPECT_EQ(one.labels, std::vector<std::string>{"Hippocampus_L"});
    EXPECT_EQ(smoothing_of(one), kLabelSmoothing);
    EXPECT_EQ(iso_rule_of(one), Iso::keep_volume);
    SurfaceDescription in_code;
    EXPECT_EQ(smoothing_of(in_code), 0.0);
    EXPECT_EQ(iso_rule_of(in_code), Iso::keep_position);
    in_code.labels = {"Hippocampus_L"};
    EXPECT_EQ(smoothing_of(in_code), smoothing_of(one)) << "the same in code";
    EXPECT_EQ(iso_rule_of(in_code), iso_rule_of(one));
    const SurfaceDescription several = surface("label = [37, \"Thalamus_L\"]\nsmooth_voxels = 0\n"
                                               "iso_after_smoothing = \"as_given\"\n");
    EXPECT_EQ(several.labels, (std::vector<std::string>{"37", "Thalamus_L"}));
    EXPECT_EQ(several.smooth_voxels, 0.0);
    EXPECT_EQ(several.iso_after_smoothing, Iso::as_given);
}

TEST_F(SceneFile, ARegionIsTwoOppositeCorners) {
    const Box region =
        *parse(kBone + "region_mm = [[10, -5, 0], [-10, 5, 20.5]]\n").surfaces.at("bone").region_mm;
    EXPECT_EQ(region.lower, Vec3(-10.0, -5.0, 0.0));
    EXPECT_EQ(region.upper, Vec3(10.0, 5.0, 20.5));
}

TEST_F(SceneFile, AVolumeSaysWhichOfSeveralItIs) {
    const VolumeDescription volume =
        parse(kHead + "series = \"3\"\ngrid = \"ct\"\nslices = \"repair\"\n"
                      "nifti_transform = \"qform\"\nlabels = \"probe.csv\"\n"
                      "reference = \"probe.csv\"\n")
            .volumes.at("head");
    EXPECT_EQ(volume.selection.series, "3");
    EXPECT_EQ(volume.selection.grid, "ct");
    EXPECT_EQ(volume.selection.slices, VolumeSelection::Slices::repair);
    EXPECT_EQ(volume.selection.nifti_transform, VolumeSelection::NiftiTransform::qform);
    EXPECT_EQ(volume.labels.filename(), "probe.csv");
    EXPECT_EQ(volume.selection.reference.filename(), "probe.csv");
}

TEST(SceneNames, AreSpelledAsInScenes) {
    EXPECT_EQ(name(ContactKind::mesh), "mesh");
    EXPECT_EQ(name(ContactKind::volume), "volume");
    EXPECT_EQ(name(ContactKind::guarded), "guarded");
    EXPECT_EQ(name(ContactKind::direct), "direct");
    EXPECT_EQ(name(SteppingMethod::single), "single");
    EXPECT_EQ(name(SteppingMethod::paper), "paper");
    EXPECT_EQ(name(SteppingMethod::fixed), "fixed");
    EXPECT_EQ(name(SteppingMethod::adaptive), "adaptive");
    EXPECT_EQ(name(effects::Surface{}), "surface");
    EXPECT_EQ(name(effects::GradientSurface{}), "gradient_surface");
    EXPECT_EQ(name(effects::ConstantForce{}), "constant_force");
}

} // namespace
} // namespace palpate
