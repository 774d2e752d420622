// SPDX-License-Identifier: Apache-2.0
// A scene made in code is looked at as one from a file.
#include <palpate/engine/scene/validation.h>

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scripted_clock.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A ball of bone with an effect of most kinds on or about it.
SceneDescription full() {
    SceneDescription scene;
    scene.volumes["head"].analytic = "solid_sphere";
    scene.volumes["head"].parameters["radius_mm"] = 20.0;
    scene.volumes["stream"].analytic = "helix";
    scene.volumes["stream"].parameters = {{"radius_mm", 30.0}, {"pitch_mm", 30.0}};
    scene.materials["bone"].static_mu = 0.3;
    SurfaceDescription& skull = scene.surfaces["skull"];
    skull.volume = "head";
    skull.material = "bone";
    scene.effects = {
        effects::Surface{"skull"}, // 0
        effects::Friction{"skull", 0.3, 0.2},
        effects::ConstantForce{{0.1, 0.0, 0.0}}, // 2
        effects::GradientForce{"head", TransferFunction::constant(0.2)},
        effects::Guide{.points_m = {Vec3{0.0}, Vec3{0.01, 0.0, 0.0}}}, // 4
        effects::Workspace{.radius_m = 0.1},
        effects::GravityCompensation{0.05, {0, 0, -1}}, // 6
        effects::VectorForce{"stream", TransferFunction::constant(0.2)},
        effects::Magnet{.surface = "skull", .strength_n = 0.3}, // 8
        effects::Texture{.surface = "skull", .height_m = 1e-4},
        effects::Vibration{.surface = "skull"}, // 10
        effects::Viscosity{.strength = TransferFunction::constant(1.0)},
    };
    return scene;
}

/// The settings of an effect of a scene.
template <class Kind>
Kind& of(SceneDescription& scene, std::size_t effect) {
    return std::get<Kind>(scene.effects[effect].settings);
}

std::string complaint(const std::function<void(SceneDescription&)>& change) {
    SceneDescription scene = full();
    change(scene);
    try {
        Scene made(scene);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(SceneFromCode, ThatIsRightIsFelt) {
    EXPECT_EQ(complaint([](SceneDescription&) {}), "");
    EXPECT_NO_THROW(validate(SceneDescription{}));
}

// Labels of no volume ended in what looks labels up.
TEST(SceneFromCode, AMeshAloneHasNothingOfAVolume) {
    const auto complaint_of = [](const std::function<void(SurfaceDescription&)>& change) {
        return complaint([&](SceneDescription& scene) {
            SurfaceDescription& plate = scene.surfaces["plate"];
            plate.triangle_mesh = std::make_shared<const TriangleMesh>(test::plate());
            change(plate);
        });
    };
    using S = SurfaceDescription;
    EXPECT_EQ(complaint_of([](S&) {}), "");
    const std::vector<std::pair<std::string, std::function<void(S&)>>> of_volume{
        {"labels", [](S& s) { s.labels = {"bone"}; }},
        {"iso_value", [](S& s) { s.iso_value = 300.0; }},
        {"region_mm",
         [](S& s) {
             s.region_mm = Box{Vec3{0.0}, Vec3{1.0}};
         }},
        {"smooth_voxels", [](S& s) { s.smooth_voxels = 1.0; }},
        {"iso_after_smoothing",
         [](S& s) { s.iso_after_smoothing = S::IsoAfterSmoothing::as_given; }},
        {"keep", [](S& s) { s.keep.kind = ComponentPolicy::Kind::largest; }}};
    for (const auto& [field, change] : of_volume)
        EXPECT_EQ(complaint_of(change),
                  "surfaces[\"plate\"]." + field +
                      " is of a volume, and the surface is a mesh alone; give "
                      "volume, or leave " +
                      field + " as it is by default");
}

TEST(SceneFromCode, NumbersOutOfRangeNameFieldValueAndRange) {
    using S = SceneDescription;
    const std::vector<std::pair<std::function<void(S&)>, std::string>> wrong{
        {[](S& s) { s.limits.slew_n_per_s = -2000.0; },
         "limits.slew_n_per_s = -2000 is out of range; give a number in (0, 10000000]"},
        {[](S& s) { s.limits.force_n = kNan; },
         "limits.force_n = nan is not a number; give a number in (0, 1000]"},
        {[](S& s) { s.limits.force_n = -1.0; },
         "limits.force_n = -1 is out of range; give a number in (0, 1000]"},
        {[](S& s) { s.loop.rate_hz = -1000.0; },
         "loop.rate_hz = -1000 is out of range; give a number in [50, 20000]"},
        {[](S& s) { s.loop.rate_hz = 0.0; },
         "loop.rate_hz = 0 is out of range; give a number in [50, 20000]"},
        {[](S& s) { s.loop.sub_steps = 0; },
         "loop.sub_steps = 0 is out of range; give an integer in [1, 4096]"},
        {[](S& s) { s.coupling.stiffness_n_per_m = kNan; },
         "coupling.stiffness_n_per_m = nan is not a number; give a number in (0, 100000]"},
        {[](S& s) { s.volumes["head"].parameters["radius_mm"] = -20.0; },
         "volumes[\"head\"].parameters[\"radius_mm\"] = -20 is out of range; give a number in "
         "[1e-06, "
         "1000000]"},
        {[](S& s) { s.materials["bone"].static_mu = 11.0; },
         "materials[\"bone\"].static_mu = 11 is out of range; give a number in [0, 10]"},
        {[](S& s) { s.surfaces["skull"].strength_n = -kInfinite; },
         "surfaces[\"skull\"].strength_n = -inf is out of range; give a number in [0, 1000000] or "
         "inf"},
        {[](S& s) { of<effects::Friction>(s, 1).dynamic_mu = 0.4; },
         "effects[1].dynamic_mu = 0.4 is above static_mu = 0.3; give at most as much "
         "friction while sliding as at rest"},
        {[](S& s) { of<effects::ConstantForce>(s, 2).force_n[1] = 2e3; },
         "effects[2].force_n[1] = 2000 is out of range; give a number in [-1000, 1000]"},
        {[](S& s) { of<effects::GradientForce>(s, 3).strength.nodes[0].strength_n = kInfinite; },
         "effects[3].strength.nodes[0].strength_n = inf is out of range; give a number in [0, "
         "1000]"},
        {[](S& s) { of<effects::Guide>(s, 4).capture_m = 0.0; },
         "effects[4].capture_m = 0 is out of range; give a number in (0, inf]"},
        {[](S& s) { of<effects::Workspace>(s, 5).radius_m = 0.0; },
         "effects[5].radius_m = 0, and box_m is empty; give a radius_m above 0, or a box_m"},
        {[](S& s) { of<effects::GravityCompensation>(s, 6).down = Vec3{0.0}; },
         "effects[6].down = [0, 0, 0] has no direction; give three finite numbers, not all of them "
         "0"},
        {[](S& s) { of<effects::Magnet>(s, 8).capture_m = 2.0; },
         "effects[8].capture_m = 2 is out of range; give a number in (0, 1]"},
        {[](S& s) { of<effects::Vibration>(s, 10).frequency_hz = 600.0; },
         "frequency_hz = 600 in effects[10] is not below half of [loop] rate_hz = 1000; lower it, "
         "or raise the rate"},
        {[](S& s) { s.device.depth_min_mm = 6.0; },
         "device.depth_max_mm = 5 is out of range; give a number in [6, 50]"},
        {[](S& s) { s.device.hand.delay_ms = kNan; },
         "device.hand.delay_ms = nan is not a number; give a number in [0, 20]"},
    };
    for (const auto& [change, what] : wrong)
        EXPECT_EQ(complaint(change), what);
}

TEST(SceneFromCode, NamesThatDoNotExistAreAnsweredWithTheNearestName) {
    using S = SceneDescription;
    const std::vector<std::pair<std::function<void(S&)>, std::string>> wrong{
        {[](S& s) { of<effects::Surface>(s, 0).surface = "skul"; },
         "effects[0].surface = \"skul\" does not exist; did you mean \"skull\"?"},
        {[](S& s) { of<effects::Surface>(s, 0).surface = ""; },
         "effects[0].surface = \"\" does not exist; surfaces: skull"},
        {[](S& s) { of<effects::GradientForce>(s, 3).volume = "haed"; },
         "effects[3].volume = \"haed\" does not exist; did you mean \"head\"?"},
        {[](S& s) { s.surfaces["skull"].volume = "liver"; },
         "surfaces[\"skull\"].volume = \"liver\" does not exist; volumes: head, stream"},
        {[](S& s) { s.surfaces["skull"].material = "bon"; },
         "surfaces[\"skull\"].material = \"bon\" does not exist; did you mean \"bone\"?"},
        {[](S& s) { s.volumes["head"].analytic = "solid_spere"; },
         "volumes[\"head\"].analytic = \"solid_spere\" does not exist; did you mean "
         "\"solid_sphere\"?"},
        {[](S& s) { s.device.surface = "skulls"; },
         "device.surface = \"skulls\" does not exist; did you mean \"skull\"?"},
        {[](S& s) { of<effects::VectorForce>(s, 7).volume = "head"; },
         "effects[7].volume = \"head\" is a formula of scalars; name a volume of vectors, or "
         "analytic = \"helix\""},
        {[](S& s) { of<effects::GradientForce>(s, 3).volume = "stream"; },
         "effects[3].volume = \"stream\" is a formula of vectors; name a volume of scalars"},
        {[](S& s) { of<effects::Guide>(s, 4).ends = static_cast<PolylineEnds>(77); },
         "effects[4].ends = 77 is none of its enumeration's values; give one of 0 to 2"},
        {[](S& s) { s.surfaces["skull"].contact = ContactKind::mesh; },
         "surfaces[\"skull\"].contact = mesh needs a mesh, and a surface given by a formula is not "
         "meshed; name a mesh file, or take contact = \"volume\""},
        {[](S& s) { s.surfaces["skull"].volume.clear(); },
         "surfaces[\"skull\"].volume and mesh are both empty; name a volume, or give a mesh (mesh "
         "or "
         "triangle_mesh), or both"},
    };
    for (const auto& [change, what] : wrong)
        EXPECT_EQ(complaint(change), what);
}

// What was changed after reading is told with the file's line.
TEST(SceneFromCode, FromAFileAndChangedItHasTheFilesLine) {
    SceneDescription scene = parse_scene("[coupling]\n[[effect]]\ntype = \"constant_force\"\n"
                                         "force_n = [1, 0, 0]\n",
                                         "push.toml");
    of<effects::ConstantForce>(scene, 0).force_n[2] = kNan;
    try {
        validate(scene);
        FAIL() << "it is no number";
    } catch (const std::invalid_argument& error) {
        EXPECT_EQ(std::string(error.what()),
                  "push.toml:2: effects[0].force_n[2] = nan is not a number; give a number in "
                  "[-1000, 1000]");
    }
}

std::string loop_complaint(const std::function<void()>& make) {
    try {
        make();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(LoopFromCode, ChecksHowItRunsAndWhatItRunsOn) {
    const auto scene = std::make_shared<const Scene>(full());
    test::ScriptedClock clock;
    const auto with_loop = [&](const std::function<void(LoopDescription&)>& change) {
        LoopDescription loop;
        change(loop);
        return loop_complaint([&] { HapticLoop made(scene, clock, loop); });
    };
    EXPECT_EQ(with_loop([](LoopDescription&) {}), "");
    EXPECT_EQ(with_loop([](LoopDescription& l) { l.rate_hz = 20000.0; }), "");
    EXPECT_EQ(with_loop([](LoopDescription& l) { l.rate_hz = kNan; }),
              "loop.rate_hz = nan is not a number; give a number in [50, 20000]");
    EXPECT_EQ(with_loop([](LoopDescription& l) { l.tolerance_um = -1.0; }),
              "loop.tolerance_um = -1 is out of range; give a number in (0, 1000]");
    EXPECT_EQ(with_loop([](LoopDescription& l) {
                  l.rate_hz = 2000.0; // whatever the method, as in a file
                  l.budget_us = 900.0;
              }),
              "loop.budget_us = 900 is out of range; give a number in (0, 500]");
    EXPECT_EQ(with_loop([](LoopDescription& l) { l.method = static_cast<SteppingMethod>(-1); }),
              "loop.method = -1 is none of its enumeration's values; give one of 0 to 3");

    const auto with_device = [&](const std::function<void(DeviceProperties&)>& change) {
        DeviceProperties device;
        device.force_n = 3.3;
        change(device);
        return loop_complaint([&] { HapticLoop made(scene, clock, LoopDescription{}, device); });
    };
    EXPECT_EQ(with_device([](DeviceProperties&) {}), "");
    EXPECT_EQ(with_device([](DeviceProperties& d) { d.force_n = kInfinite; }),
              "device.force_n = inf is out of range; give a number in [0, inf)");
    EXPECT_EQ(with_device([](DeviceProperties& d) {
                  d.name = "arm";
                  d.delay_s = kNan;
              }),
              "device \"arm\".delay_s = nan is not a number; give a number in [0, 1]");
    EXPECT_EQ(with_device([](DeviceProperties& d) { d.delay_s = 5.0; }),
              "device.delay_s = 5 is out of range; give a number in [0, 1]");
    EXPECT_EQ(with_device([](DeviceProperties& d) { d.position_step_m = 30.0; }),
              "device.position_step_m = 30 is out of range; give a number in [0, 1]");
    EXPECT_EQ(with_device([](DeviceProperties& d) { d.scale = 0.001; }),
              "device.scale = 0.001 is out of range; give a number in [0.01, 100]");
    EXPECT_EQ(with_device([](DeviceProperties& d) { d.stiffness_n_per_m = 0.0; }),
              "device.stiffness_n_per_m = 0 is out of range; give a number in (0, inf]");
    EXPECT_EQ(with_device([](DeviceProperties& d) {
                  d.workspace_m = {Vec3{0.0}, Vec3{kNan}};
              }),
              "device.workspace_m.upper[0] = nan is not a number; give a number in (-inf, inf)");

    EXPECT_EQ(loop_complaint([&] { HapticLoop made(nullptr, clock); }),
              "scene is missing; give one");
    std::vector<std::unique_ptr<Effect>> own(1);
    EXPECT_EQ(loop_complaint([&] { HapticLoop made(scene, clock, std::move(own)); }),
              "custom[0] is null; give an effect, or leave it out");
}

} // namespace
} // namespace palpate
