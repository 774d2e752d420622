// SPDX-License-Identifier: Apache-2.0
// From a file to the first force that is felt, in seconds: the first time, from the cache, and with
// a preview that is felt while the mesh is extracted. Each run is a process of its own. Its phases
// are counters: field (read, smoothed, components), mesh (extracted or read), certify, rest (all
// else of the scene) and loop (made, and frames until there is a force); and cpu, of all threads.
// PALPATE_BENCH_VOLUME names the volume, else it is the generated phantom; the large one has 512^3
// voxels of int16, resampled from it with noise of +-10 HU, since no real one of that size comes
// with Debian.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/formats/volume_file.h>

namespace {

using namespace palpate;

constexpr std::array<int, 3> kSize{512, 512, 512};
constexpr double kLevel = 226.0; // HU, bone

struct Seconds {
    double field = 0.0, mesh = 0.0, certify = 0.0, rest = 0.0, loop = 0.0;
    double whole = 0.0;   ///< until the first force
    double adopted = 0.0; ///< until the scene itself is felt, where a preview was first
};

struct Outcome {
    Seconds wall;
    double cpu_s = 0.0;
    double peak_gib = 0.0;
};

/// Runs `work` in a process of its own, so that its memory and processor time can be told from
/// ours.
template <class Work>
Outcome in_child(const Work& work) {
    std::array<int, 2> pipe_ends{};
    if (pipe(pipe_ends.data()) != 0) throw std::runtime_error("no pipe");
    const pid_t child = fork();
    if (child == 0) {
        try {
            const Seconds wall = work();
            _exit(write(pipe_ends[1], &wall, sizeof wall) == sizeof wall ? 0 : 1);
        } catch (const std::exception& error) {
            fmt::print(stderr, "{}\n", error.what());
            _exit(1);
        }
    }
    close(pipe_ends[1]);
    Outcome outcome;
    const auto got = read(pipe_ends[0], &outcome.wall, sizeof outcome.wall);
    close(pipe_ends[0]);
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || got != sizeof outcome.wall)
        throw std::runtime_error("the child failed");
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    outcome.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    outcome.peak_gib = static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);
    return outcome;
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

/// As examples/skull.toml; the large volume is felt without a mesh.
SceneDescription bone(const std::filesystem::path& file, const std::string& more) {
    return parse_scene(fmt::format("[volume.head]\nfile = \"{}\"\n[surface.bone]\nvolume = "
                                   "\"head\"\niso_value = {}\nsmooth_voxels = 0.7\n"
                                   "iso_after_smoothing = \"keep_position\"\nkeep = "
                                   "\"largest\"\n{}[[effect]]\ntype = \"surface\"\nsurface = "
                                   "\"bone\"\n",
                                   file.string(), kLevel, more),
                       "first_touch.toml");
}

/// How long each step of a scene's set-up takes, told from what it says of its progress.
class Phases {
public:
    Progress progress() {
        return [this](double, std::string_view what) {
            enter(what == "certifying the mesh"                   ? &Seconds::certify
                  : what == "extracting" || what == "done"        ? &Seconds::mesh
                  : what == "field ready" || what == "mesh ready" ? after(what)
                                                                  : now_);
            return true;
        };
    }
    void enter(double Seconds::*next) {
        const double t_us = clock_.now_us();
        seconds_.*now_ += 1e-6 * (t_us - since_us_);
        since_us_ = t_us;
        now_ = next;
    }
    Seconds seconds() {
        enter(now_);
        seconds_.whole = 1e-6 * (clock_.now_us() - began_us_);
        return seconds_;
    }
    double whole() { return 1e-6 * (clock_.now_us() - began_us_); }

private:
    /// A mesh that is read from the cache says nothing before it is certified.
    static double Seconds::*after(std::string_view what) {
        return what == "field ready" ? &Seconds::mesh : &Seconds::rest;
    }

    SteadyClock clock_;
    double began_us_ = clock_.now_us();
    double since_us_ = began_us_;
    double Seconds::*now_ = &Seconds::field;
    Seconds seconds_;
};

/// A hand that comes from the left along the middle of the volume and goes in, 0.1 mm a frame.
/// Returns once there is a force.
class Hand {
public:
    Hand(const Scene& scene, HapticLoop& loop) : loop_(loop) {
        const ScalarField& field = *scene.surfaces()[0].baked.field;
        const Box box = field.bounds();
        const Vec3 from{box.lower.x - 1e-3, box.center().y, box.center().z};
        const Vec3 to{box.upper.x, from.y, from.z};
        const auto root =
            field.make_sampler()->first_root(from, to, scene.surfaces()[0].level.level);
        if (!root) throw std::runtime_error("there is no surface along the middle of the volume");
        at_ = from + *root * (to - from) - Vec3{5e-4, 0.0, 0.0};
    }
    void press() {
        constexpr int kMostFrames = 100; // 10 mm
        for (int i = 0; i < kMostFrames; ++i, at_.x += 1e-4)
            if (glm::length(frame().force) > 0.0) return;
        throw std::runtime_error("no force was felt 9 mm deep");
    }
    void lift() { at_.x -= 2e-3; }
    FrameReport frame() {
        DeviceState state;
        state.time_s = 1e-3 * ++frames_;
        state.position = at_;
        return loop_.frame(state);
    }

private:
    HapticLoop& loop_;
    Vec3 at_{0.0};
    int frames_ = 0;
};

SceneResources resources(const std::filesystem::path& cache, Progress progress = {}) {
    SceneResources with{.files = scene_files(cache), .progress = std::move(progress)};
#ifdef PALPATE_WITH_CGAL
    with.extract = extract_isosurface;
#endif
    return with;
}

Seconds first_touch(const SceneDescription& description, const std::filesystem::path& cache) {
    Phases phases;
    const auto scene =
        std::make_shared<const Scene>(description, resources(cache, phases.progress()));
    phases.enter(&Seconds::loop);
    SteadyClock clock;
    HapticLoop loop(scene, clock);
    Hand(*scene, loop).press();
    return phases.seconds();
}

/// What docs/embedding.md shows: the volume is felt while another thread makes the scene.
Seconds previewed_touch(const SceneDescription& description, const std::filesystem::path& cache) {
    Phases phases;
    const auto preview =
        std::make_shared<const Scene>(preview_of(description), resources(cache, phases.progress()));
    phases.enter(&Seconds::loop);
    auto whole = std::async(std::launch::async, [&] {
        return std::make_shared<const Scene>(description, resources(cache));
    });
    SteadyClock clock;
    HapticLoop loop(preview, clock);
    Hand hand(*preview, loop);
    hand.press();
    Seconds seconds = phases.seconds();
    while (whole.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready)
        hand.frame();
    hand.lift(); // what is new is felt from outside
    hand.frame();
    loop.adopt(whole.get());
    if ((hand.frame().flags & kSceneAdopted) == 0)
        throw std::runtime_error("the scene was not adopted");
    seconds.adopted = phases.whole();
    hand.press();
    return seconds;
}

/// The volume is made once a run, in the folder for temporary files.
const std::filesystem::path& folder() {
    static const std::filesystem::path made = [] {
        const std::filesystem::path path = std::filesystem::temp_directory_path() /
                                           fmt::format("palpate-first-touch-{}", getpid());
        std::filesystem::create_directories(path);
        return path;
    }();
    return made;
}

SceneDescription skull() {
    const char* named = std::getenv("PALPATE_BENCH_VOLUME");
    const std::filesystem::path file =
        named ? std::filesystem::absolute(named) : folder() / "phantom.nrrd";
    if (!named && !std::filesystem::exists(file)) write_volume(make_phantom(), file);
    return bone(file, "");
}

SceneDescription large() {
    if (!std::filesystem::exists(folder() / "large.nhdr"))
        in_child([] {
            write_large_ct(folder());
            return Seconds{};
        });
    return bone(folder() / "large.nhdr", "contact = \"volume\"\n");
}

void report(benchmark::State& state, const Outcome& outcome) {
    const Seconds& wall = outcome.wall;
    state.SetIterationTime(wall.whole);
    const auto mean = [&](const char* name, double value) {
        state.counters[name].flags = benchmark::Counter::kAvgIterations;
        state.counters[name].value += value;
    };
    mean("field_s", wall.field);
    mean("mesh_s", wall.mesh);
    mean("certify_s", wall.certify);
    mean("rest_s", wall.rest);
    mean("loop_s", wall.loop);
    if (wall.adopted > 0.0) mean("adopted_s", wall.adopted);
    mean("cpu_s", outcome.cpu_s);
    state.counters["peak_gib"] = std::max(state.counters["peak_gib"].value, outcome.peak_gib);
}

using Describe = SceneDescription (*)();
using Touch = Seconds (*)(const SceneDescription&, const std::filesystem::path&);

void empty_cache(benchmark::State& state, Describe describe, Touch touch) {
    const SceneDescription scene = describe();
    for (auto one : state) {
        std::filesystem::remove_all(folder() / "cache");
        report(state, in_child([&] { return touch(scene, folder() / "cache"); }));
    }
}

void from_cache(benchmark::State& state, Describe describe) {
    const SceneDescription scene = describe();
    in_child([&] { return first_touch(scene, folder() / "cache"); });
    for (auto one : state)
        report(state, in_child([&] { return first_touch(scene, folder() / "cache"); }));
}

BENCHMARK_CAPTURE(empty_cache, skull, skull, first_touch)
    ->Unit(benchmark::kSecond)
    ->UseManualTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(empty_cache, skull_with_preview, skull, previewed_touch)
    ->Unit(benchmark::kSecond)
    ->UseManualTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(from_cache, skull, skull)
    ->Unit(benchmark::kSecond)
    ->UseManualTime()
    ->Iterations(3);
BENCHMARK_CAPTURE(empty_cache, large, large, first_touch)
    ->Unit(benchmark::kSecond)
    ->UseManualTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(from_cache, large, large)
    ->Unit(benchmark::kSecond)
    ->UseManualTime()
    ->Iterations(3);

} // namespace

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    std::filesystem::remove_all(folder());
    return 0;
}
