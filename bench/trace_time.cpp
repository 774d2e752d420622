// SPDX-License-Identifier: Apache-2.0
// What a trace costs in C++: one iteration is 100,000 frames of an orbit in a cavity, from inputs
// that are in memory to a Trace. bench/python_trace.py compares the same in Python with it.
#include <benchmark/benchmark.h>

#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>

namespace palpate {
namespace {

constexpr const char* kCavity = R"([volume.cavity]
analytic = "sphere_cavity"
radius_mm = 50
[surface.wall]
volume = "cavity"
[[effect]]
type = "surface"
surface = "wall"
[device]
type = "orbit"
duration_s = 100
)";

void trace(benchmark::State& state) {
    const auto scene = std::make_shared<const Scene>(parse_scene(kCavity, "cavity.toml"));
    std::vector<DeviceState> inputs = device_states(*scene);
    inputs.resize(100000, inputs.back());
    SteadyClock clock;
    for (auto _ : state)
        benchmark::DoNotOptimize(run_trace(scene, inputs, clock).frames.data());
}
BENCHMARK(trace)->Unit(benchmark::kMillisecond)->UseRealTime();

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
