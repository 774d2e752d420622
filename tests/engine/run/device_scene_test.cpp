// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/device_factory.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/device_safety.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/run/trace.h>

#include "tests/engine/scene/scene_file_fixture.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/scripted_device.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using Kind = DeviceDescription::Kind;

class DeviceTable : public test::SceneFolder {};

TEST_F(DeviceTable, APlacementIsReadKeyByKey) {
    const DeviceDescription device =
        parse("[device]\ntype = \"hand\"\nfile = \"probe.csv\"\nright = "
              "\"patient_posterior\"\nup = \"patient_left\"\norigin_mm = [1, 2.5, -3]\nscale = "
              "2\nseed = 7\ndelay_ms = 1.5\nstep_um = 40\ntremor_um = 0\narm_stiffness_n_per_m = "
              "200\ndamping_n_s_per_m = 0.5\n")
            .device;
    EXPECT_EQ(device.kind, Kind::hand);
    EXPECT_EQ(device.placement.right, PatientSide::posterior);
    EXPECT_EQ(device.placement.up, PatientSide::left);
    EXPECT_EQ(device.placement.origin_m, Vec3(1e-3, 2.5e-3, -3e-3));
    EXPECT_EQ(device.placement.scale, 2.0);
    EXPECT_EQ(device.file, scene_file().parent_path() / "probe.csv");
    EXPECT_EQ(device.hand.seed, 7);
    EXPECT_EQ(device.hand.delay_ms, 1.5);
    EXPECT_EQ(device.hand.step_um, 40.0);
    EXPECT_EQ(device.hand.tremor_um, 0.0);
    EXPECT_EQ(device.hand.stiffness_n_per_m, 200.0);
    EXPECT_EQ(device.hand.damping_n_s_per_m, 0.5);

    const DeviceDescription bare = parse("[device]\ntype = \"hid:/dev/hidraw3\"\n").device;
    EXPECT_EQ(bare.kind, Kind::hid);
    EXPECT_EQ(bare.address, "/dev/hidraw3");
    EXPECT_EQ(bare.placement.right, PatientSide::left);
    EXPECT_EQ(bare.placement.up, PatientSide::superior);
    EXPECT_EQ(bare.placement.scale, 1.0);
}

TEST_F(DeviceTable, AFileOfABoardsModelIsRelativeToTheScene) {
    const auto address = [&](const std::string& type) {
        return parse("[device]\ntype = \"hid:" + type + "\"\n").device.address;
    };
    const std::string folder = scene_file().parent_path().string();
    EXPECT_EQ(address("wooden:mine.json"), "wooden:" + folder + "/mine.json");
    EXPECT_EQ(address("/dev/hidraw3:mine.json"), "/dev/hidraw3:" + folder + "/mine.json");
    EXPECT_EQ(address("wooden:/home/me/mine.json"), "wooden:/home/me/mine.json");
    EXPECT_EQ(address("wooden:polhem_v3"), "wooden:polhem_v3");
}

TEST_F(DeviceTable, AnInverse3IsReadWithItsAddressAndPlacement) {
    const DeviceDescription device =
        parse("[device]\ntype = \"inverse3:049D?port=7\"\nscale = 2\n").device;
    EXPECT_EQ(device.kind, Kind::inverse3);
    EXPECT_EQ(device.address, ":049D?port=7");
    EXPECT_EQ(device.placement.scale, 2.0);
    EXPECT_EQ(parse("[device]\ntype = \"inverse3\"\n").device.address, "");
    EXPECT_EQ(complaint("[device]\ntype = \"inverse3?port=x\"\n"),
              "scene.toml:2: inverse3?port=x: port=x is no option with a value that it may have; "
              "give host=ADDRESS in digits, port=1..65535, grip=ID or force_n=NEWTONS up to 10");
    EXPECT_NE(complaint("[device]\ntype = \"inverse3x\"\n").find("is no address; write inverse3"),
              std::string::npos);
    EXPECT_NE(complaint("[device]\ntype = \"inverse3\"\nfile = \"a\"\n").find("unknown key"),
              std::string::npos);
}

TEST_F(DeviceTable, WrongPlacementsAreRefusedWithLineAndRemedy) {
    EXPECT_EQ(complaint("[device]\ntype = \"hid:x\"\nright = \"patient_left\"\nup = "
                        "\"patient_right\"\n"),
              "scene.toml:4: right is \"patient_left\" and up \"patient_right\" in [device], which "
              "is one line; let up be a direction across right");
    EXPECT_EQ(complaint("[device]\ntype = \"hid:x\"\nright = \"patient_superior\"\n").substr(0, 13),
              "scene.toml:3:")
        << "up is superior by default";
    EXPECT_NE(complaint("[device]\ntype = \"hid:x\"\nright = \"patient_lft\"\n")
                  .find("did you mean \"patient_left\"?"),
              std::string::npos);
    EXPECT_NE(complaint("[device]\ntype = \"hid:x\"\nscale = 0\n").find("[0.01, 100]"),
              std::string::npos);
    EXPECT_NE(complaint("[device]\ntype = \"hid:x\"\norigin_mm = [1, 2]\n").find("2 elements"),
              std::string::npos);
    EXPECT_EQ(complaint("[device]\ntype = \"hid:\"\n"),
              "scene.toml:2: type = \"hid:\" in [device] names no device; add what `palpate "
              "devices` lists");
    EXPECT_NE(complaint("[device]\ntype = \"path\"\nfile = \"probe.csv\"\nscale = 2\n")
                  .find("unknown key \"scale\""),
              std::string::npos)
        << "a path is where it says";
}

TEST_F(DeviceTable, OptionsNameEveryDevice) {
    SceneDescription scene;
    const auto with = [&](const std::string& device) {
        SceneOverrides overrides;
        overrides.device = device;
        apply(overrides, scene);
        return scene.device;
    };
    EXPECT_EQ(with("orbit").kind, Kind::orbit);
    EXPECT_EQ(with("hand:h.csv").kind, Kind::hand);
    EXPECT_EQ(scene.device.file, std::filesystem::absolute("h.csv"));
    EXPECT_EQ(with("hand").file, "") << "it presses";
    scene.device.kind = Kind::orbit;
    scene.device.duration_s = 2.0;
    EXPECT_EQ(with("hand").duration_s, 20.0) << "a hand takes its time, an orbit need not";
    scene.device.duration_s = 4.0;
    EXPECT_EQ(with("hand").duration_s, 4.0);
    EXPECT_EQ(with("path:a.csv").file, std::filesystem::absolute("a.csv"));
    EXPECT_EQ(with("recording:r.h5").kind, Kind::recording);
    EXPECT_EQ(scene.device.file, std::filesystem::absolute("r.h5"));
    EXPECT_EQ(with("hid:spacemouse").address, "spacemouse");
    EXPECT_EQ(with("inverse3").kind, Kind::inverse3);
    EXPECT_EQ(scene.device.address, "");
    EXPECT_EQ(with("inverse3:049D?port=7").address, ":049D?port=7");
    EXPECT_EQ(with("inverse3?port=7").address, "?port=7");
    for (const char* wrong : {"", "path:", "hid:", "recording:", "hand:", "novint", "inverse4"})
        EXPECT_THROW(with(wrong), std::invalid_argument) << wrong;
}

std::string cavity(const std::string& device) {
    return "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
           "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
           device;
}

std::shared_ptr<const Scene> scene_of(const std::string& device = "",
                                      const std::filesystem::path& file = "x.toml") {
    return std::make_shared<const Scene>(parse_scene(cavity(device), file),
                                         SceneResources{.files = scene_files()});
}

TEST_F(DeviceTable, AHandWithoutAPathPressesIntoASurface) {
    const DeviceDescription hand =
        parse("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = "
              "\"v\"\n[device]\ntype = \"hand\"\nfrom = \"patient_left\"\ndepth_mm = 7\n"
              "duration_s = 4\nseed = 9\n")
            .device;
    EXPECT_EQ(hand.kind, Kind::hand);
    EXPECT_EQ(hand.from, PatientSide::left);
    EXPECT_EQ(hand.depth_mm, 7.0);
    EXPECT_EQ(hand.duration_s, 4.0);
    EXPECT_EQ(hand.hand.seed, 9);
    EXPECT_EQ(complaint("[device]\ntype = \"hand\"\n"),
              "scene.toml:1: the hand in [device] has no surface to press into; add a "
              "[surface.NAME], or file = \"PATH.csv\": where the arm wants the probe");
    EXPECT_TRUE(complaint("[device]\ntype = \"hand\"\nfile = \"probe.csv\"\ndepth_mm = 2\n")
                    .starts_with("scene.toml:4: depth_mm and file in [device] exclude each other"));
}

TEST(DeviceFactory, ASceneWithoutADeviceSaysWhatToAdd) {
    try {
        make_device(*scene_of());
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "x.toml: the scene has no device; add [device] with type = "
                                   "\"path\" or \"orbit\"");
    }
}

TEST(DeviceFactory, ADeviceThatIsNotAttachedIsTheDevicesErrorNotTheFiles) {
    EXPECT_THROW(make_device(*scene_of("[device]\ntype = \"hid:/dev/hidraw99\"\n")), DeviceError);
}

// 50 mm is where the ball begins; the hand wants to be 5 mm behind it and its arm is a spring.
TEST(DeviceFactory, AHandPressesIntoTheSurfaceFromItsSideAndGoesBack) {
    const auto scene = scene_of("[device]\ntype = \"hand\"\nduration_s = 4\n");
    EXPECT_THROW(device_states(*scene), std::runtime_error) << "nobody knows them before";
    SteadyClock clock;
    const SceneDevice device = make_device(*scene);
    const Trace trace = run_trace(scene, device.placed(), clock, 1000000);
    ASSERT_EQ(trace.frames.size(), 4001u);
    EXPECT_GT(trace.device.force_n, 0.0);
    EXPECT_NEAR(trace.frames.front().probe.y, -70e-3, 1e-3) << "anterior is -y";
    const FrameReport& pressed = trace.frames[2500];
    EXPECT_NEAR(glm::length(pressed.proxy), 50e-3, 1e-6);
    EXPECT_LT(glm::length(pressed.probe), 49.9e-3);
    EXPECT_LT(pressed.force.y, -0.1) << "out of the ball";
    EXPECT_EQ(trace.frames.back().force, Vec3(0.0));

    // The same hand again, and what it did replayed: the device's limits hold there, too.
    const SceneDevice again = make_device(*scene);
    const Trace second = run_trace(scene, again.placed(), clock, 1000000);
    const Trace replayed = run_again(scene, trace);
    ASSERT_EQ(second.frames.size(), trace.frames.size());
    for (std::size_t i = 0; i < trace.frames.size(); ++i) {
        ASSERT_EQ(second.frames[i].force, trace.frames[i].force) << i;
        ASSERT_EQ(replayed.frames[i].force, trace.frames[i].force) << i;
        ASSERT_EQ(replayed.frames[i].flags, trace.frames[i].flags) << i;
    }
}

/// Two balls of one mesh, far apart along x: nothing is in their middle.
std::shared_ptr<const Scene> two_balls(const char* from) {
    auto both = std::make_shared<TriangleMesh>(test::icosphere(20e-3, 3, {-0.05, 0.01, 0.0}));
    const TriangleMesh other = test::icosphere(20e-3, 3, {0.05, 0.0, 0.005});
    const auto first = static_cast<std::uint32_t>(both->vertices.size());
    both->vertices.insert(both->vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const auto& [a, b, c] : other.triangles)
        both->triangles.push_back({a + first, b + first, c + first});
    SceneDescription scene =
        parse_scene(fmt::format("[device]\ntype = \"hand\"\nfrom = \"{}\"\n", from) +
                        "[surface.s]\nvolume = \"v\"\n[volume.v]\nanalytic = \"solid_sphere\"\n"
                        "radius_mm = 1\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                    "x.toml");
    scene.volumes.clear();
    scene.surfaces["s"] = {};
    scene.surfaces["s"].triangle_mesh = both;
    scene.surfaces["s"].contact = ContactKind::mesh;
    return std::make_shared<const Scene>(scene);
}

TEST(DeviceFactory, AHandMeetsWhatHasNothingInItsMiddle) {
    for (const char* from : {"patient_anterior", "patient_posterior", "patient_superior",
                             "patient_inferior", "patient_left", "patient_right"}) {
        const auto scene = two_balls(from);
        SteadyClock clock;
        const SceneDevice device = make_device(*scene);
        const Trace trace = run_trace(scene, device.placed(), clock, 1000000);
        EXPECT_EQ(trace.frames.front().surfaces_felt, 0u) << from;
        const auto felt = [](const FrameReport& frame) { return frame.surfaces_felt != 0; };
        EXPECT_GT(std::count_if(trace.frames.begin(), trace.frames.end(), felt), 10000) << from;
    }
}

TEST(DeviceFactory, AnOrbitWithoutAFrameIsRefused) {
    const auto scene = scene_of("[device]\ntype = \"orbit\"\nduration_s = 0.0009\n");
    try {
        device_states(*scene);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "x.toml:9: [device]: duration_s = 0.0009 leaves no frame for "
                                   "each of 1 surface; raise it");
    }
}

TEST(DeviceFactory, AnOrbitIsASequenceInTheScenesFrame) {
    const auto scene = scene_of("[device]\ntype = \"orbit\"\nduration_s = 0.5\n");
    const SceneDevice device = make_device(*scene);
    const std::vector<DeviceState> states = device_states(*scene);
    EXPECT_EQ(device.states, states.size());
    EXPECT_EQ(device.placement.in_words(), "device frame = scene frame");
    DeviceState state;
    for (const DeviceState& expected : states) {
        ASSERT_TRUE(device.device->read(state));
        EXPECT_EQ(state.position, expected.position);
    }
    EXPECT_FALSE(device.device->read(state));
}

/// A hand that comes down on the ball from where its own frame has it.
void come_down(std::size_t read, DeviceState& state) {
    state.position = {0.0, 0.0, 0.03 - 1e-4 * static_cast<double>(read)};
    state.velocity = {0.0, 0.0, -0.1};
    state.buttons = static_cast<std::uint32_t>(read);
    state.orientation = {0.0, 1.0, 0.0, 0.0};
}

TEST(ClosedLoop, TheDeviceIsReadPlacedAndPushedBackInItsOwnFrame) {
    test::ScriptedDevice device;
    device.on_read = come_down;
    // Right is the patient's left, up anterior: from its origin 40 mm in front of the ball's middle
    // the device comes down on the patient's front.
    const DevicePlacement placement(
        {PatientSide::left, PatientSide::anterior, Vec3{0.0, -0.04, 0.0}, 1.0});
    test::ScriptedClock clock;
    const Trace trace = run_trace(scene_of(), {device, placement}, clock, 300);
    ASSERT_EQ(trace.frames.size(), 300u);
    EXPECT_LT(glm::length(trace.inputs[100].position - Vec3(0.0, -0.06, 0.0)), 1e-15);
    EXPECT_EQ(trace.inputs[100].velocity, Vec3(0.0, 0.1, 0.0));
    EXPECT_EQ(trace.inputs[100].buttons, 100u);
    // 10 mm deep: k_s of 500 N/m, to a tenth of a micrometre of the solver's tolerance.
    EXPECT_NEAR(trace.frames[299].force.y, -500.0 * 0.0099, 500.0 * 1e-7);
    ASSERT_EQ(device.forces.size(), 301u);
    EXPECT_EQ(device.forces[299].z, -trace.frames[299].force.y) << "up, in the device's frame";
    EXPECT_EQ(device.forces[300], Vec3(0.0)) << "and then it is let go";
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));
    EXPECT_EQ(trace.device.name, "scripted");
}

/// A second outside, half a second 6 mm into the ball, along z.
std::string press_path(double seconds) {
    std::string csv = "t_s,x_m,y_m,z_m\n";
    for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i)
        csv += fmt::format("{:.3f},0,0,{:.6f}\n", 1e-3 * i,
                           0.055 - 0.011 * std::clamp(1e-3 * i - 0.5, 0.0, 1.0));
    return csv;
}

TEST(ClosedLoop, ASimulatedHandPressesWhereverItsDeviceStands) {
    test::TemporaryFolder folder;
    test::make_file(folder / "press.csv", press_path(2.5));
    for (const char* placement :
         {"", "right = \"patient_superior\"\nup = \"patient_anterior\"\norigin_mm = [3, 40, -7]\n"
              "scale = 1.5\n"}) {
        SCOPED_TRACE(placement);
        const auto scene =
            scene_of(std::string("[device]\ntype = \"hand\"\nfile = \"press.csv\"\n") + placement,
                     folder / "scene.toml");
        const SceneDevice hand = make_device(*scene);
        EXPECT_EQ(hand.states, 2500u);
        test::ScriptedClock clock;
        std::vector<std::string> warnings;
        RunWatch watch;
        watch.warning = [&](const std::string& warning) { warnings.push_back(warning); };
        const Trace trace = run_trace(scene, hand.placed(), clock, hand.states, watch);
        ASSERT_EQ(trace.frames.size(), 2500u);
        EXPECT_LT(glm::length(trace.frames[400].force), 1e-9) << "in front of the ball";
        const FrameReport& pressed = trace.frames[2400];
        EXPECT_GT(pressed.force.z, 0.3) << "pushed out, along the scene's z";
        EXPECT_LT(std::hypot(pressed.force.x, pressed.force.y), 0.2 * pressed.force.z);
        EXPECT_LT(pressed.probe.z, 0.05);
        const std::string lowered =
            safe_coupling(scene->description().coupling, 1000.0, trace.device).warning;
        EXPECT_EQ(warnings,
                  lowered.empty() ? std::vector<std::string>{} : std::vector<std::string>{lowered});

        // The hand is gone; what it did gives the same bits.
        write_recording(folder / "r.h5", recorded(*scene, {}, trace));
        const Recording recording = read_recording(folder / "r.h5");
        const Trace again = run_again(scene, recording);
        for (std::size_t i = 0; i < trace.frames.size(); ++i) {
            ASSERT_EQ(again.frames[i].force, trace.frames[i].force) << i;
            ASSERT_EQ(again.frames[i].flags, trace.frames[i].flags) << i;
        }
    }
}

TEST(ClosedLoop, AnExceptionLeavesAStoppedDeviceWithoutForce) {
    test::ScriptedDevice device;
    test::ScriptedClock clock;
    RunWatch watch;
    watch.progress = [](double, std::string_view) { return false; };
    EXPECT_THROW(run_trace(scene_of(), {device, {}}, clock, 5000, watch), std::runtime_error);
    EXPECT_EQ(device.forces.back(), Vec3(0.0));
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));
}

// A device's time in several frames was taken for the frame's.
TEST(ClosedLoop, WhatASlowerDeviceSaidCanBePlayedAtTheLoopsRate) {
    test::TemporaryFolder folder;
    for (const double device_hz : {45.0, 125.0, 600.0, 800.0, 900.0}) {
        test::ScriptedDevice device;
        device.on_read = [&](std::size_t read, DeviceState& state) {
            come_down(read, state);
            state.time_s = std::floor(1e-3 * static_cast<double>(read) * device_hz) / device_hz;
        };
        test::ScriptedClock clock;
        const auto scene = scene_of();
        const Trace first = run_trace(scene, {device, {}}, clock, 400);
        const std::string name = fmt::format("r{:g}.h5", device_hz);
        write_recording(folder / name, recorded(*scene, {}, first));
        const auto again =
            scene_of(fmt::format("[device]\ntype = \"recording\"\nfile = \"{}\"\n", name),
                     folder / "scene.toml");
        EXPECT_NO_THROW(EXPECT_EQ(make_device(*again).states, 400u)) << device_hz;
    }
}

TEST(ClosedLoop, WhatAHandDidCanBePlayedAgain) {
    test::TemporaryFolder folder;
    test::ScriptedDevice device;
    device.on_read = come_down;
    const DevicePlacement placement(
        {PatientSide::left, PatientSide::superior, Vec3{0.0, 0.0, 0.03}, 1.0});
    test::ScriptedClock clock;
    const auto scene = scene_of();
    const Trace first = run_trace(scene, {device, placement}, clock, 200);
    write_recording(folder / "r.h5", recorded(*scene, {}, first));

    const auto again =
        scene_of("[device]\ntype = \"recording\"\nfile = \"r.h5\"\n", folder / "scene.toml");
    const SceneDevice recording = make_device(*again);
    EXPECT_EQ(recording.states, 200u);
    const Trace second = run_trace(again, recording.placed(), clock, recording.states);
    ASSERT_EQ(second.frames.size(), first.frames.size());
    for (std::size_t i = 0; i < first.frames.size(); ++i) {
        EXPECT_EQ(second.frames[i].proxy, first.frames[i].proxy);
        EXPECT_EQ(second.inputs[i].buttons, first.inputs[i].buttons);
        EXPECT_EQ(second.inputs[i].orientation, first.inputs[i].orientation);
    }

    const auto slower = scene_of("[device]\ntype = \"recording\"\nfile = \"r.h5\"\n[loop]\nrate_hz "
                                 "= 500\n",
                                 folder / "scene.toml");
    try {
        make_device(*slower);
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("was recorded at 1000 frames a second"),
                  std::string::npos)
            << error.what();
    }
}

} // namespace
} // namespace palpate
