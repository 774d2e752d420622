// SPDX-License-Identifier: Apache-2.0
// Textures on a real head CT.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/surface_audit.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

class SkullTexture : public testing::Test {
protected:
    void SetUp() override {
        const char* const data = std::getenv("PALPATE_REAL_DATA");
        folder_ = data == nullptr ? "" : data;
        if (folder_.empty() || !std::filesystem::exists(folder_ / "skull.nhdr"))
            GTEST_SKIP() << "PALPATE_REAL_DATA names no folder with skull.nhdr; get it with "
                         << "scripts/fetch_data.sh FOLDER skull";
    }

    std::shared_ptr<const Scene> bone(const std::string& texture) {
        SceneResources resources;
        resources.files = scene_files(folder_ / "cache");
        return std::make_shared<const Scene>(
            parse_scene(fmt::format("[volume.head]\nfile = \"{}\"\n[surface.bone]\nvolume = "
                                    "\"head\"\niso_value = 226\nsmooth_voxels = 0.7\nkeep = "
                                    "\"largest\"\ncontact = \"volume\"\n[[effect]]\ntype = "
                                    "\"surface\"\nsurface = \"bone\"\n{}",
                                    (folder_ / "skull.nhdr").string(), texture),
                        "bone.toml"),
            resources);
    }

    struct Findings {
        double deepest = -1e9;          ///< of all chords, above the level, HU
        std::vector<double> in_front_m; ///< of frames that felt the bone and ended in time
        double evaluations = 0.0;
        long frames = 0, capped = 0;
    };

    static Findings orbit(const std::shared_ptr<const Scene>& scene) {
        const SceneSurface& surface = scene->surfaces().front();
        DeviceDescription device;
        device.depth_min_mm = 0.5;
        device.depth_max_mm = 1.5;
        device.speed_m_per_s = 0.1;
        device.duration_s = 10.0;
        const auto sampler = surface.baked.field->make_sampler();
        const double level = surface.level.level;
        test::ScriptedClock clock;
        HapticLoop loop(scene, clock);
        Findings found;
        for (const DeviceState& state : make_orbit(orbit_target(surface), device, 1000.0)) {
            const FrameReport frame = loop.frame(state);
            const auto path = loop.path();
            for (std::size_t i = 1; i < path.size(); ++i)
                for (int k = 0; k <= 10; ++k)
                    found.deepest = std::max(
                        found.deepest,
                        sampler->value(path[i - 1] + 0.1 * k * (path[i] - path[i - 1])) - level);
            ++found.frames;
            found.evaluations += frame.evaluations;
            const bool capped = (frame.flags & kEvaluationCap) != 0;
            found.capped += capped ? 1 : 0;
            if (frame.surfaces_felt == 0 || capped) continue;
            // > 0: inside
            found.in_front_m.push_back(-level_distance(*sampler, frame.proxy, level, 0.5e-3));
        }
        return found;
    }

    std::filesystem::path folder_;
};

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values)
        sum += value;
    return sum / static_cast<double>(values.size());
}

// Bumps of 0.2 mm are half as high on average. A scan's edges are blurred, along which heights are
// measured by the gradient at the crest: half to one and a half times as high as they are named.
// Whatever is felt, no chord goes deeper than the bare bone's certificate.
TEST_F(SkullTexture, IsFeltAndLetsNothingThrough) {
    const std::string touch = "[[effect]]\ntype = \"texture\"\nsurface = \"bone\"\n";
    const auto bare = bone("");
    const SceneSurface& surface = bare->surfaces().front();
    const double tau = LevelScale::of(*surface.baked.field, surface.level).certificate;
    const Findings without = orbit(bare);
    EXPECT_LE(std::abs(mean(without.in_front_m)), 2e-6);
    for (const std::string& keys :
         {std::string("wavelength_mm = 3\nheight_mm = 0.2\n"),
          std::string("volume = \"head\"\nheight_mm = [[-200, 0], [226, 0.1], [1200, 0.2]]\n")}) {
        const Findings with = orbit(bone(touch + keys));
        EXPECT_LE(with.deepest, tau * (1.0 + 1e-9)) << keys;
        ASSERT_GT(with.in_front_m.size(), 3000u) << keys;
        EXPECT_GE(mean(with.in_front_m), 0.05e-3) << keys;
        EXPECT_LE(mean(with.in_front_m), 0.15e-3) << keys;
        double variance = 0.0;
        for (const double height : with.in_front_m)
            variance += (height - mean(with.in_front_m)) * (height - mean(with.in_front_m));
        const double spread_m = std::sqrt(variance / static_cast<double>(with.in_front_m.size()));
        EXPECT_GE(spread_m, 0.005e-3) << keys;
        EXPECT_LE(with.evaluations / static_cast<double>(with.frames), 5.0) << keys;
        RecordProperty("mean_um", fmt::format("{:.1f}", 1e6 * mean(with.in_front_m)));
        RecordProperty("spread_um", fmt::format("{:.1f}", 1e6 * spread_m));
        RecordProperty("capped_of", fmt::format("{} of {}", with.capped, with.frames));
    }
}

} // namespace
} // namespace palpate
