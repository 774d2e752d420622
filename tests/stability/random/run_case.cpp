// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/run_case.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#ifdef PALPATE_WITH_CGAL
#include <palpate/geometry/isosurface.h>
#endif

#include "tests/stability/random/invariants.h"
#include "tests/stability/random/path_maker.h"

#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"

namespace palpate::stability {
namespace {

std::shared_ptr<const Scene> scene_of(const std::filesystem::path& folder) {
    SceneResources resources{.files = scene_files()};
#ifdef PALPATE_WITH_CGAL
    resources.extract = extract_isosurface;
#endif
    return std::make_shared<const Scene>(read_scene(folder / "scene.toml"), resources);
}

std::vector<DeviceState> states_of(const std::vector<CaseStep>& steps, double rate_hz) {
    ProbeSteps rows(rate_hz);
    std::vector<DeviceState> states;
    states.reserve(steps.size());
    for (std::size_t i = 0; i < steps.size(); ++i) {
        if (i > 0 && steps[i].begins_trial) rows.begin_trial();
        states.push_back(rows.next(steps[i].probe));
    }
    return states;
}

/// The first frame from which on the probe is held, where it is held long enough at the end.
std::optional<int> hold_of(const std::vector<CaseStep>& steps) {
    std::size_t from = steps.size();
    while (from > 1 && !steps[from - 1].begins_trial &&
           steps[from - 1].probe == steps[from - 2].probe)
        --from;
    if (steps.size() - from < kHeldFrames) return std::nullopt;
    return static_cast<int>(from);
}

/// A level without edges, how far from it a probe may be, and how exact a frame ends.
struct SmoothLevel {
    double deepest_m = 0.0, tolerance_m = 0.0;
};

std::optional<SmoothLevel> smooth_level(const Watched& watched) {
    if (!is_pure(watched)) return std::nullopt;
    const SceneDescription& scene = watched.scene.description();
    const SceneSurface& surface = watched.scene.surfaces().front();
    const SurfaceDescription& said = scene.surfaces.at(surface.name);
    if (surface.contact != ContactKind::volume || said.moves ||
        scene.loop.method != SteppingMethod::adaptive || scene.loop.evaluation_cap < 8)
        return std::nullopt;
    const VolumeDescription& volume = scene.volumes.at(said.volume);
    const double tolerance_m = 1e-6 * scene.loop.tolerance_um;
    const auto mm = [&](const char* key) { return 1e-3 * volume.parameters.at(key); };
    if (volume.analytic == "sphere_cavity" || volume.analytic == "solid_sphere")
        return SmoothLevel{0.2 * mm("radius_mm"), tolerance_m};
    if (volume.analytic == "slab") return SmoothLevel{0.2 * mm("thickness_mm"), tolerance_m};
    if (volume.analytic == "torus") return SmoothLevel{0.2 * mm("tube_mm"), tolerance_m};
    return std::nullopt;
}

/// Both loops of a case and all that looks at them.
class CaseRun {
public:
    CaseRun(const std::filesystem::path& folder, const RunOptions& options, Outcome& outcome)
        : options_(options), outcome_(outcome), scene_(scene_of(folder)),
          events_(read_events(folder / "events.csv")), steps_(read_steps(folder / "path.csv")),
          states_(states_of(steps_, scene_->description().loop.rate_hz)), first_(scene_, clock_),
          twin_(scene_, twin_clock_), poses_(scene_->surfaces().size()),
          hold_(hold_of(steps_)), watched_{*scene_, events_}, smooth_(smooth_level(watched_)) {
        add_frame_invariants(watched_, invariants_);
        add_certificates(watched_, invariants_);
        add_mesh_invariants(watched_, invariants_);
        add_press_invariant(watched_, invariants_);
        for (const auto& [name, surface] : scene_->description().surfaces)
            has_damper_ = has_damper_ || surface.softness.damping > 0.0;
    }

    void run() {
        for (int frame = 0; frame < static_cast<int>(steps_.size()); ++frame) {
            make_events(frame);
            if (!go(frame)) break;
            if (hold_ && still_ >= kStillEnough) break;
        }
        for (const auto& invariant : invariants_)
            outcome_.checks[invariant->name()] += invariant->checks();
    }

private:
    static constexpr int kStillEnough = 60; // frames

    void fail(const char* invariant, int frame, std::string words) {
        outcome_.failure = Failure{invariant, frame, std::move(words)};
    }

    void make_events(int frame) {
        detour_ = false;
        for (; next_event_ < events_.size() && events_[next_event_].event.frame <= frame;
             ++next_event_) {
            const FileEvent& event = events_[next_event_];
            if (event.event.kind == CaseEvent::Kind::detour) detour_ = true;
            if (event.event.kind == CaseEvent::Kind::gain) {
                gains_moved_ = true;
                for (HapticLoop* loop : {&first_, &twin_})
                    loop->set_gain(event.effect, event.event.gain);
            }
            if (event.event.kind != CaseEvent::Kind::pose) continue;
            for (std::size_t i = 0; i < scene_->surfaces().size(); ++i)
                if (scene_->surfaces()[i].name == event.surface) {
                    bodies_moved_ = true;
                    for (HapticLoop* loop : {&first_, &twin_})
                        loop->set_pose(i, event.event.pose);
                }
        }
    }

    /// One frame; false where something failed.
    bool go(int frame) {
        const auto at = static_cast<std::size_t>(frame);
        const DeviceState& state = states_[at];
        FrameReport report = first_.frame(state);
        std::vector<Vec3> path(first_.path().begin(), first_.path().end());
        ++outcome_.frames;
        outcome_.touched += report.surfaces_felt != 0 ? 1 : 0;
        outcome_.flags |= report.flags;
        const FrameReport own = report;
        if (options_.spoil_first) options_.spoil_first(report, path);
        for (std::size_t i = 0; i < poses_.size(); ++i)
            poses_[i] = first_.pose(i);
        // A trial begins with the first place that is one.
        begins_ = begins_ || frame == 0 || state.trial != states_[at - 1].trial;
        const bool placed = (own.flags & kProbeNotFinite) == 0;
        const SeenFrame seen{frame, state,  begins_ && placed, report,
                             path,  poses_, gains_moved_,      bodies_moved_};
        if (placed) begins_ = false;
        for (const auto& invariant : invariants_)
            if (auto wrong = invariant->check(seen)) {
                fail(invariant->name(), frame, std::move(*wrong));
                return false;
            }
        return go_with_twin(frame, own) && goes_smoothly(frame, own) && rests(frame, report);
    }

    bool go_with_twin(int frame, FrameReport own) {
        const DeviceState& state = states_[static_cast<std::size_t>(frame)];
        if (detour_) {
            const LoopState kept = twin_.save();
            DeviceState elsewhere = state;
            for (int i = 1; i <= 12; ++i) {
                elsewhere.position += Vec3(1e-3 * i, -2e-3, 1e-4);
                elsewhere.time_s += 1e-3;
                twin_.frame(elsewhere);
            }
            twin_.restore(kept);
        }
        FrameReport twins = twin_.frame(state, first_.steps_left());
        if (options_.spoil_twin) options_.spoil_twin(twins);
        ++outcome_.checks["same bits"];
        own.estimate_us = twins.estimate_us = 0.0; // of the clock, which is another one
        const std::string different = test::difference(own, twins);
        if (different.empty()) return true;
        fail("same bits", frame, "the twin differs in " + different);
        return false;
    }

    /// Every 16th frame in contact: the same frame again, with the probe a little beside.
    bool goes_smoothly(int frame, const FrameReport& report) {
        constexpr double kBeside_m = 1e-6;
        constexpr std::uint32_t kUnfinished =
            kEvaluationCap | kStalled | kSolverCap | kCalmed | kProbeNotFinite;
        if (!smooth_ || frame % 16 != 15) return true;
        const DeviceState& state = states_[static_cast<std::size_t>(frame)];
        const double depth_m = glm::length(place_on_surface(report) - state.position);
        const LoopState kept = twin_.save();
        FrameReport once = twin_.frame(state);
        twin_.restore(kept);
        DeviceState beside = state;
        beside.position += kBeside_m * Vec3(0.6, -0.48, 0.64);
        const FrameReport other = twin_.frame(beside);
        twin_.restore(kept);
        if (options_.spoil_beside) options_.spoil_beside(once);
        if (depth_m > smooth_->deepest_m || ((once.flags | other.flags) & kUnfinished) ||
            once.contacts != 1 || other.contacts != 1)
            return true;
        ++outcome_.checks["smooth"];
        // The foot of a probe at 0.2 radii behind a level turns at most 1 / 0.8 as far.
        const double most_m = 1.5 * kBeside_m + 2.0 * smooth_->tolerance_m;
        const double way_m = glm::length(once.proxy - other.proxy);
        if (way_m <= most_m) return true;
        fail("smooth", frame, fmt::format("1 um beside, the proxy is {} m beside", way_m));
        return false;
    }

    bool rests(int frame, const FrameReport& report) {
        const bool moved = !(report.proxy == proxy_);
        const double way_m = glm::length(report.proxy - proxy_);
        proxy_ = report.proxy;
        if (!hold_ || frame < *hold_) return true;
        still_ = moved ? 0 : still_ + 1;
        constexpr std::uint32_t kSaysWhy =
            kEvaluationCap | kStalled | kSolverCap | kCalmed | kPrimitivesFull;
        constexpr double kCreep_m = 1e-10; // what is no movement where friction holds (numerics 6)
        // Damped tissue creeps: each way is shorter than the one before.
        const bool fades = has_damper_ && way_m < std::exchange(way_before_m_, way_m);
        const bool explained = (report.flags & kSaysWhy) != 0 || way_m < kCreep_m || fades;
        explained_ = moved && !explained ? 0 : explained_ + 1;
        ++outcome_.checks["rest"];
        if (frame + 1 < static_cast<int>(steps_.size()) || still_ >= kStillEnough) return true;
        if (explained_ >= kStillEnough) {
            outcome_.restless = true;
            return true;
        }
        fail("rest", frame,
             fmt::format("held for {} frames, the proxy moved {} frames ago", frame - *hold_ + 1,
                         still_));
        return false;
    }

    const RunOptions& options_;
    Outcome& outcome_;
    std::shared_ptr<const Scene> scene_;
    std::vector<FileEvent> events_;
    std::vector<CaseStep> steps_;
    std::vector<DeviceState> states_;
    test::ScriptedClock clock_{7.0}, twin_clock_{23.0};
    HapticLoop first_, twin_;
    std::vector<RigidPose> poses_;
    std::optional<int> hold_;
    Watched watched_;
    std::optional<SmoothLevel> smooth_;
    std::vector<std::unique_ptr<Invariant>> invariants_;
    std::size_t next_event_ = 0;
    bool gains_moved_ = false, bodies_moved_ = false, detour_ = false, begins_ = false;
    int still_ = 0;     // frames in a row without a bit that moves
    int explained_ = 0; // the same, or it creeps, or a flag says why it moves
    bool has_damper_ = false;
    double way_before_m_ = 0.0;
    Vec3 proxy_{0.0};
};

} // namespace

Outcome run_case(const std::filesystem::path& folder, const RunOptions& options) {
    Outcome outcome;
    const auto phase = [&](const char* name) {
        if (options.phase) options.phase(name);
    };
    std::optional<CaseRun> run;
    phase("set-up");
    try {
        run.emplace(folder, options, outcome);
    } catch (const std::exception& error) {
        outcome.refused = error.what();
        return outcome;
    }
    phase("frames");
    run->run();
    return outcome;
}

} // namespace palpate::stability
