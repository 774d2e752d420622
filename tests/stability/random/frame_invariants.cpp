// SPDX-License-Identifier: Apache-2.0
// What a report alone has to keep: numbers, limits, the coupling's law, flags, work.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/stepping/subdivision.h>

#include "tests/stability/random/invariants.h"

namespace palpate::stability {
namespace {

constexpr double kRounding = 1e-9;
constexpr double kFarthest_m = 1e6; // docs/safety.md: a position beyond it is a fault

bool is_a_place(const Vec3& p) { return is_finite(p) && glm::length(p) <= kFarthest_m; }

class Finite final : public Invariant {
public:
    const char* name() const override { return "finite"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        ++checks_;
        bool good = is_finite(seen.report.proxy) && is_finite(seen.report.force) &&
                    std::isfinite(seen.report.residual_m);
        for (const Vec3& corner : seen.path)
            good = good && is_finite(corner);
        if (good) return std::nullopt;
        return "a proxy, a force or a residual that is no number";
    }
};

bool has_moving_gain(const Watched& watched, std::size_t effect) {
    return std::any_of(watched.events.begin(), watched.events.end(), [&](const FileEvent& event) {
        return event.event.kind == CaseEvent::Kind::gain && event.effect == effect;
    });
}

/// The path that all other checks go by is the proxy's: it begins where the last frame left the
/// proxy, or where bodies have carried it to, and ends where the report says. Of a soft surface
/// that is alone it is the front's. A frame without a place leaves the proxy where it was.
class Path final : public Invariant {
public:
    const char* name() const override { return "path"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        const FrameReport& report = seen.report;
        const std::optional<Vec3> before = std::exchange(end_, std::nullopt);
        const Vec3 proxy_before = std::exchange(proxy_, report.proxy);
        if (seen.path.empty()) {
            if (seen.frame > 0 && report.proxy != proxy_before)
                return "no path, and the proxy moved";
            if (before) end_ = before;
            return std::nullopt;
        }
        ++checks_;
        const Vec3& end = seen.path.back();
        if (end != report.proxy && end != report.front)
            return fmt::format("the path ends {} m beside the proxy",
                               glm::length(end - report.proxy));
        end_ = end;
        const Vec3& begin = seen.path.front();
        if (seen.begins_trial) {
            if (!seen.bodies_moved && begin != seen.state.position)
                return "a trial's path does not begin at the probe";
        } else if (before && begin != *before && !(report.flags & kBodyMoved)) {
            return fmt::format("the path begins {} m beside where the last one ended",
                               glm::length(begin - *before));
        }
        return std::nullopt;
    }

private:
    std::optional<Vec3> end_;
    Vec3 proxy_{0.0};
};

/// The length of the force, and how fast it may change.
class Limits final : public Invariant {
public:
    explicit Limits(const SceneDescription& scene)
        : limits_(scene.limits), period_s_(1.0 / scene.loop.rate_hz) {}
    const char* name() const override { return "limits"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        ++checks_;
        const Vec3 force = seen.report.force;
        const double change = glm::length(force - before_);
        before_ = force;
        if (glm::length(force) > limits_.force_n) // not even in its last bit
            return fmt::format("{} N, more than {}", glm::length(force), limits_.force_n);
        if (change > limits_.slew_n_per_s * period_s_ + kRounding * limits_.force_n)
            return fmt::format("the force changes by {} N in a frame", change);
        return std::nullopt;
    }

private:
    LimitsDescription limits_;
    double period_s_;
    Vec3 before_{0.0};
};

/// f = k (x - p) - m g, then its length, then its change: where neither damping nor a vibration is
/// added.
class Coupling final : public Invariant {
public:
    explicit Coupling(const Watched& watched)
        : k_(watched.scene.description().coupling.stiffness_n_per_m),
          limits_(watched.scene.description().limits),
          longest_step_n_(limits_.slew_n_per_s / watched.scene.description().loop.rate_hz) {
        const SceneDescription& scene = watched.scene.description();
        law_is_known_ = scene.coupling.damping_n_s_per_m == 0.0;
        for (std::size_t i = 0; i < scene.effects.size(); ++i) {
            if (palpate::name(scene.effects[i]) == "vibration") law_is_known_ = false;
            const auto* handle =
                std::get_if<effects::GravityCompensation>(&scene.effects[i].settings);
            if (!handle) continue;
            if (has_moving_gain(watched, i)) law_is_known_ = false;
            weight_n_ += handle->mass_kg * 9.80665 * glm::normalize(handle->down);
        }
    }
    const char* name() const override { return "coupling"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        const Vec3 before = before_;
        before_ = seen.report.force;
        if (!law_is_known_ || !is_a_place(seen.state.position)) return std::nullopt;
        ++checks_;
        Vec3 wanted = k_ * (seen.report.proxy - seen.state.position) - weight_n_;
        // The spring of two places far away: as exact as their difference.
        const double rounding_n =
            kRounding * limits_.force_n + 4e-16 * k_ * glm::length(seen.state.position);
        const double length = glm::length(wanted);
        const bool long_one = length > limits_.force_n;
        if (long_one) wanted *= limits_.force_n / length;
        const double change = glm::length(wanted - before);
        const bool sudden = change > longest_step_n_;
        if (sudden) wanted = before + (longest_step_n_ / change) * (wanted - before);
        if (glm::length(wanted - seen.report.force) > rounding_n)
            return fmt::format("the force is not the spring's: off by {} N",
                               glm::length(wanted - seen.report.force));
        const bool near_length = std::abs(length - limits_.force_n) < 10 * rounding_n;
        if (!near_length && long_one != ((seen.report.flags & kForceClamped) != 0))
            return fmt::format("force_clamped is {}, and the spring has {} N", !long_one, length);
        const bool near_change = std::abs(change - longest_step_n_) < 10 * rounding_n;
        if (!near_change && sudden != ((seen.report.flags & kForceSlewed) != 0))
            return fmt::format("force_slewed is {}, and the change is {} N", !sudden, change);
        return std::nullopt;
    }

private:
    double k_;
    LimitsDescription limits_;
    double longest_step_n_;
    bool law_is_known_ = false;
    Vec3 weight_n_{0.0}; // of the device's handles
    Vec3 before_{0.0};
};

/// Each flag of a frame has its reason in what was done.
class Flags final : public Invariant {
public:
    const char* name() const override { return "flags"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        ++checks_;
        const std::uint32_t flags = seen.report.flags;
        const auto has = [&](FrameFlag flag) { return (flags & flag) != 0; };
        if (has(kProbeNotFinite) == is_a_place(seen.state.position))
            return "probe_not_finite does not say what the probe is";
        // Nobody here has motors, is late, makes forces of his own or adopts a scene.
        constexpr std::uint32_t kNever = kForceNotFinite | kDeviceStale | kProbeJumped |
                                         kWaitsForSmallForce | kRampsIn | kEnergyBounded |
                                         kEnergyExceeded | kSoftened | kSceneAdopted;
        if (flags & kNever) return fmt::format("a flag that nothing explains: {:#x}", flags);
        if (has(kInsideAtStart) && !seen.begins_trial) return "inside_at_start in mid-trial";
        if (has(kLiveGain) && !seen.gains_moved) return "live_gain, and no gain was moved";
        if ((has(kBodyMoved) || has(kBodyHeldBack)) && !seen.bodies_moved)
            return "a body moved that nobody moves";
        return std::nullopt;
    }
};

/// Evaluations: what the method makes, one for each edge of a mesh up to 64, and new approaches:
/// a surface may open and begin to slip once in a frame. And what solvers spend: the budget of a
/// frame, and its last evaluation beyond it. A frame says that it was cut short only where it was.
class Work final : public Invariant {
public:
    explicit Work(const Scene& scene) {
        const LoopDescription& loop = scene.description().loop;
        const int own = loop.method == SteppingMethod::single  ? 1
                        : loop.method == SteppingMethod::fixed ? loop.sub_steps
                        : loop.method == SteppingMethod::paper ? Stepping::kMostEvaluations
                                                               : loop.evaluation_cap;
        most_ = own + 64 + 2 * static_cast<int>(scene.surfaces().size()) + 1;
        for (const auto& [name, surface] : scene.description().surfaces)
            is_soft_ = is_soft_ || is_soft(scene.description(), surface);
        budget_ = Subdivision::kWorkOfSolvers + 3L * Subdivision::kWorkOfEvaluation * own;
        counts_steps_ = loop.method != SteppingMethod::adaptive;
    }
    const char* name() const override { return "work"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        ++checks_;
        if (seen.report.evaluations > static_cast<std::uint32_t>(most_))
            return fmt::format("{} evaluations, at most {}", seen.report.evaluations, most_);
        if (is_soft_) return std::nullopt; // each front has a budget of its own
        // A method that counts its steps ends before its last one only where its work is spent, or
        // where it has gone round more corners than a frame may; each of its steps may be one more.
        const std::uint32_t corners = Subdivision::kMostLegs + seen.report.evaluations / 2;
        if (counts_steps_ && (seen.report.flags & kEvaluationCap) &&
            seen.report.sub_steps < corners && static_cast<long>(seen.report.work) < budget_)
            return fmt::format("evaluation_cap after {} evaluations and {} sub-steps",
                               seen.report.evaluations, seen.report.sub_steps);
        constexpr long kPasses = CoulombFriction::kLeastPasses + 16; // 16: to end a step
        constexpr long kLast =
            Subdivision::kWorkOfEvaluation + kPasses * static_cast<long>(PrimitiveSet::kCapacity);
        if (static_cast<long>(seen.report.work) <= budget_ + kLast) return std::nullopt;
        return fmt::format("solvers and evaluations spent {}, at most {}", seen.report.work,
                           budget_ + kLast);
    }

private:
    int most_ = 0;
    bool is_soft_ = false, counts_steps_ = false;
    long budget_ = 0;
};

/// Where surfaces are all that is felt, none of them soft, a frame of method adaptive that follows
/// the probe and touches none ends there, or says why not. (Other methods may spend their steps on
/// what lies on the way, and so may a cap of a few.)
class Follows final : public Invariant {
public:
    explicit Follows(const Watched& watched) {
        const SceneDescription& scene = watched.scene.description();
        looks_ = scene.loop.method == SteppingMethod::adaptive && scene.loop.evaluation_cap >= 8 &&
                 std::all_of(scene.effects.begin(), scene.effects.end(),
                             [](const EffectDescription& effect) {
                                 return palpate::name(effect) == "surface";
                             });
        for (const auto& [name, surface] : scene.surfaces)
            looks_ = looks_ && !is_soft(scene, surface);
        most_m_ = 1e-6 * scene.loop.tolerance_um;
    }
    const char* name() const override { return "follows"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        constexpr std::uint32_t kOfTheForce = kForceClamped | kForceSlewed | kLiveGain;
        const FrameReport& report = seen.report;
        const Vec3& probe = seen.state.position;
        if ((report.flags & kProbeNotFinite) != 0) return std::nullopt; // before it was elsewhere
        const bool is_held = std::exchange(probe_, probe) == probe;     // it may have come to rest
        if (!looks_ || is_held || report.contacts != 0 || report.surfaces_felt != 0 ||
            (report.flags & ~kOfTheForce) != 0)
            return std::nullopt;
        ++checks_;
        const double way_m = glm::length(report.proxy - probe);
        if (way_m <= most_m_ + 4e-16 * glm::length(probe)) return std::nullopt;
        return fmt::format("nothing holds it, and it stays {} m behind the probe", way_m);
    }

private:
    bool looks_ = false;
    double most_m_ = 0.0;
    Vec3 probe_{0.0};
};

/// A frame that begins within all workspaces that never yield ends within them. Where it has to be
/// taken back, surfaces may be in its way: where there are any, only what came to its end.
class Workspaces final : public Invariant {
public:
    explicit Workspaces(const Watched& watched)
        : ends_(watched.scene.description().loop.method == SteppingMethod::adaptive),
          surfaces_(!watched.scene.surfaces().empty()) {
        const SceneDescription& scene = watched.scene.description();
        for (std::size_t i = 0; i < scene.effects.size(); ++i) {
            const auto* settings = std::get_if<effects::Workspace>(&scene.effects[i].settings);
            if (settings && std::isinf(settings->strength_n) && settings->volume.empty() &&
                scene.effects[i].moves_with.empty() && !has_moving_gain(watched, i))
                hard_.push_back(*settings);
        }
    }
    const char* name() const override { return "workspaces"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        if (hard_.empty() || seen.path.empty() || outside_m(seen.path.front()) > kOutside_m)
            return std::nullopt;
        constexpr std::uint32_t kCutShort = kEvaluationCap | kStalled | kSolverCap;
        if (surfaces_ && (!ends_ || (seen.report.flags & kCutShort) != 0)) return std::nullopt;
        ++checks_;
        const double outside = outside_m(seen.path.back());
        if (outside <= kOutside_m) return std::nullopt;
        return fmt::format("it has left a workspace by {} m", outside);
    }

private:
    static constexpr double kOutside_m = 1.001e-9; // a picometre for rounding

    /// Of the one that is left farthest; less than 0 in all of them.
    double outside_m(const Vec3& p) const {
        double most = -std::numeric_limits<double>::infinity();
        for (const effects::Workspace& one : hard_) {
            const Vec3 beyond = glm::max(one.box_m.lower - p, p - one.box_m.upper);
            const double outside = one.radius_m > 0.0 ? glm::length(p - one.center_m) - one.radius_m
                                                      : glm::length(glm::max(beyond, Vec3(0.0))) +
                                                            std::min(0.0, largest(beyond));
            most = std::max(most, outside);
        }
        return most;
    }
    static double largest(const Vec3& v) { return std::max({v.x, v.y, v.z}); }

    bool ends_; // its frames come to an end, or say that they do not
    bool surfaces_;
    std::vector<effects::Workspace> hard_;
};

} // namespace

std::vector<HardSurface> hard_surfaces(const Watched& watched) {
    const SceneDescription& scene = watched.scene.description();
    std::vector<HardSurface> hard;
    for (std::size_t i = 0; i < watched.scene.surfaces().size(); ++i) {
        const SceneSurface& surface = watched.scene.surfaces()[i];
        if (std::isfinite(surface.level.strength_n)) continue;
        bool moved = false; // its gain
        for (std::size_t effect = 0; effect < scene.effects.size(); ++effect)
            moved = moved || (surface_of(scene.effects[effect]) == surface.name &&
                              has_moving_gain(watched, effect));
        const PlaceOn place(watched.scene, surface);
        if (!moved && place.has_path()) hard.push_back({i, &surface, place});
    }
    return hard;
}

bool is_pure(const Watched& watched) {
    for (const FileEvent& event : watched.events)
        if (event.event.kind != CaseEvent::Kind::detour) return false;
    return watched.scene.surfaces().size() == 1 && hard_surfaces(watched).size() == 1 &&
           watched.scene.description().effects.size() == 1;
}

void add_path_invariant(std::vector<std::unique_ptr<Invariant>>& to) {
    to.push_back(std::make_unique<Path>());
}

void add_frame_invariants(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to) {
    const SceneDescription& scene = watched.scene.description();
    to.push_back(std::make_unique<Finite>());
    to.push_back(std::make_unique<Limits>(scene));
    to.push_back(std::make_unique<Coupling>(watched));
    to.push_back(std::make_unique<Flags>());
    to.push_back(std::make_unique<Work>(watched.scene));
    to.push_back(std::make_unique<Follows>(watched));
    to.push_back(std::make_unique<Workspaces>(watched));
}

} // namespace palpate::stability
