// SPDX-License-Identifier: Apache-2.0
// From a large CT's file to the first frame in which it can be felt: seconds and memory, the first
// time and from the cache. The CT has 512 x 512 x 400 voxels of int16, resampled from the volume
// that PALPATE_BENCH_VOLUME names (else from the generated phantom) with noise of +-10 HU, since no
// real one of that size comes with Debian.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <stdexcept>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/formats/volume_file.h>

namespace {

using namespace palpate;

constexpr std::array<int, 3> kSize{512, 512, 400};
constexpr double kLevel = 226.0; // HU, bone

struct Outcome {
    double seconds = 0.0;
    double peak_gib = 0.0;
};

/// Runs `work` in a process of its own, so that its memory can be told from ours.
template <class Work>
Outcome in_child(const Work& work) {
    SteadyClock clock;
    const double began = clock.now_us();
    const pid_t child = fork();
    if (child == 0) {
        try {
            work();
            _exit(0);
        } catch (const std::exception& error) {
            fmt::print(stderr, "{}\n", error.what());
            _exit(1);
        }
    }
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw std::runtime_error("the child failed");
    return {1e-6 * (clock.now_us() - began),
            static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0)};
}

VoxelVolume source() {
    const char* named = std::getenv("PALPATE_BENCH_VOLUME");
    return named ? read_volume(named) : make_phantom();
}

/// header.nhdr + raw in `folder`.
void write_large_ct(const std::filesystem::path& folder) {
    const VoxelVolume original = source();
    const GridField field(original, static_cast<float>(value_range(original)[0]));
    const auto sampler = field.make_sampler();
    std::mt19937 random(1);
    std::uniform_int_distribution<int> noise(-10, 10);
    std::ofstream raw(folder / "large.raw", std::ios::binary);
    std::vector<std::int16_t> row(static_cast<std::size_t>(kSize[0]));
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j) {
            for (int i = 0; i < kSize[0]; ++i) {
                const Vec3 index{(i + 0.5) * original.size[0] / kSize[0] - 0.5,
                                 (j + 0.5) * original.size[1] / kSize[1] - 0.5,
                                 (k + 0.5) * original.size[2] / kSize[2] - 0.5};
                const Vec3 last(original.size[0] - 1, original.size[1] - 1, original.size[2] - 1);
                const Vec3 within = glm::clamp(index, Vec3(0.0), last); // no ramp at the rim
                const double value = sampler->value(original.index_to_scene.point(within));
                row[static_cast<std::size_t>(i)] =
                    static_cast<std::int16_t>(std::lround(value) + noise(random));
            }
            raw.write(reinterpret_cast<const char*>(row.data()),
                      static_cast<std::streamsize>(row.size() * sizeof(row[0])));
        }
    std::string directions;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const Vec3 step = 1e3 * original.index_to_scene.linear[axis] *
                          (static_cast<double>(original.size[a]) / kSize[a]);
        directions += fmt::format("({:.17g},{:.17g},{:.17g}) ", step.x, step.y, step.z);
    }
    std::ofstream(folder / "large.nhdr")
        << fmt::format("NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\n"
                       "sizes: {} {} {}\nspace directions: {}\nspace origin: (0,0,0)\n"
                       "endian: little\nencoding: raw\ndata file: large.raw\n",
                       kSize[0], kSize[1], kSize[2], directions);
}

void first_touch(const std::filesystem::path& folder) {
    SceneDescription description = parse_scene(
        fmt::format("[volume.head]\nfile = \"large.nhdr\"\n[surface.bone]\nvolume = \"head\"\n"
                    "iso_value = {}\nsmooth_voxels = 0.7\nkeep = \"largest\"\n"
                    "contact = \"volume\"\n[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n",
                    kLevel),
        folder / "large.toml");
    const auto scene = std::make_shared<const Scene>(
        description, SceneResources{.files = scene_files(folder / "cache")});
    SteadyClock clock;
    HapticLoop loop(scene, clock);
    DeviceState state;
    state.position = scene->surfaces()[0].baked.field->bounds().center();
    benchmark::DoNotOptimize(loop.frame(state));
}

/// The volume is made once a run, in the folder for temporary files.
const std::filesystem::path& large_ct() {
    static const std::filesystem::path folder = [] {
        const std::filesystem::path made =
            std::filesystem::temp_directory_path() / fmt::format("palpate-large-ct-{}", getpid());
        std::filesystem::create_directories(made);
        in_child([&] { write_large_ct(made); });
        return made;
    }();
    return folder;
}

void report(benchmark::State& state, const Outcome& outcome) {
    state.SetIterationTime(outcome.seconds);
    state.counters["peak_gib"] = outcome.peak_gib;
}

void from_file(benchmark::State& state) {
    for (auto one : state) {
        std::filesystem::remove_all(large_ct() / "cache");
        report(state, in_child([] { first_touch(large_ct()); }));
    }
}

void from_cache(benchmark::State& state) {
    if (!std::filesystem::exists(large_ct() / "cache")) in_child([] { first_touch(large_ct()); });
    for (auto one : state)
        report(state, in_child([] { first_touch(large_ct()); }));
}

BENCHMARK(from_file)->Unit(benchmark::kSecond)->UseManualTime()->Iterations(1);
BENCHMARK(from_cache)->Unit(benchmark::kSecond)->UseManualTime()->Iterations(3);

} // namespace

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    std::filesystem::remove_all(large_ct());
    return 0;
}
