// SPDX-License-Identifier: Apache-2.0
// A needle through labels of different material in a real brain (examples/brain_tissues.toml).
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

class Tissues : public testing::Test {
protected:
    void SetUp() override {
        const char* const data = std::getenv("PALPATE_REAL_DATA");
        const std::filesystem::path folder = data == nullptr ? "" : data;
        if (folder.empty() || !std::filesystem::exists(folder / "aal.nii.gz"))
            GTEST_SKIP() << "PALPATE_REAL_DATA names no folder with aal.nii.gz; get it with "
                         << "scripts/fetch_data.sh FOLDER labels";
        // The scene as it is, but for where its data is.
        const auto file = std::filesystem::path(PALPATE_EXAMPLES) / "brain_tissues.toml";
        std::ostringstream text;
        text << std::ifstream(file).rdbuf();
        const std::string there = "../demo-output/data/";
        std::string scene_text = text.str();
        for (auto at = scene_text.find(there); at != std::string::npos; at = scene_text.find(there))
            scene_text.replace(at, there.size(), folder.string() + "/");
        SceneDescription scene = parse_scene(scene_text, file);
        inputs_ = read_probe_path(scene.device.file, scene.loop.rate_hz);
        scene_ =
            std::make_shared<const Scene>(std::move(scene), SceneResources{.files = scene_files()});
    }

    std::shared_ptr<const Scene> scene_;
    std::vector<DeviceState> inputs_;
};

TEST_F(Tissues, OpenAtTheirStrengthAndStepByNoMore) {
    constexpr double kSpeed = 0.05;                  // m/s
    constexpr double kFrame = 500.0 * kSpeed * 1e-3; // N: stiffness times a frame's movement
    constexpr double kTolerance =
        500.0 * 1e-7 + 1e-3; // N: stiffness times the loop's, and a voxel's
    test::ScriptedClock clock;
    const Trace trace = run_trace(scene_, inputs_, clock);
    const auto& surfaces = scene_->surfaces();
    const auto& materials = scene_->description().materials;
    const auto material = [&](std::size_t i) -> const MaterialDescription& {
        return materials.at(scene_->description().surfaces.at(surfaces[i].name).material);
    };

    std::map<std::string, int> opened;
    for (std::size_t frame = 1; frame < trace.frames.size(); ++frame) {
        const FrameReport& before = trace.frames[frame - 1];
        const FrameReport& now = trace.frames[frame];
        const double force = glm::length(now.force), was = glm::length(before.force);
        // What presses, with its friction; what a frame's movement adds; what media add or end.
        double explained = kFrame + kTolerance;
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            explained += 2.0 * *material(i).damping_n_s_per_m * kSpeed;
            const bool felt = (before.surfaces_felt | now.surfaces_felt) >> i & 1u;
            if (felt)
                explained +=
                    material(i).strength.strongest() * std::hypot(1.0, *material(i).static_mu);
        }
        EXPECT_LE(std::abs(force - was), explained) << frame;

        const std::uint64_t opens = now.surfaces_open & ~before.surfaces_open;
        if (std::popcount(opens) != 1 || before.surfaces_felt != opens) continue;
        const auto i = static_cast<std::size_t>(std::countr_zero(opens));
        ++opened[surfaces[i].name];
        // Alone with the hand, up to one frame before; in a medium its drag comes on top.
        const double strength = material(i).strength.strongest();
        double drag = 0.0;
        for (std::size_t j = 0; j < surfaces.size(); ++j)
            if (before.surfaces_open >> j & 1u) drag += *material(j).damping_n_s_per_m * kSpeed;
        EXPECT_GE(was, strength - kFrame - kTolerance) << surfaces[i].name << " " << frame;
        EXPECT_LE(was, strength * std::hypot(1.0, *material(i).static_mu) + drag + kTolerance)
            << surfaces[i].name << " " << frame;
    }
    for (const char* name : {"putamen_l", "thalamus_l", "thalamus_r"})
        EXPECT_EQ(opened[name], 1) << name;
    for (const FrameReport& frame : trace.frames)
        EXPECT_EQ(frame.surface_queries, 0u);
}

} // namespace
} // namespace palpate
