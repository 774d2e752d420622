// SPDX-License-Identifier: Apache-2.0
// What the queries of a sub-step cost, on the generated CT: along an orbit at 0.2 m/s, where a hand
// would be.
#include <stdexcept>

#include <benchmark/benchmark.h>

#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/solver/proxy_solver.h>
#include <palpate/volume/fields/grid_field.h>

namespace palpate {
namespace {

constexpr double kLevel = 226.0;

const GridField& field() {
    static const GridField one(make_phantom(), -1000.0f);
    return one;
}

const std::vector<Vec3>& places() {
    static const std::vector<Vec3> points = [] {
        DeviceDescription orbit;
        orbit.depth_min_mm = orbit.depth_max_mm = 0.0;
        orbit.duration_s = 5.0;
        std::vector<Vec3> result;
        for (const DeviceState& state : make_orbit(field(), kLevel, orbit, 1000.0))
            result.push_back(state.position);
        return result;
    }();
    return points;
}

void sample(benchmark::State& state) {
    const auto sampler = field().make_sampler();
    std::size_t i = 0;
    for (auto _ : state)
        benchmark::DoNotOptimize(sampler->sample(places()[i++ % places().size()]));
}

void first_root(benchmark::State& state) {
    const auto sampler = field().make_sampler();
    const double length = 1e-6 * static_cast<double>(state.range(0));
    std::size_t i = 0;
    for (auto _ : state) {
        const Vec3& p = places()[i++ % places().size()];
        benchmark::DoNotOptimize(
            sampler->first_root(p + length * glm::normalize(p), p, kLevel + 25.0));
    }
}

const SurfaceScene& scene() {
    static const SurfaceScene one(std::make_shared<TriangleMesh>(field().preview(kLevel)));
    return one;
}

void ray(benchmark::State& state) {
    const double length = 1e-6 * static_cast<double>(state.range(0));
    std::size_t i = 0;
    for (auto _ : state) {
        const Vec3& p = places()[i++ % places().size()];
        benchmark::DoNotOptimize(scene().first_hit(p + length * glm::normalize(p), p));
    }
}

void closest_point(benchmark::State& state) {
    std::size_t i = 0;
    for (auto _ : state)
        benchmark::DoNotOptimize(scene().closest_point(places()[i++ % places().size()], 0.5e-3));
}

void solver(benchmark::State& state) {
    PrimitiveSet set;
    for (int k = 0; k < state.range(0); ++k)
        set.add(
            {{1e-4 * k, 0, 0}, glm::normalize(Vec3{0.3 * k - 0.5, 0.2 * k * k - 0.3, 1.0}), 1e9});
    const Vec3 probe{0.001, -0.0005, -0.003};
    if (solve_proxy(set, probe, 500.0).residual_m > 1e-14)
        throw std::runtime_error("the solver is wrong");
    for (auto _ : state)
        benchmark::DoNotOptimize(solve_proxy(set, probe, 500.0));
}

BENCHMARK(sample);
BENCHMARK(first_root)->ArgName("um")->Arg(50)->Arg(200)->Arg(1000)->Arg(10000);
BENCHMARK(ray)->ArgName("um")->Arg(50)->Arg(200)->Arg(1000)->Arg(10000);
BENCHMARK(closest_point);
BENCHMARK(solver)->ArgName("planes")->Arg(1)->Arg(2)->Arg(3)->Arg(6);

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
