// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/run_case.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#ifdef PALPATE_WITH_CGAL
#include <palpate/geometry/isosurface.h>
#endif

#include "tests/stability/random/path_maker.h"
#include "tests/stability/random/spoiled_scene.h"
#include "tests/stability/random/watched_loop.h"

#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"

namespace palpate::stability {
namespace {

SceneResources resources_of_scenes() {
    SceneResources resources{.files = scene_files()};
#ifdef PALPATE_WITH_CGAL
    resources.extract = extract_isosurface;
#endif
    return resources;
}

std::shared_ptr<const Scene> scene_of(const std::filesystem::path& folder) {
    return std::make_shared<const Scene>(read_scene(folder / "scene.toml"), resources_of_scenes());
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

/// All loops of a case and all that looks at them. Of two hands the twin of the first is alone: it
/// has a scene of its own.
class CaseRun {
public:
    CaseRun(const std::filesystem::path& folder, const RunOptions& options, Outcome& outcome)
        : options_(options), outcome_(outcome), events_(read_events(folder / "events.csv")),
          scene_(scene_of(folder)), steps_(read_steps(folder / "path.csv")),
          first_(scene_, events_, steps_, 7.0), hold_(hold_of(steps_)),
          smooth_(smooth_level(first_.watched())) {
        const bool has_two = scene_->description().hands.size() == 2;
        if (has_two) {
            const std::vector<CaseStep> steps = read_steps(folder / "second.csv");
            if (steps.size() < steps_.size())
                throw std::runtime_error(fmt::format("second.csv has {} rows, path.csv {}",
                                                     steps.size(), steps_.size()));
            second_.emplace(scene_, events_, steps, 11.0);
        }
        twin_.emplace(has_two ? scene_of(folder) : scene_, twin_clock_);
    }

    void run() {
        ++outcome_.checks["code"];
        if (const auto taken =
                spoiled_value_that_is_taken(scene_->description(), resources_of_scenes())) {
            fail("code", 0, "made in code, the scene is taken with " + *taken);
            return;
        }
        for (int frame = 0; frame < first_.frames(); ++frame) {
            make_events(frame);
            if (!go(frame)) break;
            if (hold_ && still_ >= kStillEnough) break;
        }
        first_.count(outcome_);
        if (second_) second_->count(outcome_);
    }

private:
    static constexpr int kStillEnough = 60; // frames

    void fail(const char* invariant, int frame, std::string words) {
        outcome_.failure = Failure{invariant, frame, std::move(words)};
    }

    /// Both hands' loops and the twin.
    template <class Act>
    void in_each_loop(const Act& act) {
        act(first_.loop());
        act(*twin_);
        if (second_) act(second_->loop());
    }

    void make_events(int frame) {
        detour_ = false;
        for (; next_event_ < events_.size() && events_[next_event_].event.frame <= frame;
             ++next_event_) {
            const FileEvent& event = events_[next_event_];
            if (event.event.kind == CaseEvent::Kind::detour) detour_ = true;
            if (event.event.kind == CaseEvent::Kind::gain) {
                moved_.gains = true;
                in_each_loop(
                    [&](HapticLoop& loop) { loop.set_gain(event.effect, event.event.gain); });
            }
            if (event.event.kind != CaseEvent::Kind::pose) continue;
            for (std::size_t i = 0; i < scene_->surfaces().size(); ++i)
                if (scene_->surfaces()[i].name == event.surface) {
                    moved_.bodies = true;
                    in_each_loop([&](HapticLoop& loop) { loop.set_pose(i, event.event.pose); });
                }
        }
    }

    /// One frame of each hand; false where something failed.
    bool go(int frame) {
        if (second_) {
            RunOptions of_second;
            of_second.spoil_first = options_.spoil_second;
            if (auto failure = second_->go(frame, moved_, of_second)) {
                outcome_.failure = std::move(failure);
                outcome_.failure->words += ", of the second hand";
                return false;
            }
            ++outcome_.checks["second hand"];
        }
        outcome_.failure = first_.go(frame, moved_, options_);
        ++outcome_.frames;
        outcome_.touched += first_.own().surfaces_felt != 0 ? 1 : 0;
        outcome_.flags |= first_.own().flags;
        return !outcome_.failure && go_with_twin(frame, first_.own()) &&
               goes_smoothly(frame, first_.own()) && rests(frame, first_.seen());
    }

    bool go_with_twin(int frame, FrameReport own) {
        const DeviceState& state = first_.state(frame);
        if (detour_) {
            const LoopState kept = twin_->save();
            DeviceState elsewhere = state;
            for (int i = 1; i <= 12; ++i) {
                elsewhere.position += Vec3(1e-3 * i, -2e-3, 1e-4);
                elsewhere.time_s += 1e-3;
                twin_->frame(elsewhere);
            }
            twin_->restore(kept);
        }
        FrameReport twins = twin_->frame(state, first_.loop().steps_left());
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
        const DeviceState& state = first_.state(frame);
        const double depth_m = glm::length(place_on_surface(report) - state.position);
        const LoopState kept = twin_->save();
        FrameReport once = twin_->frame(state);
        twin_->restore(kept);
        DeviceState beside = state;
        beside.position += kBeside_m * Vec3(0.6, -0.48, 0.64);
        const FrameReport other = twin_->frame(beside);
        twin_->restore(kept);
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
        const Vec3 step = report.proxy - std::exchange(proxy_, report.proxy);
        const double way_m = glm::length(step);
        if (!hold_ || frame < *hold_) return true;
        still_ = moved ? 0 : still_ + 1;
        // A body that is still on its way pushes, and where no solution is found none is kept.
        constexpr std::uint32_t kSaysWhy = kBodyHeldBack | kBodyMoved | kSolverCap;
        // What hardly is a movement; or what goes on the same way, slowly as through a viscous
        // medium, or where frames say that they do not come to their end.
        constexpr double kHardly_m = 1e-9, kCreep_m = 1e-5;
        const bool unfinished = (report.flags & (kEvaluationCap | kStalled)) != 0;
        const bool creeps = moved && goes_on(step) && (way_m < kCreep_m || unfinished);
        // Damped tissue creeps, and so may what follows a stream: each way is shorter than the one
        // before.
        const bool fades = moved && way_m < std::exchange(way_before_m_, way_m);
        const bool explained =
            (report.flags & kSaysWhy) != 0 || way_m < kHardly_m || creeps || fades;
        explained_ = moved && !explained ? 0 : explained_ + 1;
        ++outcome_.checks["rest"];
        if (frame + 1 < first_.frames() || still_ >= kStillEnough) return true;
        if (explained_ >= kStillEnough || ((report.flags & kCalmed) != 0 && rests_later(frame))) {
            outcome_.restless = true;
            return true;
        }
        fail("rest", frame,
             fmt::format("held for {} frames, the proxy moved {} frames ago", frame - *hold_ + 1,
                         still_));
        return false;
    }

    /// Whether a step goes the way of the one before it. Or of these two one corrects the other:
    /// it is at most half as long, and within the loop's tolerance. Then the way of both goes on.
    bool goes_on(const Vec3& step) {
        const double tolerance_m = 1e-6 * scene_->description().loop.tolerance_um;
        const Vec3 before = std::exchange(step_before_, step), two = before + step;
        const Vec3 two_before = std::exchange(two_steps_before_, two);
        if (glm::dot(step, before) > 0.0) return true;
        const auto [shorter, longer] = std::minmax({glm::length(step), glm::length(before)});
        return shorter <= std::min(tolerance_m, 0.5 * longer) && glm::dot(two, two_before) > 0.0;
    }

    /// What is calmed may rest, go on and come back up to eight times, each time as long as a
    /// medium makes it.
    bool rests_later(int frame) {
        constexpr int kMostFrames = 20'000;
        DeviceState state = first_.state(frame);
        const double period_s = state.time_s - first_.state(frame - 1).time_s;
        Vec3 proxy = proxy_;
        int still = 0;
        for (int i = 0; i < kMostFrames && still < kStillEnough; ++i) {
            state.time_s += period_s;
            const Vec3 before = std::exchange(proxy, twin_->frame(state).proxy);
            still = proxy == before ? still + 1 : 0;
        }
        return still >= kStillEnough;
    }

    const RunOptions& options_;
    Outcome& outcome_;
    std::vector<FileEvent> events_;
    std::shared_ptr<const Scene> scene_;
    std::vector<CaseStep> steps_; // of the first hand
    WatchedLoop first_;
    std::optional<WatchedLoop> second_;
    test::ScriptedClock twin_clock_{23.0};
    std::optional<HapticLoop> twin_;
    std::optional<int> hold_;
    std::optional<SmoothLevel> smooth_;
    std::size_t next_event_ = 0;
    Moved moved_;
    bool detour_ = false;
    int still_ = 0;     // frames in a row without a bit that moves
    int explained_ = 0; // the same, or it creeps, or a flag says why it moves
    double way_before_m_ = 0.0;
    Vec3 step_before_{0.0}, two_steps_before_{0.0};
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
