// SPDX-License-Identifier: Apache-2.0
// Palpate and the methods of `palpate study` as entries to the open benchmark:
//   open_palpate METHOD:CONTACT | BASELINE  TRACK ANSWER.csv
// enter_palpate.py runs it. A mesh is felt with CONTACT `mesh`, a formula with `volume`: no other
// contact applies, as no track has a volume with a mesh beside it.
#include <exception>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/study/baselines.h>
#include <palpate/engine/truth/felt_level.h>

#include "bench/open/entry.h"

namespace palpate {
namespace {

/// What a track lets one feel, as a scene in its folder. The spring is the track's; limits never
/// reach it. Empty: this contact does not apply.
std::string scene_text(const entry_track& track, const std::string& method,
                       const std::string& contact) {
    std::ostringstream text;
    text.precision(std::numeric_limits<double>::max_digits10);
    const bool has_mesh = track.mesh.triangles > 0;
    if (contact != (has_mesh ? "mesh" : "volume")) return {};
    if (has_mesh) {
        text << "[surface.body]\nmesh = \"mesh.obj\"\nmesh_unit = \"mm\"\nmesh_frame = \"LPS\"\n";
    } else {
        text << "[volume.body]\nanalytic = \"" << track.shape << "\"\n"
             << "radius_mm = " << track.radius_mm << "\n";
        if (track.amplitude_mm > 0.0)
            text << "amplitude_mm = " << track.amplitude_mm << "\n"
                 << "wavelength_mm = " << track.wavelength_mm << "\n";
        text << "[surface.body]\nvolume = \"body\"\n";
    }
    text << "contact = \"" << contact << "\"\n[[effect]]\ntype = \"surface\"\nsurface = \"body\"\n"
         << "[coupling]\nstiffness_n_per_m = " << ENTRY_STIFFNESS << "\n"
         << "[limits]\nforce_n = 1000\nslew_n_per_s = 10000000\n"
         << "[loop]\nmethod = \"" << method << "\"\nbudget_us = 100\n";
    return text.str();
}

std::shared_ptr<const Scene> make_scene(const std::string& text, const std::string& folder) {
    return std::make_shared<const Scene>(parse_scene(text, folder + "/scene.toml"),
                                         SceneResources{.files = scene_files()});
}

/// One of the two, with the clock that a loop reads.
struct Engine {
    SteadyClock clock;
    std::optional<HapticLoop> loop;
    std::unique_ptr<Baseline> baseline;
    DeviceState input;
};

Vec3 vec_of(const double* v) { return {v[0], v[1], v[2]}; }

void begin(void* engine, const double* probe) {
    auto& own = *static_cast<Engine*>(engine);
    ++own.input.trial;
    if (own.baseline) own.baseline->restart(vec_of(probe));
}

void frame(void* engine, const double* probe, double* proxy, double* force) {
    auto& own = *static_cast<Engine*>(engine);
    const Vec3 position = vec_of(probe);
    Vec3 end, felt;
    if (own.loop) {
        own.input.time_s += 1e-3;
        own.input.position = position;
        const FrameReport report = own.loop->frame(own.input);
        end = report.proxy;
        felt = report.force;
    } else {
        end = own.baseline->move(position).proxy;
        felt = ENTRY_STIFFNESS * (end - position);
    }
    for (int axis = 0; axis < 3; ++axis) {
        proxy[axis] = end[axis];
        force[axis] = felt[axis];
    }
}

std::optional<BaselineKind> baseline_of(const std::string& what) {
    for (const BaselineKind kind : kBaselines)
        if (name(kind) == what) return kind;
    return {};
}

int enter(const std::string& what, const std::string& folder, const std::string& answer) {
    const std::size_t colon = what.find(':');
    const std::optional<BaselineKind> kind = baseline_of(what);
    if (colon == std::string::npos && !kind) {
        std::cerr << "open_palpate: \"" << what << "\" is neither METHOD:CONTACT nor a baseline\n";
        return ENTRY_WRONG_INPUT;
    }
    entry_track track{};
    if (const int loaded = entry_load(folder.c_str(), &track); loaded != ENTRY_DONE) return loaded;
    const std::string text = kind
                                 ? scene_text(track, "adaptive", "volume")
                                 : scene_text(track, what.substr(0, colon), what.substr(colon + 1));
    if (text.empty()) return ENTRY_LEFT_OUT;
    const std::shared_ptr<const Scene> scene = make_scene(text, folder);
    Engine engine;
    if (kind) {
        const FeltLevel felt = felt_levels(*scene).at(0);
        engine.baseline = make_baseline(*kind, felt.field, felt.settings.level);
    } else {
        engine.loop.emplace(scene, engine.clock);
    }
    return entry_run(&track, answer.c_str(), &engine, begin, frame);
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    if (argc != 4) {
        std::cerr << "usage: open_palpate METHOD:CONTACT|BASELINE TRACK ANSWER.csv\n";
        return ENTRY_WRONG_INPUT;
    }
    try {
        return palpate::enter(argv[1], argv[2], argv[3]);
    } catch (const std::exception& error) {
        std::cerr << "open_palpate: " << error.what() << "\n";
        return ENTRY_FAILED;
    }
}
