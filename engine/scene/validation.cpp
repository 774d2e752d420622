// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/validation.h>

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/internal/device_addresses.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/internal/field_check.h>
#include <palpate/engine/scene/soft_surfaces.h>

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

void check_hand(const std::string& device, const HandDescription& hand) {
    const FieldCheck check(device + ".hand");
    check.integer("seed", hand.seed, internal::kHandSeed);
    check.number("stiffness_n_per_m", hand.stiffness_n_per_m, internal::kArmStiffness);
    check.number("tremor_um", hand.tremor_um, internal::kTremorUm);
    check.number("damping_n_s_per_m", hand.damping_n_s_per_m, internal::kDeviceDamping);
    check.number("step_um", hand.step_um, internal::kEncoderStepUm);
    check.number("delay_ms", hand.delay_ms, internal::kDelayMs);
}

void check_placement(const std::string& device, const DevicePlacementSettings& placement) {
    const FieldCheck check(device + ".placement");
    check.choice("right", placement.right, PatientSide::inferior);
    check.choice("up", placement.up, PatientSide::inferior);
    check.triple("origin_m", placement.origin_m, internal::scaled(internal::kPlaceMm, 1e-3));
    check.number("scale", placement.scale,
                 {DevicePlacement::kSmallestScale, DevicePlacement::kLargestScale});
    if (along_one_line(placement.right, placement.up))
        check.fail("up", "is along right", "let up be a direction across right");
}

/// `field`: as messages name it.
void check_device(const SceneDescription& scene, const std::string& field,
                  const DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    const FieldCheck check(field);
    check.choice("kind", device.kind, Kind::igtl);
    check.choice("from", device.from, PatientSide::inferior);
    if ((device.kind == Kind::path || device.kind == Kind::recording) && device.file.empty())
        check.fail("file", "is empty", "name what is to be played");
    if (device.kind == Kind::hid && device.address.empty())
        check.fail("address", "names no device", "give what `palpate devices` lists");
    if (device.kind == Kind::plugin && device.address.empty())
        check.fail("address", "names no file", "give the plug-in's shared library");
    internal::check_address(device); // throws what it has to say
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
    check_hand(field, device.hand);
    check_placement(field, device.placement);
}

void check_name(const FieldCheck& check, const DeviceDescription& hand) {
    if (!is_hand_name(hand.name))
        check.fail("name", fmt::format("is \"{}\", which cannot name a folder", hand.name),
                   fmt::format("take at most {} letters, digits, _ and -, and no - in front",
                               kMostHandLetters));
}

/// A name that no hand before has, and hardware that no hand before holds.
void check_apart(const FieldCheck& check, const DeviceDescription& hand,
                 std::span<const DeviceDescription> before) {
    using Kind = DeviceDescription::Kind;
    check_name(check, hand);
    if (hand.kind == Kind::none)
        check.fail("kind", "is none", "say what moves this hand, or leave it out");
    for (const DeviceDescription& other : before) {
        if (other.name == hand.name)
            check.fail("name", fmt::format("\"{}\" is another hand's, too", hand.name),
                       "give each hand a name of its own");
        const bool is_held = hand.kind == Kind::hid || hand.kind == Kind::inverse3;
        if (is_held && hand.kind == other.kind && hand.address == other.address)
            check.fail("address",
                       fmt::format("{}{} is in hand {} already",
                                   hand.kind == Kind::hid ? "hid:" : "inverse3", hand.address,
                                   other.name),
                       "give each hand a device of its own, as `palpate devices` lists them");
    }
}

void check_hands(const SceneDescription& scene) {
    const std::span<const DeviceDescription> hands = scene.hands;
    at(scene, hands.size() > kMostHands ? hands[kMostHands].line : 0, [&] {
        if (!hands.empty() && scene.device.kind != DeviceDescription::Kind::none)
            throw std::invalid_argument(
                "device and hands are both given; name the device as one more of the hands");
        if (hands.size() > kMostHands)
            throw std::invalid_argument(
                fmt::format("hands: are {}, and each takes a processor; give at most {}",
                            hands.size(), kMostHands));
    });
    for (std::size_t i = 0; i < hands.size(); ++i)
        at(scene, hands[i].line, [&] {
            const std::string field = fmt::format("hands[{}]", i);
            check_apart(FieldCheck(field), hands[i], hands.first(i));
            check_device(scene, field, hands[i]);
        });
}

void check_effects(const SceneDescription& scene) {
    for (std::size_t i = 0; i < scene.effects.size(); ++i)
        at(scene, scene.effects[i].line, [&] { internal::check_effect(scene, i); });
    for (std::size_t i = 0; i < scene.effects.size(); ++i)
        at(scene, scene.effects[i].line, [&] { internal::check_beside_soft(scene, i); });
}

/// What has no name cannot be named by an effect, nor in a message.
template <class Map>
void require_names(const char* what, const Map& map) {
    if (map.contains(""))
        throw std::invalid_argument(std::string(what) + "[\"\"]: has no name; give it one");
}

} // namespace

void validate(const LoopDescription& loop) {
    const FieldCheck check("loop");
    check.number("rate_hz", loop.rate_hz, internal::kRateHz);
    check.choice("method", loop.method, SteppingMethod::adaptive);
    check.number("budget_us", budget_of(loop), internal::budget_range_us(loop.rate_hz));
    check.integer("sub_steps", loop.sub_steps, internal::kSubSteps);
    check.number("tolerance_um", loop.tolerance_um, internal::kToleranceUm);
    check.integer("evaluation_cap", loop.evaluation_cap, internal::kEvaluationCap);
}

void validate(const DeviceProperties& device) {
    const FieldCheck check(device.name.empty() ? "device" : "device \"" + device.name + "\"");
    check.number("force_n", device.force_n, kNotNegative);
    check.number("stiffness_n_per_m", device.stiffness_n_per_m, kPositiveOrInfinite);
    check.number("damping_n_s_per_m", device.damping_n_s_per_m, kNotNegative);
    check.number("position_step_m", device.position_step_m, internal::kPositionStepM);
    check.number("delay_s", device.delay_s, internal::kDeviceDelayS);
    check.number("scale", device.scale,
                 {DevicePlacement::kSmallestScale, DevicePlacement::kLargestScale});
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
    require_names("volumes", scene.volumes);
    require_names("materials", scene.materials);
    require_names("surfaces", scene.surfaces);
    for (const auto& [name, volume] : scene.volumes)
        at(scene, volume.line, [&name = name, &volume = volume] {
            check_volume(FieldCheck(fmt::format("volumes[\"{}\"]", name)), volume);
        });
    for (const auto& [name, material] : scene.materials)
        at(scene, material.strength_line, [&name = name, &material = material] {
            check_material(FieldCheck(fmt::format("materials[\"{}\"]", name)), material);
        });
    for (const auto& [name, surface] : scene.surfaces)
        at(scene, surface.line, [&scene, &name = name, &surface = surface] {
            check_surface(FieldCheck(fmt::format("surfaces[\"{}\"]", name)), scene, surface);
        });
    check_effects(scene);
    at(scene, scene.device.line, [&] {
        if (!scene.device.name.empty()) check_name(FieldCheck("device"), scene.device);
        check_device(scene, "device", scene.device);
    });
    check_hands(scene);
}

} // namespace palpate
