// SPDX-License-Identifier: Apache-2.0
// Ways to a mesh of an isosurface, side by side: what each costs, and what the mesh is worth. On
// the generated CT, and on the volume that PALPATE_BENCH_VOLUME names at the level
// PALPATE_BENCH_LEVEL, smoothed by PALPATE_BENCH_SMOOTH voxels (0.7), when they are set.
// docs/extraction.md has a table of it.
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <malloc.h>
#include <sys/resource.h>

#include <benchmark/benchmark.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/geometry/mesh_intersections.h>
#include <palpate/geometry/mesh_report.h>
#include <palpate/geometry/surface_seeds.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/fields/level_distance.h>

#include "bench/internal/extraction_methods.h"

namespace palpate {
namespace {

constexpr IsosurfaceSettings kSettings{30.0, 2.0e-3, 0.2e-3};

/// A field with its level, and what every method starts from.
struct Subject {
    std::shared_ptr<const GridField> grid;
    double level = 0.0;
    TriangleMesh preview;
    std::vector<Vec3> seeds;
};

Subject prepared(std::shared_ptr<const GridField> grid, double level) {
    Subject subject{std::move(grid), level, {}, {}};
    subject.preview = subject.grid->preview(level);
    subject.seeds =
        choose_seeds(subject.preview, kSettings.facet_size_m, kSmallestComponentTriangles);
    // The few that the preview's Newton steps could not bring onto the level: the library mends
    // them, the other methods would take them as they are.
    const auto sampler = subject.grid->make_sampler();
    std::erase_if(subject.seeds, [&](const Vec3& seed) {
        const FieldSample s = sampler->sample(seed);
        return !(std::abs(s.value - level) < 1.0e-7 * glm::length(s.slope)); // 0.1 um
    });
    return subject;
}

Subject generated() {
    return prepared(std::make_shared<GridField>(make_phantom(), -1000.0f), 226.0);
}

Subject scanned(const std::string& file, double level, double smooth_voxels) {
    SceneDescription scene;
    scene.file = file;
    scene.volumes["volume"].file = file;
    SurfaceDescription& surface = scene.surfaces["surface"];
    surface.volume = "volume";
    surface.iso_value = level;
    surface.smooth_voxels = smooth_voxels;
    const BakedSurface baked = bake_surface(scene, "surface", {});
    return prepared(baked.grid, baked.level);
}

using Method = std::function<TriangleMesh(const Subject&)>;

bench::ExtractionTask task_of(const Subject& subject) {
    return {*subject.grid, subject.level, subject.seeds, kSettings};
}

TriangleMesh by_library(const Subject& subject) {
    const auto sampler = subject.grid->make_sampler();
    Isosurface surface;
    surface.value = [&](const Vec3& p) { return sampler->value(p) - subject.level; };
    surface.bounds = subject.grid->bounds();
    surface.seeds = subject.seeds;
    return extract_isosurface(surface, kSettings);
}

/// A line of /proc/self/status, MiB.
double memory_mib(const std::string& key) {
    std::ifstream status("/proc/self/status");
    std::string word;
    while (status >> word)
        if (word == key + ":") {
            double kib = 0.0;
            status >> kib;
            return kib / 1024.0;
        }
    return 0.0;
}

/// Forgets the peak of memory so far.
void reset_peak() {
    ::malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << 5;
}

bool same_bytes(const TriangleMesh& x, const TriangleMesh& y) {
    return x.vertices.size() == y.vertices.size() && x.triangles == y.triangles &&
           (x.vertices.empty() || std::memcmp(x.vertices.data(), y.vertices.data(),
                                              x.vertices.size() * sizeof(Vec3)) == 0);
}

void report_error(benchmark::State& state, const std::string& where, const LevelDistance& error) {
    state.counters[where + "_mean_um"] = 1e6 * error.mean_m;
    state.counters[where + "_p99_um"] = 1e6 * error.p99_m;
    state.counters[where + "_max_um"] = 1e6 * error.max_m;
    state.counters[where + "_lost"] = static_cast<double>(error.lost);
}

void report_mesh(benchmark::State& state, const Subject& subject, const TriangleMesh& mesh) {
    const MeshReport report = inspect(mesh);
    std::size_t wanted = 0;
    for (const MeshComponent& component : inspect(subject.preview).components)
        wanted += component.triangles >= kSmallestComponentTriangles ? 1 : 0;
    const auto missing = missing_components(subject.preview, mesh, kSmallestComponentTriangles,
                                            kSettings.facet_size_m);
    const auto count = [&](const std::string& name, std::size_t value) {
        state.counters[name] = static_cast<double>(value);
    };
    count("triangles", report.triangles);
    count("components", report.components.size());
    count("components_wanted", wanted);
    count("components_missing", missing.size());
    count("border_edges", report.border_edges);
    count("non_manifold_edges", report.non_manifold_edges);
    count("non_manifold_vertices", report.non_manifold_vertices);
    count("self_intersections", count_self_intersections(mesh));
    state.counters["smallest_angle_deg"] = report.smallest_angle_deg;
    const MeshError error = mesh_error(*subject.grid, subject.level, mesh);
    report_error(state, "vertex", error.vertices);
    report_error(state, "centroid", error.centroids);
}

double cpu_seconds() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void extract(benchmark::State& state, const std::function<const Subject&()>& subject_of,
             const Method& method) {
    const Subject& subject = subject_of();
    TriangleMesh mesh;
    for (auto _ : state) {
        reset_peak();
        const double before_mib = memory_mib("VmRSS"), before_s = cpu_seconds();
        mesh = method(subject);
        state.counters["cpu_s"] = cpu_seconds() - before_s;
        state.counters["peak_mib"] = memory_mib("VmHWM") - before_mib;
    }
    state.counters["same_bytes"] = same_bytes(mesh, method(subject)) ? 1.0 : 0.0;
    report_mesh(state, subject, mesh);
}

void register_methods(const std::string& name, const std::function<const Subject&()>& subject) {
    const auto add = [&](const std::string& method, const Method& run) {
        benchmark::RegisterBenchmark((name + "/" + method).c_str(),
                                     [=](benchmark::State& state) { extract(state, subject, run); })
            ->Iterations(1)
            ->Unit(benchmark::kSecond)
            ->UseRealTime();
    };
    add("preview_newton", [](const Subject& s) { return s.grid->preview(s.level); });
    add("surface_mesher", [](const Subject& s) { return bench::by_surface_mesher(task_of(s)); });
    add("mesh_3_parallel", [](const Subject& s) { return bench::by_parallel_mesh_3(task_of(s)); });
    add("library", by_library);
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    using namespace palpate;
    register_methods("generated", []() -> const Subject& {
        static const Subject one = generated();
        return one;
    });
    const char* file = std::getenv("PALPATE_BENCH_VOLUME");
    const char* level = std::getenv("PALPATE_BENCH_LEVEL");
    const char* smooth = std::getenv("PALPATE_BENCH_SMOOTH");
    if (file && level)
        register_methods("scanned", [=]() -> const Subject& {
            static const Subject one =
                scanned(file, std::atof(level), smooth ? std::atof(smooth) : 0.7);
            return one;
        });
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
