// SPDX-License-Identifier: Apache-2.0
// What it costs that a body moves: the same orbit over the same bone of the generated CT, once with
// the bone at rest, and once with bone and hand carried about together, so that each feels the
// same. Both loops take turns, frame by frame. Counters: percentiles of the frames in contact, us;
// the ratio of the medians; and how far apart the two are, so that no speed is bought with it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <unistd.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/formats/volume_file.h>

#include "bench/internal/spread.h"

namespace palpate {
namespace {

std::shared_ptr<const Scene> bone(const char* contact, bool moves) {
    const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                       ("palpate-bench-" + std::to_string(getpid()) + ".nrrd");
    write_volume(make_phantom(), file);
    const std::string text =
        "[volume.ct]\nfile = \"" + file.string() +
        "\"\n[surface.bone]\nvolume = \"ct\"\niso_value = 226\nsmooth_voxels = 0.7\ncontact = \"" +
        contact + "\"\nmoves = " + (moves ? "true" : "false") +
        "\n[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n[device]\ntype = \"orbit\"\n"
        "duration_s = 10\n";
    SceneResources resources{.files = scene_files()};
#ifdef PALPATE_WITH_CGAL
    resources.extract = extract_isosurface;
#endif
    auto scene = std::make_shared<const Scene>(parse_scene(text, file), resources);
    std::filesystem::remove(file);
    return scene;
}

/// Carried about: 20 mm to and fro, and round by up to 0.3 rad.
RigidPose carried(double time_s) {
    return {{0.02 * std::sin(3.0 * time_s), 0.01 * std::sin(2.0 * time_s), 0.0},
            glm::angleAxis(0.3 * std::sin(time_s), glm::normalize(Vec3{1, 2, 3}))};
}

void frames(benchmark::State& state, const char* contact) {
    const auto still = bone(contact, false), moving = bone(contact, true);
    const std::vector<DeviceState> inputs = device_states(*still);
    SteadyClock clock;
    HapticLoop at_rest(still, clock), carried_about(moving, clock);
    bench::Spread still_us, moving_us;
    double apart_m = 0.0;
    std::size_t i = 0;
    for (auto _ : state) {
        const DeviceState& input = inputs[i++ % inputs.size()];
        const RigidPose pose = carried(input.time_s);
        DeviceState with_it = input;
        with_it.position = RigidMap(pose).point(input.position);
        const FrameReport a = at_rest.frame(input);
        carried_about.set_pose(0, pose);
        const FrameReport b = carried_about.frame(with_it);
        state.SetIterationTime(1e-6 * b.spent_us);
        if (a.contacts == 0 || b.contacts == 0) continue;
        still_us.add(a.spent_us);
        moving_us.add(b.spent_us);
        if (((a.flags | b.flags) & ~kBodyMoved) == 0)
            apart_m = std::max(apart_m, glm::length(RigidMap(pose).point_back(b.proxy) - a.proxy));
    }
    still_us.report(state, "still_", "us");
    moving_us.report(state, "moving_", "us");
    state.counters["ratio"] = moving_us.at(0.5) / still_us.at(0.5);
    state.counters["apart_um"] = 1e6 * apart_m;
    constexpr double kRidge = 20e-6; // m: a ridge may let go of one of them a frame earlier
    if (!(apart_m < kRidge)) state.SkipWithError("the two do not feel the same");
}

BENCHMARK_CAPTURE(frames, volume, "volume")->UseManualTime()->Iterations(10000);
#ifdef PALPATE_WITH_CGAL
BENCHMARK_CAPTURE(frames, guarded, "guarded")->UseManualTime()->Iterations(10000);
BENCHMARK_CAPTURE(frames, mesh, "mesh")->UseManualTime()->Iterations(10000);
#endif

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
