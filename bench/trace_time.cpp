// SPDX-License-Identifier: Apache-2.0
// What a trace costs in C++: one iteration is 100,000 frames of an orbit in a cavity, from rows of
// positions in memory to a Trace. bench/python_trace.py compares the same in Python with it.
#include <benchmark/benchmark.h>

#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/devices/probe_path.h>
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
    const LoopDescription& loop = scene->description().loop;
    std::vector<ProbeRow> rows;
    for (const DeviceState& input : device_states(*scene))
        rows.push_back({static_cast<double>(rows.size()) / loop.rate_hz, input.position});
    while (rows.size() < 100000)
        rows.push_back({static_cast<double>(rows.size()) / loop.rate_hz, rows.back().position});
    rows.resize(100000);
    SteadyClock clock;
    for (auto _ : state) {
        std::vector<DeviceState> inputs = probe_states(rows, loop.rate_hz);
        benchmark::DoNotOptimize(run_trace(scene, loop, std::move(inputs), clock).frames.data());
    }
}
BENCHMARK(trace)->Unit(benchmark::kMillisecond)->UseRealTime();

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
