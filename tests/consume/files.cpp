// SPDX-License-Identifier: Apache-2.0
// Uses palpate::files as an embedding simulator would: a ball of voxels is written, named by a
// scene, felt, recorded, read back and played again, bit for bit.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/run/trace.h>
#include <palpate/palpate.h>
#include <palpate/volume/formats/volume_file.h>
#ifdef WITH_EXTRACTION
#include <palpate/geometry/isosurface.h>
#endif

namespace {

/// Depth in a ball of 20 mm, 100 per mm, in voxels of 1 mm.
palpate::VoxelVolume ball() {
    palpate::VoxelVolume volume;
    volume.size = {60, 60, 60};
    volume.index_to_scene = {palpate::Mat3(1e-3), palpate::Vec3(-29.5e-3)};
    for (int k = 0; k < 60; ++k)
        for (int j = 0; j < 60; ++j)
            for (int i = 0; i < 60; ++i) {
                const palpate::Vec3 p = volume.index_to_scene.point(palpate::Vec3(i, j, k));
                const double depth_mm = std::clamp(20.0 - 1e3 * glm::length(p), -5.0, 5.0);
                volume.values.push_back(static_cast<float>(100.0 * depth_mm));
            }
    return volume;
}

bool same(const palpate::Vec3& a, const palpate::Vec3& b) {
    for (int axis = 0; axis < 3; ++axis)
        if (std::bit_cast<std::uint64_t>(a[axis]) != std::bit_cast<std::uint64_t>(b[axis]))
            return false;
    return true;
}

} // namespace

int main() {
    const std::filesystem::path folder = std::filesystem::absolute("palpate-consumer-files");
    std::filesystem::create_directories(folder);
    palpate::write_volume(ball(), folder / "ball.nrrd");
    palpate::SceneResources resources{.files = palpate::scene_files(folder / "cache")};
#ifdef WITH_EXTRACTION
    resources.extract = [](const palpate::Isosurface& surface,
                           const palpate::IsosurfaceSettings& settings,
                           const palpate::Progress& progress) {
        return palpate::extract_isosurface(surface, settings, progress);
    };
#endif
    const auto scene = std::make_shared<const palpate::Scene>(
        palpate::parse_scene("[volume.ct]\nfile = \"ball.nrrd\"\n"
                             "[surface.ball]\nvolume = \"ct\"\niso_value = 0\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n",
                             folder / "scene.toml"),
        resources);
#ifdef WITH_EXTRACTION
    const bool contact_right = scene->plan().effects[0].contact == "guarded";
#else
    const bool contact_right = scene->plan().effects[0].contact == "volume";
#endif

    // Pressed 2 mm into a hard ball: 500 N/m * 2 mm, along x; voxels of 1 mm know it to some um.
    std::vector<palpate::DeviceState> inputs;
    for (int frame = 0; frame <= 60; ++frame) {
        palpate::DeviceState hand;
        hand.time_s = 1e-3 * frame;
        hand.position = {0.024 - 1e-4 * frame, 0.0, 0.0};
        inputs.push_back(hand);
    }
    palpate::SteadyClock clock;
    const palpate::Trace trace = palpate::run_trace(scene, inputs, clock);
    const bool force_right = std::abs(trace.frames.back().force.x - 1.0) < 0.02;

    palpate::write_recording(folder / "recording.h5", palpate::recorded(*scene, {}, trace));
    const palpate::Recording recording = palpate::read_recording(folder / "recording.h5");
    const palpate::Trace again = palpate::run_again(
        palpate::recorded_scene(recording, folder / "recording.h5", resources), recording);
    bool replay_right = again.frames.size() == trace.frames.size();
    for (std::size_t i = 0; replay_right && i < again.frames.size(); ++i)
        replay_right = same(again.frames[i].force, trace.frames[i].force);
    std::filesystem::remove_all(folder);

    std::printf("contact %s, force %.6f N (expected 1), replay %s\n",
                scene->plan().effects[0].contact.c_str(), trace.frames.back().force.x,
                replay_right ? "the same" : "differs");
    return contact_right && force_right && replay_right ? 0 : 1;
}
