// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/internal/device_addresses.h>
#include <palpate/engine/scene/internal/scene_tables.h>

namespace palpate::internal {
namespace {

using Kind = DeviceDescription::Kind;

// Spelled in the order of the enumeration, without `none`, and without `hid`, `plugin`, `inverse3`
// and `igtl`, which are followed by an address.
constexpr std::array<std::string_view, 5> kNames{"path", "orbit", "tour", "recording", "hand"};
constexpr std::string_view kHid = "hid:";
constexpr std::string_view kPlugin = "plugin:";
constexpr std::string_view kInverse3 = "inverse3";
constexpr std::string_view kIgtl = "igtl:";

/// Refuses all keys but these, and a hand's name.
void allow_only(const TomlTable& table, std::span<const std::string_view> keys,
                std::string_view context, const DeviceDescription& device) {
    std::vector<std::string_view> all(keys.begin(), keys.end());
    if (!device.name.empty()) all.insert(all.begin(), "name");
    table.allow_only(all, context);
}

void read_path(const TomlTable& table, const SceneDescription& scene, DeviceDescription& device) {
    constexpr std::array<std::string_view, 2> keys{"type", "file"};
    allow_only(table, keys, "with type = \"path\"", device);
    table.require("file", "name a CSV file with the columns t_s,x_m,y_m,z_m");
    device.file = existing_file(table, "file", scene.file);
}

void read_recorded(const TomlTable& table, const SceneDescription& scene,
                   DeviceDescription& device) {
    constexpr std::array<std::string_view, 3> keys{"type", "file", "hand"};
    allow_only(table, keys, "with type = \"recording\"", device);
    table.require("file", "name a recording.h5 of `palpate trace`");
    device.file = existing_file(table, "file", scene.file);
    if (table.has("hand")) device.recorded_hand = table.text("hand");
}

/// The surface that a generated path goes to, or all.
void read_surface(const TomlTable& table, const SceneDescription& scene,
                  DeviceDescription& device) {
    if (table.has("surface"))
        device.surface = name_in(table, "surface", scene.surfaces, "surfaces");
    else if (scene.surfaces.empty())
        table.fail(table.line(),
                   fmt::format("the {} {} has no surface to go {}", table.text("type"),
                               table.where(), device.kind == Kind::orbit ? "around" : "over"),
                   "add a [surface.NAME]");
}

void read_tour(const TomlTable& table, const SceneDescription& scene, DeviceDescription& device) {
    constexpr std::array<std::string_view, 5> keys{"type", "surface", "speed_m_per_s", "depth_mm",
                                                   "spacing_mm"};
    allow_only(table, keys, "with type = \"tour\"", device);
    read_surface(table, scene, device);
    device.speed_m_per_s = table.number("speed_m_per_s", kOrbitSpeed, device.speed_m_per_s);
    device.press_mm = table.number("depth_mm", kTourDepthMm, device.press_mm);
    device.spacing_mm = table.number("spacing_mm", kTourSpacingMm, device.spacing_mm);
}

void read_orbit(const TomlTable& table, const SceneDescription& scene, DeviceDescription& device) {
    constexpr std::array<std::string_view, 7> keys{
        "type", "surface", "speed_m_per_s", "depth_min_mm", "depth_max_mm", "duration_s", "turns"};
    allow_only(table, keys, "with type = \"orbit\"", device);
    read_surface(table, scene, device);
    device.speed_m_per_s = table.number("speed_m_per_s", kOrbitSpeed, device.speed_m_per_s);
    device.depth_min_mm = table.number("depth_min_mm", kOrbitDepthMm, device.depth_min_mm);
    // Without a depth_max_mm a deeper depth_min_mm takes it along.
    device.depth_max_mm = table.number("depth_max_mm", {device.depth_min_mm, kOrbitDepthMm.high},
                                       std::max(device.depth_min_mm, device.depth_max_mm));
    device.duration_s = table.number("duration_s", kOrbitDurationS, device.duration_s);
    device.turns = table.integer("turns", kOrbitTurns.low, kOrbitTurns.high, device.turns);
}

/// How something that a hand holds stands to the patient.
DevicePlacementSettings read_placement(const TomlTable& table) {
    DevicePlacementSettings placement;
    const auto side = [&](std::string_view key, PatientSide fallback) {
        return table.has(key) ? static_cast<PatientSide>(table.choice(key, kPatientSideNames))
                              : fallback;
    };
    placement.right = side("right", placement.right);
    placement.up = side("up", placement.up);
    if (table.has("origin_mm"))
        placement.origin_m = 1e-3 * read_triple(table, "origin_mm", " in mm", kPlaceMm);
    placement.scale =
        table.number("scale", {DevicePlacement::kSmallestScale, DevicePlacement::kLargestScale},
                     placement.scale);
    if (along_one_line(placement.right, placement.up))
        table.fail(table.line_of(table.has("up") ? "up" : "right"),
                   fmt::format("right is \"{}\" and up \"{}\" {}, which is one line",
                               kPatientSideNames[static_cast<std::size_t>(placement.right)],
                               kPatientSideNames[static_cast<std::size_t>(placement.up)],
                               table.where()),
                   "let up be a direction across right");
    return placement;
}

HandDescription read_hand(const TomlTable& table) {
    HandDescription hand;
    hand.seed = table.integer("seed", kHandSeed.low, kHandSeed.high, hand.seed);
    hand.stiffness_n_per_m =
        table.number("arm_stiffness_n_per_m", kArmStiffness, hand.stiffness_n_per_m);
    hand.tremor_um = table.number("tremor_um", kTremorUm, hand.tremor_um);
    hand.damping_n_s_per_m =
        table.number("damping_n_s_per_m", kDeviceDamping, hand.damping_n_s_per_m);
    hand.step_um = table.number("step_um", kEncoderStepUm, hand.step_um);
    hand.delay_ms = table.number("delay_ms", kDelayMs, hand.delay_ms);
    return hand;
}

/// A hand without a path presses into a surface.
void read_press(const TomlTable& table, const SceneDescription& scene, DeviceDescription& device) {
    if (table.has("surface"))
        device.surface = name_in(table, "surface", scene.surfaces, "surfaces");
    else if (scene.surfaces.empty())
        table.fail(table.line(),
                   fmt::format("the hand {} has no surface to press into", table.where()),
                   "add a [surface.NAME], or file = \"PATH.csv\": where the arm wants the probe");
    if (table.has("from"))
        device.from = static_cast<PatientSide>(table.choice("from", kPatientSideNames));
    device.depth_mm = table.number("depth_mm", kPressDepthMm, device.depth_mm);
    device.duration_s = table.number("duration_s", kPressDurationS, device.duration_s);
}

constexpr std::array<std::string_view, 5> kPlacedKeys{"type", "right", "up", "origin_mm", "scale"};
constexpr std::array<std::string_view, 16> kHandKeys{"type",
                                                     "surface",
                                                     "from",
                                                     "depth_mm",
                                                     "duration_s",
                                                     "right",
                                                     "up",
                                                     "origin_mm",
                                                     "scale",
                                                     "file",
                                                     "seed",
                                                     "step_um",
                                                     "delay_ms",
                                                     "tremor_um",
                                                     "damping_n_s_per_m",
                                                     "arm_stiffness_n_per_m"};

/// A simulated hand: along a file's path, or pressing on a surface.
void read_hand_device(const TomlTable& table, const SceneDescription& scene,
                      DeviceDescription& device) {
    allow_only(table, kHandKeys, "with type = \"hand\"", device);
    device.hand = read_hand(table);
    if (table.has("file")) {
        for (const std::string_view key : {"surface", "from", "depth_mm", "duration_s"})
            if (table.has(key))
                table.fail(table.line_of(key),
                           fmt::format("{} and file {} exclude each other", key, table.where()),
                           "keep one of them");
        device.file = existing_file(table, "file", scene.file);
    } else {
        read_press(table, scene, device);
    }
    device.placement = read_placement(table);
}

/// Says an address that cannot be with the line of its type.
void check_address_of(const TomlTable& table, const DeviceDescription& device) {
    try {
        check_address(device);
    } catch (const std::invalid_argument& error) {
        const std::string said = error.what();
        const std::size_t end = said.rfind("; ");
        table.fail(table.line_of("type"), said.substr(0, end), said.substr(end + 2));
    }
}

/// "wooden:arm.json" with its file's path, which is relative to the scene as all of its paths.
std::string with_model_of_scene(const std::string& address, const std::filesystem::path& folder) {
    const std::size_t colon = address.find(':');
    if (colon == std::string::npos || !address.ends_with(".json")) return address;
    return address.substr(0, colon + 1) + (folder / address.substr(colon + 1)).string();
}

/// Hardware, by its address or through a plug-in's file. Whether it is there, a run asks.
void read_attached(const TomlTable& table, const SceneDescription& scene, std::string_view start,
                   const std::string& address, DeviceDescription& device) {
    const bool is_hid = start == kHid;
    if (address.empty())
        table.fail(table.line_of("type"),
                   fmt::format("type = \"{}\" {} names no {}", start, table.where(),
                               is_hid ? "device" : "file"),
                   is_hid ? "add what `palpate devices` lists"
                          : "add the plug-in's shared library");
    device.kind = is_hid ? Kind::hid : Kind::plugin;
    const std::filesystem::path folder = scene.file.parent_path();
    device.address = is_hid ? with_model_of_scene(address, folder) : (folder / address).string();
    check_address_of(table, device);
    allow_only(table, kPlacedKeys, fmt::format("with type = \"{}...\"", start), device);
    device.placement = read_placement(table);
}

/// A Haply Inverse3; its address may be empty.
void read_inverse3(const TomlTable& table, const std::string& address, DeviceDescription& device) {
    device.kind = Kind::inverse3;
    device.address = address;
    check_address_of(table, device);
    allow_only(table, kPlacedKeys, "with type = \"inverse3...\"", device);
    device.placement = read_placement(table);
}

/// A tool that a program sends. Its poses are in the scene's frame, so it is not placed.
void read_tool(const TomlTable& table, const std::string& address, DeviceDescription& device) {
    device.kind = Kind::igtl;
    device.address = address;
    check_address_of(table, device);
    constexpr std::array<std::string_view, 1> kToolKeys{"type"};
    allow_only(table, kToolKeys, "with type = \"igtl:...\"", device);
}

/// All but the name.
void read_device(const TomlTable& table, const SceneDescription& scene, DeviceDescription& device) {
    table.require("type", fmt::format("give one of {}, hid:ADDRESS, plugin:FILE, inverse3[:ID], "
                                      "igtl:TRANSFORM",
                                      joined(kNames)));
    const std::string type = table.text("type");
    for (const std::string_view start : {kHid, kPlugin})
        if (type.starts_with(start))
            return read_attached(table, scene, start, type.substr(start.size()), device);
    if (type.starts_with(kInverse3))
        return read_inverse3(table, type.substr(kInverse3.size()), device);
    if (type.starts_with(kIgtl)) return read_tool(table, type.substr(kIgtl.size()), device);
    device.kind = static_cast<Kind>(1 + table.choice("type", kNames));
    switch (device.kind) {
    case Kind::path:
        return read_path(table, scene, device);
    case Kind::orbit:
        return read_orbit(table, scene, device);
    case Kind::tour:
        return read_tour(table, scene, device);
    case Kind::recording:
        return read_recorded(table, scene, device);
    default:
        return read_hand_device(table, scene, device);
    }
}

std::string read_name(const TomlTable& table, const std::vector<DeviceDescription>& others) {
    table.require("name", "give the hand a name, as \"left\"");
    std::string name = table.text("name");
    if (!is_hand_name(name))
        table.fail(table.line_of("name"),
                   fmt::format("name = \"{}\" {} cannot name a folder", name, table.where()),
                   fmt::format("take at most {} letters, digits, _ and -, and no - in front",
                               kMostHandLetters));
    for (const DeviceDescription& other : others)
        if (other.name == name)
            table.fail(table.line_of("name"),
                       fmt::format("name = \"{}\" {} is that of the hand in line {}", name,
                                   table.where(), other.line),
                       "give each hand a name of its own");
    return name;
}

} // namespace

DeviceDescription read_device_table(const TomlTable& table, const SceneDescription& scene) {
    DeviceDescription device;
    device.line = table.line();
    if (table.has("name"))
        table.fail(table.line_of("name"),
                   fmt::format("a name {}: it is the scene's one device", table.where()),
                   "leave it out, or begin each of several hands with [[device]]");
    read_device(table, scene, device);
    return device;
}

std::vector<DeviceDescription> read_hand_tables(const std::vector<TomlTable>& tables,
                                                const SceneDescription& scene) {
    std::vector<DeviceDescription> hands;
    for (const TomlTable& table : tables) {
        DeviceDescription hand;
        hand.line = table.line();
        hand.name = read_name(table, hands);
        read_device(table, scene, hand);
        hands.push_back(std::move(hand));
    }
    return hands;
}

} // namespace palpate::internal
