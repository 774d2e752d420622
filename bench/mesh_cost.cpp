// SPDX-License-Identifier: Apache-2.0
// What a frame of contact `mesh` costs: the paper's path on meshes of its cavity, at 0.2 to 5 m/s;
// one iteration is one frame, gathering, solving and sliding included. Counters: percentiles of the
// frames in contact, us; pieces of way and queries per frame; and the distance from the closest
// point of the mesh, so that no speed is bought with it.
#include <algorithm>

#include <benchmark/benchmark.h>

#include "bench/internal/spread.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/mesh_references.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

void cavity(benchmark::State& state, int levels, bool turned, double step) {
    const TriangleMesh plain = test::icosphere(0.05, levels);
    const auto mesh = test::certified(turned ? test::turned(plain) : plain);
    test::ContactLoop loop({}, test::one_mesh(mesh));
    const std::vector<Vec3> path = test::out_and_round(step);
    loop.start(path.front());
    bench::Spread spent;
    double legs = 0.0, error = 0.0;
    std::size_t i = 0;
    for (auto _ : state) {
        if (i == path.size()) {
            i = 0;
            loop.start(path.front());
        }
        const Vec3& probe = path[i++];
        const auto began = bench::Timer::now();
        const SubdivisionResult frame = loop.move(probe);
        const double us = 1e-3 * bench::since_ns(began);
        state.SetIterationTime(1e-6 * us);
        if (frame.contacts == 0) continue;
        spent.add(us);
        legs += frame.sub_steps;
        if (i % 64) continue;
        const auto closest = mesh->scene().closest_point(probe, 0.01);
        error = std::max(error, glm::length(closest->position - loop.proxy()));
    }
    spent.report(state, "contact_", "us");
    state.counters["legs"] = legs / static_cast<double>(spent.size());
    state.counters["queries"] = static_cast<double>(loop.surface(0).queries().surface_queries) /
                                static_cast<double>(state.iterations());
    state.counters["error_um"] = 1e6 * error;
    if (!(error < 1e-9)) state.SkipWithError("the proxy is not the closest point of the mesh");
}

/// Set-up: neighbours, certificates and Embree's tree.
void certify(benchmark::State& state, int levels) {
    const auto mesh = std::make_shared<const TriangleMesh>(test::icosphere(0.05, levels));
    for (auto _ : state)
        benchmark::DoNotOptimize(CertifiedMesh(mesh).uncertain_count());
    state.counters["triangles"] = static_cast<double>(mesh->triangles.size());
}

BENCHMARK_CAPTURE(cavity, 80k_02mps, 6, true, 0.2e-3)->UseManualTime()->Iterations(40000);
BENCHMARK_CAPTURE(cavity, 330k_02mps, 7, false, 0.2e-3)->UseManualTime()->Iterations(40000);
BENCHMARK_CAPTURE(cavity, 330k_turned_02mps, 7, true, 0.2e-3)->UseManualTime()->Iterations(40000);
BENCHMARK_CAPTURE(cavity, 330k_turned_1mps, 7, true, 1e-3)->UseManualTime()->Iterations(20000);
BENCHMARK_CAPTURE(cavity, 330k_turned_5mps, 7, true, 5e-3)->UseManualTime()->Iterations(10000);
BENCHMARK_CAPTURE(certify, 330k, 7)->Unit(benchmark::kMillisecond)->Iterations(2);

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
