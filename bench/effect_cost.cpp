// SPDX-License-Identifier: Apache-2.0
// What effects cost, each alone and all together: one iteration is one frame of a hand that moves
// along a wall at 0.2 m/s. Argument: the frame's sub-steps, so that a sub-step costs (time at 33 -
// time at 1) / 32, and 0 for a frame as scenes have it by default (adaptive). Scalars are the
// generated CT's, vectors a helix by formula, the mesh a sphere with a hand of its own. Counters
// say what was felt and asked for: where something is to be felt and no force is, there is no
// price.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <unistd.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/formats/volume_file.h>

#include "bench/internal/spread.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

constexpr double kMeshRadius = 0.05; // m
constexpr int kMeshLevels = 6;       // 81 920 facets, of 0.8 mm
constexpr int kManySubSteps = 33;

/// Files that the scenes read; gone when the benchmark ends.
struct Files {
    std::filesystem::path folder = std::filesystem::temp_directory_path() /
                                   ("palpate-effect-cost-" + std::to_string(getpid()));
    Files() {
        std::filesystem::create_directories(folder);
        write_volume(make_phantom(), folder / "ct.nrrd");
        write_ply(test::icosphere(kMeshRadius, kMeshLevels), folder / "ball.ply");
    }
    ~Files() { std::filesystem::remove_all(folder); }
};

std::string ct() { return "[volume.ct]\nfile = \"ct.nrrd\"\n"; }

std::string bone() {
    return "[surface.bone]\nvolume = \"ct\"\niso_value = 226\nsmooth_voxels = 0.7\ncontact = "
           "\"volume\"\n[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";
}

std::string ball() {
    return "[surface.ball]\nmesh = \"ball.ply\"\nmesh_unit = \"mm\"\n[[effect]]\ntype = "
           "\"surface\"\nsurface = \"ball\"\n";
}

std::string stream() {
    return "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 60\npitch_mm = 60\n";
}

std::string of_ct(const std::string& type, const std::string& strength) {
    return "[[effect]]\ntype = \"" + type + "\"\nvolume = \"ct\"\n" + strength + "\n";
}

std::string of_stream(const std::string& type) {
    return "[[effect]]\ntype = \"" + type + "\"\nvolume = \"stream\"\nstrength_n = 0.3\n";
}

const std::string kGradientSurface =
    of_ct("gradient_surface", "strength_n = [[100, 0], [300, 0.5]]");
const std::string kGradientForce = of_ct("gradient_force", "strength_n = 0.2");
const std::string kViscosity = of_ct("viscosity", "damping_n_s_per_m = [[-1000, 1], [300, 3]]");
const std::string kEvenViscosity = "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 2\n";
const std::string kConstantForce =
    "[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, -0.2]\n";
const std::string kFriction =
    "[[effect]]\ntype = \"friction\"\nsurface = \"bone\"\nstatic = 0.4\ndynamic = 0.3\n";

const std::string kMagnet =
    "[[effect]]\ntype = \"magnet\"\nsurface = \"bone\"\nstrength_n = 0.3\ncapture_mm = 2\n";
const std::string kTexture =
    "[[effect]]\ntype = \"texture\"\nsurface = \"bone\"\nwavelength_mm = 3\nheight_mm = 0.2\n";
const std::string kTextureOfCt =
    "[[effect]]\ntype = \"texture\"\nsurface = \"bone\"\nvolume = \"ct\"\nheight_mm = [[0, 0], "
    "[600, 0.2]]\n";
const std::string kVibration = "[[effect]]\ntype = \"vibration\"\n";
const std::string kGravity =
    "[[effect]]\ntype = \"gravity_compensation\"\nmass_kg = 0.05\ndown = [0, 0, -1]\n";
const std::string kPoint =
    "[[effect]]\ntype = \"guide\"\npoints_mm = [[0, 0, 0]]\nstrength_n = 0.3\n";
const std::string kBox =
    "[[effect]]\ntype = \"workspace\"\nbox_mm = [[-20, -20, -20], [20, 20, 20]]\n";
const std::string kBall =
    "[[effect]]\ntype = \"workspace\"\nradius_mm = 20\ncenter_mm = [0, 0, 0]\n";

/// A circle of 200 pieces as a guide.
std::string circle() {
    std::string text =
        "[[effect]]\ntype = \"guide\"\nends = \"closed\"\nstrength_n = 0.3\npoints_mm = [";
    for (int i = 0; i < 200; ++i) {
        const double angle = 2.0 * std::acos(-1.0) * i / 200.0;
        text += "[" + std::to_string(40.0 * std::cos(angle)) + ", " +
                std::to_string(40.0 * std::sin(angle)) + ", 0.0],";
    }
    return text + "]\n";
}

/// Around a level, 1 to 3 mm deep.
std::vector<DeviceState> hand_around(const ScalarField& field, double level) {
    DeviceDescription orbit;
    orbit.depth_min_mm = 1.0;
    orbit.depth_max_mm = 3.0;
    orbit.duration_s = 5.0;
    return make_orbit(field, level, orbit, 1000.0);
}

/// The hand: around the CT's bone.
const std::vector<DeviceState>& hand() {
    static const auto states = hand_around(GridField(make_phantom(), -1000.0F), 226.0);
    return states;
}

/// That of the mesh, around its ball.
const std::vector<DeviceState>& hand_of_ball() {
    static const auto states = hand_around(*make_solid_sphere(kMeshRadius), 0.0);
    return states;
}

/// Made once: Google Benchmark asks for each of them many times.
std::shared_ptr<const Scene> scene_of(const std::string& text) {
    static const Files files;
    static std::map<std::string, std::shared_ptr<const Scene>> known;
    auto& scene = known[text];
    if (!scene)
        scene = std::make_shared<const Scene>(parse_scene(text, files.folder / "scene.toml"),
                                              SceneResources{.files = scene_files()});
    return scene;
}

/// Whether the hand feels a force somewhere along its way. Asked once, before the first frame that
/// is timed.
bool is_felt(const std::string& text, const std::vector<DeviceState>& inputs) {
    static std::map<std::string, bool> known;
    const auto [found, is_new] = known.emplace(text, false);
    if (!is_new) return found->second;
    SteadyClock clock;
    HapticLoop loop(scene_of(text), clock);
    for (const DeviceState& input : inputs)
        if (loop.frame(input).force != Vec3(0.0)) return found->second = true;
    return false;
}

void frames(benchmark::State& state, const std::string& text,
            const std::vector<DeviceState>& inputs) {
    const auto sub_steps = state.range(0);
    const std::string loop_text =
        sub_steps == 0
            ? "[loop]\nmethod = \"adaptive\"\n"
            : "[loop]\nmethod = \"fixed\"\nsub_steps = " + std::to_string(sub_steps) + "\n";
    if (!text.empty() && !is_felt(text + loop_text, inputs))
        return state.SkipWithError("nothing is felt");
    SteadyClock clock;
    HapticLoop loop(scene_of(text + loop_text), clock);
    double force_n = 0.0, samples = 0.0, evaluations = 0.0;
    std::size_t i = 0;
    for (auto _ : state) {
        const FrameReport report = loop.frame(inputs[i++ % inputs.size()]);
        force_n += glm::length(report.force);
        samples += report.field_samples;
        evaluations += report.evaluations;
    }
    if (!std::isfinite(force_n)) return state.SkipWithError("a force is not finite");
    const auto per_frame = [&](double sum) {
        return sum / static_cast<double>(state.iterations());
    };
    state.counters["force_n"] = per_frame(force_n);
    state.counters["samples"] = per_frame(samples);
    state.counters["evaluations"] = per_frame(evaluations);
}

/// One pass over the hand's way, however long a frame takes: rows are subtracted from each other.
void measure(const char* name, const std::string& text,
             const std::vector<DeviceState>& inputs = hand()) {
    benchmark::RegisterBenchmark(name, frames, text, std::cref(inputs))
        ->ArgName("sub_steps")
        ->Arg(0)
        ->Arg(1)
        ->Arg(kManySubSteps)
        ->Iterations(static_cast<benchmark::IterationCount>(inputs.size()));
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    using namespace palpate;
    measure("nothing", "");
    measure("surface_volume", ct() + bone());
    measure("surface_mesh", ball(), hand_of_ball());
    measure("surface_volume_friction", ct() + bone() + kFriction);
    measure("surface_volume_magnet", ct() + bone() + kMagnet);
    measure("surface_volume_texture", ct() + bone() + kTexture);
    measure("surface_volume_texture_of_volume", ct() + bone() + kTextureOfCt);
    measure("surface_volume_vibration", ct() + bone() + kVibration);
    measure("guide_point", kPoint);
    measure("guide_polyline", circle());
    measure("workspace_box", kBox);
    measure("workspace_ball", kBall);
    measure("gravity_compensation", kGravity);
    measure("gradient_surface", ct() + kGradientSurface);
    measure("gradient_force", ct() + kGradientForce);
    measure("viscosity_of_volume", ct() + kViscosity);
    measure("viscosity", kEvenViscosity);
    measure("constant_force", kConstantForce);
    for (const char* type : {"vector_force", "vector_follow", "front_shape", "vortex"})
        measure(type, stream() + of_stream(type));
    measure("three_of_one_volume", ct() + kGradientSurface + kGradientForce + kViscosity);
    measure("all_of_volumes", ct() + stream() + bone() + kFriction + kMagnet + kTexture +
                                  kVibration + kGravity + circle() + kPoint + kBox + kBall +
                                  kGradientSurface + kGradientForce + kViscosity + kConstantForce +
                                  of_stream("vector_force") + of_stream("vector_follow") +
                                  of_stream("front_shape") + of_stream("vortex"));
    return bench::run_registered(argc, argv);
}
