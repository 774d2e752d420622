// SPDX-License-Identifier: Apache-2.0
// Calls of the C interface in any order, with sizes, pointers and numbers that may be wrong: each
// is done or refused, and a frame's force is finite and within the scene's limit.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <palpate/palpate_c.h>

#include "tests/fuzz/target.h"

namespace {

using palpate::test::Input;
using palpate::test::must;

constexpr double kLimit_n = 4.0;
constexpr int kMostCalls = 120;
constexpr std::size_t kMostHandles = 3;

const char* const kScenes[] = {
    "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\nvolume = \"v\"\n"
    "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[limits]\nforce_n = 4\n",
    "[volume.v]\nanalytic = \"bumpy_cavity\"\nradius_mm = 20\n[volume.w]\nanalytic = \"helix\"\n"
    "[surface.s]\nvolume = \"v\"\nmoves = true\nstrength_n = 2\n[[effect]]\ntype = \"surface\"\n"
    "surface = \"s\"\n[[effect]]\ntype = \"friction\"\nsurface = \"s\"\n[[effect]]\ntype = "
    "\"vector_follow\"\nvolume = \"w\"\nstrength_n = 1\n[limits]\nforce_n = 4\n",
    "[volume.scan]\n[surface.s]\nvolume = \"scan\"\niso_value = 0\ncontact = \"volume\"\n"
    "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[limits]\nforce_n = 4\n"};

template <class Struct>
Struct sized(Input& input) {
    Struct made{};
    made.size = sizeof made;
    if (input.choice(32) == 0) made.size = input.take<std::uint16_t>() % (2 * sizeof made);
    return made;
}

void must_be_a_code(int code) {
    must(code == PALPATE_OK || code == PALPATE_BAD_CALL || code == PALPATE_BAD_INPUT, "a code");
}

struct Handles {
    std::vector<palpate_scene*> scenes;
    std::vector<palpate_loop*> loops;
    std::vector<palpate_state*> states;

    Handles() = default;
    Handles(const Handles&) = delete;
    Handles& operator=(const Handles&) = delete;
    ~Handles() {
        for (palpate_scene* scene : scenes)
            palpate_scene_free(scene);
        for (palpate_loop* loop : loops)
            palpate_loop_free(loop);
        for (palpate_state* state : states)
            palpate_state_free(state);
    }
    /// One of them, or none.
    template <class Handle>
    static Handle* any(const std::vector<Handle*>& of, Input& input) {
        const unsigned which = input.choice(16);
        return of.empty() || which == 0 ? nullptr : of[which % of.size()];
    }
};

/// Voxels of a ball; what is said of them may be wrong.
palpate_code add_voxels(palpate_data* data, Input& input, palpate_error* error) {
    constexpr int kSide = 12;
    static const std::vector<float> values = [] {
        std::vector<float> made;
        made.reserve(kSide * kSide * kSide);
        for (int n = 0; n < kSide * kSide * kSide; ++n) {
            const int i = n % kSide - 6, j = n / kSide % kSide - 6, k = n / kSide / kSide - 6;
            made.push_back(4.0F - std::sqrt(static_cast<float>(i * i + j * j + k * k)));
        }
        return made;
    }();
    auto voxels = sized<palpate_voxels>(input);
    for (int axis = 0; axis < 3; ++axis) {
        voxels.voxels[axis] = kSide;
        voxels.index_to_scene[axis][axis] = 1e-3;
        voxels.index_to_scene[axis][3] = -6e-3;
    }
    voxels.values = values.data();
    voxels.value_count = values.size();
    switch (input.choice(8)) {
    case 0:
        voxels.voxels[input.choice(3)] = input.take<std::int32_t>();
        break;
    case 1:
        voxels.value_count = input.take<std::uint64_t>() % values.size();
        break;
    case 2:
        voxels.index_to_scene[input.choice(3)][input.choice(4)] = input.take<double>();
        break;
    case 3:
        voxels.values = nullptr;
        break;
    default:
        break;
    }
    return palpate_data_add_voxels(data, input.choice(16) == 0 ? nullptr : "scan", &voxels, error);
}

void make_scene(Handles& have, Input& input, palpate_error* error) {
    palpate_data* data = nullptr;
    must_be_a_code(palpate_data_make(&data, error));
    must_be_a_code(add_voxels(data, input, error));
    auto options = sized<palpate_scene_options>(input);
    options.data = input.choice(2) == 0 ? data : nullptr;
    palpate_scene* scene = nullptr;
    const int code =
        palpate_scene_parse(kScenes[input.choice(3)], "scene.toml", &options, &scene, error);
    must_be_a_code(code);
    must((code == PALPATE_OK) == (scene != nullptr), "a scene and a code");
    if (scene && have.scenes.size() < kMostHandles)
        have.scenes.push_back(scene);
    else
        palpate_scene_free(scene);
    palpate_data_free(data);
}

void make_loop(Handles& have, Input& input, palpate_error* error) {
    auto device = sized<palpate_device>(input);
    device.force_n = 3.0;
    auto options = sized<palpate_loop_options>(input);
    options.method = static_cast<std::int32_t>(input.choice(7)) - 1;
    if (input.choice(4) == 0) {
        device.force_n = input.length();
        device.position_step_m = input.length();
        device.delay_s = input.length();
        device.scale = input.length();
        options.device = &device;
    }
    if (input.choice(8) == 0) options.rate_hz = input.take<double>();
    if (input.choice(8) == 0) options.sub_steps = input.take<std::int16_t>();
    if (input.choice(8) == 0) options.tolerance_um = input.length();
    palpate_loop* loop = nullptr;
    must_be_a_code(palpate_loop_make(Handles::any(have.scenes, input), &options, &loop, error));
    if (loop && have.loops.size() < kMostHandles)
        have.loops.push_back(loop);
    else
        palpate_loop_free(loop);
}

void make_frame(palpate_loop* loop, Input& input) {
    auto probe = sized<palpate_probe>(input);
    auto frame = sized<palpate_frame>(input);
    probe.time_s = input.length();
    for (double& x : probe.position_m)
        x = input.length();
    probe.trial = input.choice(32) == 0 ? 1 : 0;
    probe.is_stale = input.choice(32) == 0 ? 1 : 0;
    const int code = palpate_loop_frame(loop, &probe, input.choice(64) == 0 ? nullptr : &frame);
    must_be_a_code(code);
    if (code != PALPATE_OK) return;
    const double length = std::hypot(frame.force_n[0], frame.force_n[1], frame.force_n[2]);
    must(length <= kLimit_n * (1.0 + 1e-12), "a force that is over the limit, or none");
    ++palpate::test::taken;
    for (const double x : frame.proxy_m)
        must(std::isfinite(x), "a proxy that is not finite");
}

void ask(palpate_loop* loop, Input& input) {
    std::array<palpate_touch, PALPATE_MOST_TOUCHES> touches{};
    for (palpate_touch& touch : touches)
        touch.size = sizeof touch;
    std::size_t count = 0;
    const std::size_t room = input.choice(PALPATE_MOST_TOUCHES + 1);
    must_be_a_code(palpate_loop_touches(loop, touches.data(), room, &count));
    must(count <= PALPATE_MOST_TOUCHES, "more touches than there can be");
    std::array<palpate_surface_state, 2> states{};
    for (palpate_surface_state& state : states)
        state = sized<palpate_surface_state>(input);
    must_be_a_code(palpate_loop_surface_states(loop, states.data(), input.choice(3), &count));
    palpate_loop_path(loop, &count);
    palpate_loop_warning(loop, input.choice(4));
    auto wrench = sized<palpate_wrench>(input);
    must_be_a_code(palpate_loop_wrench(loop, input.choice(3), &wrench));
    auto pose = sized<palpate_pose>(input);
    must_be_a_code(palpate_loop_pose(loop, input.choice(3), &pose));
}

void set(palpate_loop* loop, Input& input) {
    const double gain = input.choice(4) == 0 ? input.take<double>() : 0.1 * input.choice(100);
    must_be_a_code(palpate_loop_set_gain(loop, input.choice(4), gain));
    auto pose = sized<palpate_pose>(input);
    for (double& x : pose.position_m)
        x = input.length();
    for (double& q : pose.orientation)
        q = input.length();
    must_be_a_code(palpate_loop_set_pose(loop, input.choice(2), &pose));
}

void save_or_restore(Handles& have, palpate_loop* loop, Input& input, palpate_error* error) {
    if (input.choice(2) == 0)
        return must_be_a_code(palpate_loop_restore(loop, Handles::any(have.states, input), error));
    palpate_state* state = nullptr;
    must_be_a_code(palpate_loop_save(loop, &state, error));
    if (state && have.states.size() < kMostHandles)
        have.states.push_back(state);
    else
        palpate_state_free(state);
}

void call(Handles& have, Input& input) {
    auto error = sized<palpate_error>(input);
    palpate_error* const said = input.choice(8) == 0 ? nullptr : &error;
    const unsigned kind = input.choice(16);
    if (kind == 0 || have.scenes.empty()) return make_scene(have, input, said);
    if (kind == 1 || have.loops.empty()) return make_loop(have, input, said);
    palpate_loop* const loop = Handles::any(have.loops, input);
    if (kind == 2) return save_or_restore(have, loop, input, said);
    if (kind == 3) return set(loop, input);
    if (kind == 4) return ask(loop, input);
    if (kind == 5)
        return must_be_a_code(palpate_loop_adopt(loop, Handles::any(have.scenes, input), said));
    if (kind == 6) {
        double force[3] = {0.0, 0.0, 0.0};
        return must_be_a_code(palpate_loop_release(loop, force));
    }
    for (int frames = 0; frames < 4; ++frames)
        make_frame(loop, input);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Input input(data, size);
    Handles have;
    for (int calls = 0; calls < kMostCalls && !input.is_empty(); ++calls)
        call(have, input);
    return 0;
}
