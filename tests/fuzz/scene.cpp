// SPDX-License-Identifier: Apache-2.0
// The text of a scene. One of formulas alone is made, and felt for some frames.
#include <memory>
#include <string>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/fuzz/target.h"
#include "tests/support/scripted_clock.h"

using namespace palpate;

namespace {

constexpr std::size_t kMostEffects = 40;
constexpr int kFrames = 6;

/// No files, and nothing that takes long to make.
bool is_small(const SceneDescription& scene) {
    for (const auto& [name, volume] : scene.volumes)
        if (!volume.file.empty()) return false;
    for (const auto& [name, surface] : scene.surfaces)
        if (!surface.mesh.empty()) return false;
    return scene.effects.size() <= kMostEffects;
}

void feel(const SceneDescription& description) {
    const auto scene = std::make_shared<const Scene>(description, SceneResources{});
    test::ScriptedClock clock(5.0);
    HapticLoop loop(scene, clock);
    for (int i = 0; i < kFrames; ++i) {
        DeviceState hand;
        hand.time_s = i / description.loop.rate_hz;
        hand.position = {4e-3 * i, -1e-3 * i, 2e-2 - 8e-3 * i};
        const FrameReport frame = loop.frame(hand);
        test::must(is_finite(frame.force) && is_finite(frame.proxy), "a frame is not finite");
        test::must(glm::length(frame.force) <= description.limits.force_n * (1.0 + 1e-12),
                   "a force is over the limit");
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    SceneDescription scene;
    const auto read = [&] {
        scene = parse_scene(test::as_text(data, size), "/nowhere/scene.toml");
    };
    if (test::is_taken(read) && is_small(scene)) test::is_taken([&] { feel(scene); });
    return 0;
}
