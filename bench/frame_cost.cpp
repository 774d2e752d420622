// SPDX-License-Identifier: Apache-2.0
// What a frame costs, per method and contact: an orbit over the bone of the generated CT and of a
// real head CT at 0.2 m/s, 1 to 5 mm deep; the paper's circle in a sphere of 327,680 facets; a hand
// that slides off a plate at 2 m/s; nothing at all. And of some of them the movement of the proxy
// alone (Subdivision::advance), as other engines' steps are measured. One iteration is a pass over
// all frames; the time is that of one. Counters: percentiles; ns per sub-step; and how far the
// proxy is from the surface, so that no speed is bought with it.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/isosurface.h>

#include "bench/internal/query_streams.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/mesh_references.h"
#include "tests/support/odd_meshes.h"

namespace palpate::bench {
namespace {

/// Files that the scenes read; gone when the benchmark ends. Mesh files are in mm.
struct Files {
    std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("palpate-frame-cost-" + std::to_string(getpid()));
    Files() {
        std::filesystem::create_directories(folder);
        write_volume(make_phantom(), folder / "ct.nrrd");
        write_ply(test::turned(test::icosphere(0.05, 7)), folder / "ball.ply");
        write_ply(test::plate(), folder / "plate.ply");
    }
    ~Files() { std::filesystem::remove_all(folder); }
    Files(const Files&) = delete;
    Files& operator=(const Files&) = delete;
};

/// A scene, and the hand that feels it.
struct Subject {
    std::shared_ptr<const Scene> scene;
    std::vector<DeviceState> hand;
};

using Subjects = std::function<Subject()>;

std::shared_ptr<const Scene> made(const std::string& text) {
    static const Files files;
    static std::map<std::string, std::shared_ptr<const Scene>> known;
    auto& scene = known[text];
    if (scene) return scene;
    SceneResources resources{
        // What takes minutes, a mesh of the real head, is where the command keeps it too.
        .files = scene_files(text.find("skull") == std::string::npos
                                 ? ResultCache(files.folder / "cache")
                                 : ResultCache(usual_cache_folder()))};
#ifdef PALPATE_WITH_CGAL
    resources.extract = extract_isosurface;
#endif
    return scene = std::make_shared<const Scene>(parse_scene(text, files.folder / "scene.toml"),
                                                 resources);
}

std::string felt(const std::string& name) {
    return "[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
}

std::string bone(const std::string& file, const std::string& contact) {
    return "[surface." + contact +
           "]\nvolume = \"head\"\niso_value = 226\nsmooth_voxels = 0.7\nkeep = \"largest\"\n"
           "contact = \"" +
           contact + "\"\n" + felt(contact) + "[volume.head]\nfile = \"" + file + "\"\n";
}

/// Of a scene without a device.
std::vector<DeviceState> orbit_over(const std::string& text) {
    static std::map<std::string, std::vector<DeviceState>> known;
    auto& states = known[text];
    if (states.empty())
        states = device_states(*made(text + "[device]\ntype = \"orbit\"\nduration_s = 10\n"));
    return states;
}

/// The bone of a CT; `contacts` of the same bone, all felt at once. Always the same hand.
Subject bone_scene(const std::string& file, const std::vector<std::string>& contacts) {
    std::string text = "[volume.head]\nfile = \"" + file + "\"\n";
    for (const std::string& contact : contacts) {
        const std::string one = bone(file, contact);
        text += one.substr(0, one.find("[volume.head]"));
    }
    return {made(text), orbit_over(bone(file, "volume"))};
}

std::vector<DeviceState> hand_along(const std::vector<std::vector<Vec3>>& trials) {
    std::vector<DeviceState> states;
    for (std::size_t trial = 0; trial < trials.size(); ++trial)
        for (std::size_t i = 0; i < trials[trial].size(); ++i) {
            DeviceState state;
            state.time_s = 1e-3 * static_cast<double>(states.size());
            state.position = trials[trial][i];
            state.trial = static_cast<std::uint32_t>(trial);
            states.push_back(state);
        }
    return states;
}

constexpr std::size_t kFrames = 5000;

/// 0.2 m/s behind the wall of a cavity of 50 mm: the paper's circle.
std::vector<Vec3> paper_circle() {
    std::vector<Vec3> way{{0.0495, 0.0, 0.0}};
    for (std::size_t i = 1; i < kFrames; ++i) {
        const double angle = 0.2e-3 * static_cast<double>(i) / 0.055;
        way.push_back(0.055 * Vec3{std::cos(angle), std::sin(angle), 0.0});
    }
    return way;
}

Subject sphere() {
    return {made("[surface.ball]\nmesh = \"ball.ply\"\nmesh_unit = \"mm\"\n" + felt("ball")),
            hand_along({paper_circle()})};
}

/// From the middle of a plate over its edge, 2.5 mm behind its face, 2 m/s, in all directions.
std::vector<std::vector<Vec3>> strokes_off_the_plate() {
    constexpr double kGoldenAngle = 2.399963;
    std::vector<std::vector<Vec3>> strokes;
    for (std::size_t i = 0; i < kFrames / 27; ++i) {
        const double angle = kGoldenAngle * static_cast<double>(i);
        strokes.push_back({{0.0, 0.0, 0.0006}});
        for (int k = 0; k < 26; ++k)
            strokes.back().push_back(
                {2e-3 * k * std::cos(angle), 2e-3 * k * std::sin(angle), -0.002});
    }
    return strokes;
}

Subject plate() {
    return {made("[surface.plate]\nmesh = \"plate.ply\"\nmesh_unit = \"mm\"\n" + felt("plate")),
            hand_along(strokes_off_the_plate())};
}

/// Nothing to feel, or a wall by a formula 2 mm in front of the hand.
Subject circle_over(const std::string& text) {
    std::vector<Vec3> way{{0.02, 0.0, 0.1001}};
    for (std::size_t i = 1; i < kFrames; ++i) {
        const double angle = 0.2e-3 * static_cast<double>(i) / 0.02;
        way.push_back({0.02 * std::cos(angle), 0.02 * std::sin(angle), 0.098});
    }
    return {made(text), hand_along({way})};
}

Subject nothing() { return circle_over(""); }

Subject plane() {
    return circle_over("[volume.wall]\nanalytic = \"slab\"\nthickness_mm = 200\n"
                       "[surface.wall]\nvolume = \"wall\"\n" +
                       felt("wall"));
}

/// Skin of 0.2 N/mm, 10 mm of it over bone that is felt from 16.7 mm on, 12 to 20 mm deep.
Subject skin_over_bone() {
    std::vector<Vec3> way{{0.0601, 0.0, 0.0}};
    for (std::size_t i = 1; i < kFrames; ++i) {
        const double angle = 0.2e-3 * static_cast<double>(i) / 0.044;
        const double radius_m = 0.044 - 0.004 * std::sin(3.0 * angle);
        way.push_back(radius_m * Vec3{std::cos(angle), std::sin(angle), 0.0});
    }
    return {made("[volume.body]\nanalytic = \"solid_sphere\"\nradius_mm = 60\n"
                 "[surface.bone]\nvolume = \"body\"\niso_value = 0.01\n" +
                 felt("bone") + "[surface.skin]\nvolume = \"body\"\nstiffness_n_per_mm = 0.2\n" +
                 felt("skin")),
            hand_along({way})};
}

// What is right, and what is counted -------------------------------------------------------------

/// A pass over all frames that is not timed.
struct Counted {
    double evaluations = 0.0; // by frame
    double in_contact = 0.0;  // share of the frames
    double off_m = 0.0; // rms distance of the proxy from the surface; without one, from the probe
    std::uint64_t broken = 0; // chords through a mesh, frames that ended below a level
    Spread evaluations_of, sub_steps_of;
    std::vector<Vec3> proxies;
};

double rms(const std::vector<double>& numbers) {
    double squares = 0.0;
    for (const double number : numbers)
        squares += number * number;
    return numbers.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(numbers.size()));
}

Counted count(const Subject& subject, HapticLoop& loop, std::size_t frames) {
    std::vector<SurfaceAudit> audits;
    for (const SceneSurface& surface : subject.scene->surfaces())
        audits.emplace_back(*subject.scene, surface);
    Counted counted;
    std::vector<double> from_probe;
    for (std::size_t i = 0; i < frames; ++i) {
        const FrameReport report = loop.frame(subject.hand[i]);
        counted.evaluations += report.evaluations;
        counted.in_contact += report.contacts > 0 ? 1.0 : 0.0;
        counted.evaluations_of.add(report.evaluations);
        counted.sub_steps_of.add(report.sub_steps);
        counted.proxies.push_back(report.proxy);
        from_probe.push_back(glm::length(report.proxy - report.probe));
        for (SurfaceAudit& audit : audits)
            audit.add(report, loop.path());
    }
    for (double* sum : {&counted.evaluations, &counted.in_contact})
        *sum /= static_cast<double>(frames);
    if (audits.empty()) counted.off_m = rms(from_probe);
    for (const SurfaceAudit& audit : audits) {
        counted.broken += audit.chords_through();
        if (audit.surface().contact != ContactKind::direct) counted.broken += audit.frames_inside();
        counted.off_m =
            std::max({counted.off_m, rms(audit.level_distance_m()), rms(audit.mesh_distance_m())});
    }
    return counted;
}

/// What a frame promises: `adaptive` ends on the surface, but for a ridge that lets go now and
/// then; with any method no chord passes through a mesh, and none ends below a level but of
/// `direct`.
bool is_right(const Counted& counted, SteppingMethod method) {
    constexpr double kOffSurface = 5e-6; // m, rms; a residual of 0.1 um is allowed in each frame
    return counted.broken == 0 &&
           (method != SteppingMethod::adaptive || counted.off_m <= kOffSurface);
}

/// The hand's states for the i-th frame of all passes: each pass begins a new trial.
class Passes {
public:
    explicit Passes(const std::vector<DeviceState>& hand) : hand_(hand) {}
    const DeviceState& state(std::size_t i) {
        if (i == 0) first_trial_ += 1 + hand_.back().trial;
        now_ = hand_[i];
        now_.trial += first_trial_;
        return now_;
    }

private:
    const std::vector<DeviceState>& hand_;
    std::uint32_t first_trial_ = 0;
    DeviceState now_;
};

void frames(benchmark::State& state, const Subjects& make, const LoopDescription& method) {
    const Subject subject = make();
    const bool uses_all_time = method.method == SteppingMethod::paper;
    const std::size_t frames = std::min(subject.hand.size(), uses_all_time ? 500 : kFrames);
    SteadyClock clock;
    HapticLoop loop(subject.scene, clock, method);
    Counted counted = count(subject, loop, frames);
    if (!is_right(counted, method.method))
        return state.SkipWithError("the proxy is not where the surface is");
    Passes passes(subject.hand);
    measure(state, frames, [&](std::size_t i) { return loop.frame(passes.state(i)); });
    state.counters["sub_step_ns"] = state.counters["p50_ns"] / counted.evaluations_of.at(0.5);
    state.counters["evaluations"] = counted.evaluations;
    state.counters["in_contact"] = counted.in_contact;
    state.counters["off_um"] = 1e6 * counted.off_m;
    if (!uses_all_time) return;
    state.counters["sub_steps_p50"] = counted.sub_steps_of.at(0.5);
    state.counters["sub_steps_p1"] = counted.sub_steps_of.at(0.01);
}

/// The movement of the proxy alone, over a scene's own hand. It is right where it is the same as in
/// whole frames.
void advance(benchmark::State& state, const Subjects& make, const std::string& mesh) {
    const Subject subject = make();
    SteadyClock clock;
    HapticLoop loop(subject.scene, clock);
    const std::size_t frames = std::min(subject.hand.size(), kFrames);
    const Counted whole = count(subject, loop, frames);
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    if (!mesh.empty()) {
        const SceneSurface& surface = subject.scene->surfaces().front();
        surfaces.push_back(
            std::make_unique<MeshContact>(surface.mesh.certified, MeshContactSettings{}));
    }
    test::ContactLoop alone({}, std::move(surfaces));
    const auto move = [&](std::size_t i) {
        if (i == 0 || subject.hand[i].trial != subject.hand[i - 1].trial)
            alone.start(subject.hand[i].position);
        return alone.move(subject.hand[i].position);
    };
    for (std::size_t i = 0; i < frames; ++i)
        if (glm::length(move(i).proxy - whole.proxies[i]) > 1e-12)
            return state.SkipWithError("the proxy is not where whole frames have it");
    measure(state, frames, move);
}

void add(const std::string& name, const std::function<void(benchmark::State&)>& run) {
    benchmark::RegisterBenchmark(name.c_str(), run)->UseManualTime()->Iterations(1);
}

void add_frames(const std::string& contact, const Subjects& make, const std::string& method) {
    LoopDescription loop;
    loop.method = method == "adaptive" ? SteppingMethod::adaptive
                  : method == "single" ? SteppingMethod::single
                  : method == "paper"  ? SteppingMethod::paper
                                       : SteppingMethod::fixed;
    add("frame/" + method + "/" + contact,
        [=](benchmark::State& state) { frames(state, make, loop); });
}

void add_bones(const std::string& data, const std::string& file) {
    std::vector<std::vector<std::string>> kinds{{"volume"}};
#ifdef PALPATE_WITH_CGAL
    kinds.insert(kinds.end(), {{"guarded"}, {"direct"}, {"mesh"}, {"volume", "mesh"}});
#endif
    for (const auto& contacts : kinds)
        for (const char* method : {"adaptive", "single", "fixed", "paper"})
            add_frames(
                data + "_" + contacts.front() + (contacts.size() > 1 ? "_and_mesh" : ""),
                [=] { return bone_scene(file, contacts); }, method);
}

} // namespace
} // namespace palpate::bench

int main(int argc, char** argv) {
    using namespace palpate::bench;
    for (const char* method : {"adaptive", "single", "fixed", "paper"}) {
        add_frames("empty", nothing, method);
        add_frames("plane", plane, method);
        add_frames("sphere_330k", sphere, method);
        add_frames("plate_2mps", plate, method);
    }
    add_frames("skin_over_bone", skin_over_bone, "adaptive");
    add("advance/empty", [](benchmark::State& state) { advance(state, nothing, ""); });
    add("advance/sphere_330k", [](benchmark::State& state) { advance(state, sphere, "ball"); });
    add("advance/plate_2mps", [](benchmark::State& state) { advance(state, plate, "plate"); });
    add_bones("ct", "ct.nrrd");
    if (const auto skull = skull_file())
        add_bones("skull", std::filesystem::absolute(*skull).string());
    else
        register_left_out("frame/skull");
    return run_registered(argc, argv);
}
