// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/validation.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/engine/internal/field_check.h>

namespace palpate {
namespace {

using internal::FieldCheck;

/// Does a check; what it complains of gets file and line in front, as far as there are any.
template <class Check>
void at(const SceneDescription& scene, int line, const Check& check) {
    try {
        check();
    } catch (const std::invalid_argument& error) {
        const std::string file = scene.file.empty() && line > 0 ? "scene" : scene.file.string();
        if (file.empty()) throw;
        throw std::invalid_argument(line > 0 ? fmt::format("{}:{}: {}", file, line, error.what())
                                             : fmt::format("{}: {}", file, error.what()));
    }
}

void check_coupling(const CouplingDescription& coupling) {
    const FieldCheck check("coupling");
    check.number("stiffness_n_per_m", coupling.stiffness_n_per_m, internal::kCouplingStiffness);
    check.number("damping_n_s_per_m", coupling.damping_n_s_per_m, internal::kCouplingDamping);
}

void check_limits(const LimitsDescription& limits) {
    const FieldCheck check("limits");
    check.number("force_n", limits.force_n, internal::kForceLimitN);
    check.number("slew_n_per_s", limits.slew_n_per_s, internal::kSlewLimit);
}

void check_hand(const HandDescription& hand) {
    const FieldCheck check("device.hand");
    check.integer("seed", hand.seed, internal::kHandSeed);
    check.number("stiffness_n_per_m", hand.stiffness_n_per_m, internal::kArmStiffness);
    check.number("tremor_um", hand.tremor_um, internal::kTremorUm);
    check.number("damping_n_s_per_m", hand.damping_n_s_per_m, internal::kDeviceDamping);
    check.number("step_um", hand.step_um, internal::kEncoderStepUm);
    check.number("delay_ms", hand.delay_ms, internal::kDelayMs);
}

void check_placement(const DevicePlacementSettings& placement) {
    const FieldCheck check("device.placement");
    check.choice("right", placement.right, PatientSide::inferior);
    check.choice("up", placement.up, PatientSide::inferior);
    check.triple("origin_m", placement.origin_m, internal::scaled(internal::kPlaceMm, 1e-3));
    check.number("scale", placement.scale,
                 {DevicePlacement::kSmallestScale, DevicePlacement::kLargestScale});
    if (along_one_line(placement.right, placement.up))
        check.fail("up", "is along right", "let up be a direction across right");
}

void check_device(const SceneDescription& scene, const DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    const FieldCheck check("device");
    check.choice("kind", device.kind, Kind::hid);
    check.choice("from", device.from, PatientSide::inferior);
    if ((device.kind == Kind::path || device.kind == Kind::recording) && device.file.empty())
        check.fail("file", "is empty", "name what is to be played");
    if (device.kind == Kind::hid && device.address.empty())
        check.fail("address", "names no device", "give what `palpate devices` lists");
    if (!device.surface.empty()) check.name("surface", device.surface, scene.surfaces, "surfaces");
    check.number("speed_m_per_s", device.speed_m_per_s, internal::kOrbitSpeed);
    check.number("depth_min_mm", device.depth_min_mm, internal::kOrbitDepthMm);
    check.number("depth_max_mm", device.depth_max_mm,
                 {device.depth_min_mm, internal::kOrbitDepthMm.high});
    check.number("depth_mm", device.depth_mm, internal::kPressDepthMm);
    const bool presses = device.kind == Kind::hand && device.file.empty();
    check.number("duration_s", device.duration_s,
                 presses ? internal::kPressDurationS : internal::kOrbitDurationS);
    if (device.turns != 0) check.integer("turns", device.turns, internal::kOrbitTurns);
    check.number("press_mm", device.press_mm, internal::kTourDepthMm);
    check.number("spacing_mm", device.spacing_mm, internal::kTourSpacingMm);
    check_hand(device.hand);
    check_placement(device.placement);
}

/// Whether two workspaces share a place at least.
bool overlap(const EffectDescription& a, const EffectDescription& b) {
    if (a.radius_m > 0.0 && b.radius_m > 0.0)
        return glm::distance(a.center_m, b.center_m) <= a.radius_m + b.radius_m;
    if (b.radius_m > 0.0) return overlap(b, a);
    if (a.radius_m > 0.0)
        return glm::distance(a.center_m, glm::clamp(a.center_m, b.box_m.lower, b.box_m.upper)) <=
               a.radius_m;
    return !Box{glm::max(a.box_m.lower, b.box_m.lower), glm::min(a.box_m.upper, b.box_m.upper)}
                .empty();
}

/// An effect as messages about several of them name it.
std::string where(const SceneDescription& scene, std::size_t effect) {
    return scene.effects[effect].line > 0 ? "in [[effect]]" : fmt::format("in effects[{}]", effect);
}

/// Refuses a workspace that never yields and cannot hold the proxy beside one of `holding`.
void check_overlap(const SceneDescription& scene, const std::vector<std::size_t>& holding,
                   std::size_t i) {
    for (const std::size_t other : holding) {
        if (overlap(scene.effects[other], scene.effects[i])) continue;
        const int line = scene.effects[other].line;
        throw std::invalid_argument(fmt::format(
            "the workspace {} has no place in common with that {}, and neither yields; move or "
            "enlarge one of them, or give one a finite strength_n",
            where(scene, i), line > 0 ? fmt::format("of line {}", line) : where(scene, other)));
    }
}

/// What is sampled less than twice a period is another tone.
void check_tone(const SceneDescription& scene, std::size_t i) {
    const double frequency_hz = scene.effects[i].vibration.frequency_hz;
    if (scene.effects[i].kind != EffectKind::vibration || 2.0 * frequency_hz < scene.loop.rate_hz)
        return;
    throw std::invalid_argument(fmt::format(
        "frequency_hz = {} {} is not below half of [loop] rate_hz = {}; lower it, or raise the "
        "rate",
        frequency_hz, where(scene, i), scene.loop.rate_hz));
}

void check_effects(const SceneDescription& scene) {
    std::vector<std::size_t> holding; // workspaces that never yield
    for (std::size_t i = 0; i < scene.effects.size(); ++i) {
        const EffectDescription& effect = scene.effects[i];
        at(scene, effect.line, [&] {
            internal::check_effect(FieldCheck(fmt::format("effects[{}]", i)), scene, effect);
            check_tone(scene, i);
            if (effect.kind != EffectKind::workspace ||
                std::isfinite(effect.guide_settings.strength_n))
                return;
            check_overlap(scene, holding, i);
            holding.push_back(i);
        });
    }
}

} // namespace

void validate(const LoopDescription& loop) {
    const FieldCheck check("loop");
    check.number("rate_hz", loop.rate_hz, internal::kRateHz);
    check.choice("method", loop.method, SteppingMethod::adaptive);
    const bool reads_clock = loop.method == SteppingMethod::paper;
    check.number("budget_us", loop.budget_us,
                 internal::budget_range_us(reads_clock ? loop.rate_hz : internal::kRateHz.low));
    check.integer("sub_steps", loop.sub_steps, internal::kSubSteps);
    check.number("tolerance_um", loop.tolerance_um, internal::kToleranceUm);
    check.integer("evaluation_cap", loop.evaluation_cap, internal::kEvaluationCap);
}

void validate(const DeviceProperties& device) {
    const FieldCheck check(device.name.empty() ? "device" : "device \"" + device.name + "\"");
    check.number("force_n", device.force_n, kNotNegative);
    check.number("stiffness_n_per_m", device.stiffness_n_per_m, kPositiveOrInfinite);
    check.number("damping_n_s_per_m", device.damping_n_s_per_m, kNotNegative);
    check.number("position_step_m", device.position_step_m, kNotNegative);
    check.number("delay_s", device.delay_s, kNotNegative);
    check.choice("velocity_source", device.velocity_source, VelocitySource::device);
    if (device.workspace_m.empty()) return;
    check.triple("workspace_m.lower", device.workspace_m.lower, kFiniteRange);
    check.triple("workspace_m.upper", device.workspace_m.upper, kFiniteRange);
}

void validate(const SceneDescription& scene) {
    at(scene, 0, [&] {
        check_coupling(scene.coupling);
        check_limits(scene.limits);
        validate(scene.loop);
    });
    for (const auto& [name, volume] : scene.volumes)
        at(scene, volume.line,
           [&] { check_volume(FieldCheck(fmt::format("volumes[\"{}\"]", name)), volume); });
    for (const auto& [name, material] : scene.materials)
        at(scene, material.strength_line,
           [&] { check_material(FieldCheck(fmt::format("materials[\"{}\"]", name)), material); });
    for (const auto& [name, surface] : scene.surfaces)
        at(scene, surface.line, [&] {
            check_surface(FieldCheck(fmt::format("surfaces[\"{}\"]", name)), scene, surface);
        });
    check_effects(scene);
    at(scene, scene.device.line, [&] { check_device(scene, scene.device); });
}

} // namespace palpate
