// SPDX-License-Identifier: Apache-2.0
// What a frame costs, per method and contact, on the generated CT: one iteration is one frame of an
// orbit at 0.2 m/s, 1-5 mm deep. Counters: percentiles of the frames in contact, us; evaluations
// per frame; and the answer's error, so that no speed is bought with it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <benchmark/benchmark.h>

#include <unistd.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate {
namespace {

std::shared_ptr<const Scene> phantom_scene(const std::string& method, int sub_steps) {
    const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                       ("palpate-bench-" + std::to_string(getpid()) + ".nrrd");
    write_volume(make_phantom(), file);
    const std::string text =
        "[volume.ct]\nfile = \"" + file.string() +
        "\"\n[surface.bone]\nvolume = \"ct\"\niso_value = 226\nsmooth_voxels = 0.7\n[[effect]]\n"
        "type = \"surface\"\nsurface = \"bone\"\n[device]\ntype = \"orbit\"\nduration_s = 10\n"
        "[loop]\nmethod = \"" +
        method + "\"\nsub_steps = " + std::to_string(sub_steps) + "\n";
    auto scene = std::make_shared<const Scene>(parse_scene(text, file),
                                               SceneResources{.files = scene_files()});
    std::filesystem::remove(file);
    return scene;
}

void frames(benchmark::State& state, const char* method, int sub_steps) {
    const auto scene = phantom_scene(method, sub_steps);
    const std::vector<DeviceState> inputs = device_states(*scene);
    SteadyClock clock;
    HapticLoop loop(scene, clock);
    SurfaceAudit audit(*scene, scene->surfaces().front());
    std::vector<double> spent;
    double evaluations = 0.0;
    std::size_t i = 0;
    for (auto _ : state) {
        const FrameReport report = loop.frame(inputs[i++ % inputs.size()]);
        state.SetIterationTime(1e-6 * report.spent_us);
        evaluations += report.evaluations;
        if (report.contacts > 0) spent.push_back(report.spent_us);
        audit.add(report, {});
    }
    std::sort(spent.begin(), spent.end());
    double squares = 0.0;
    for (double distance : audit.level_distance_m())
        squares += distance * distance;
    const auto percentile = [&](double share) {
        return spent.empty()
                   ? 0.0
                   : spent[static_cast<std::size_t>(share * static_cast<double>(spent.size() - 1))];
    };
    state.counters["contact_p50_us"] = percentile(0.5);
    state.counters["contact_p99_us"] = percentile(0.99);
    state.counters["contact_max_us"] = percentile(1.0);
    state.counters["evaluations"] = evaluations / static_cast<double>(state.iterations());
    state.counters["level_rms_um"] =
        spent.empty()
            ? 0.0
            : 1e6 * std::sqrt(squares / static_cast<double>(audit.level_distance_m().size()));
}

BENCHMARK_CAPTURE(frames, adaptive, "adaptive", 1)->UseManualTime()->Iterations(10000);
BENCHMARK_CAPTURE(frames, single, "single", 1)->UseManualTime()->Iterations(10000);
BENCHMARK_CAPTURE(frames, fixed_8, "fixed", 8)->UseManualTime()->Iterations(10000);
BENCHMARK_CAPTURE(frames, fixed_46, "fixed", 46)->UseManualTime()->Iterations(10000);

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
