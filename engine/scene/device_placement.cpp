// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/device_placement.h>

#include <stdexcept>

#include <fmt/format.h>

namespace palpate {
namespace {

std::string words_of(const Vec3& direction) {
    for (std::size_t i = 0; i < kPatientSideNames.size(); ++i) {
        if (glm::dot(direction_of(static_cast<PatientSide>(i)), direction) < 0.5) continue;
        std::string words(kPatientSideNames[i]);
        words[words.find('_')] = ' ';
        return words;
    }
    return "nothing of the patient";
}

} // namespace

Vec3 direction_of(PatientSide side) noexcept {
    switch (side) {
    case PatientSide::left:
        return {1, 0, 0};
    case PatientSide::right:
        return {-1, 0, 0};
    case PatientSide::anterior:
        return {0, -1, 0};
    case PatientSide::posterior:
        return {0, 1, 0};
    case PatientSide::superior:
        return {0, 0, 1};
    case PatientSide::inferior:
        break;
    }
    return {0, 0, -1};
}

DevicePlacement::DevicePlacement(const DevicePlacementSettings& settings)
    : is_identity_(false), settings_(settings) {
    const Vec3 right = direction_of(settings.right);
    const Vec3 up = direction_of(settings.up);
    if (along_one_line(settings.right, settings.up))
        throw std::invalid_argument(fmt::format(
            "the device's up is \"{}\" and its right \"{}\", which is the same line; turn one of "
            "them",
            kPatientSideNames[static_cast<std::size_t>(settings.up)],
            kPatientSideNames[static_cast<std::size_t>(settings.right)]));
    if (!(settings.scale >= kSmallestScale && settings.scale <= kLargestScale))
        throw std::invalid_argument(fmt::format("the device's scale {} must be in [{}, {}]",
                                                settings.scale, kSmallestScale, kLargestScale));
    if (!is_finite(settings.origin_m))
        throw std::invalid_argument("the device's origin must be three numbers");
    rotation_ = Mat3(glm::cross(right, up), right, up);
    turn_ = glm::normalize(glm::quat_cast(rotation_));
}

DeviceState DevicePlacement::to_scene(const DeviceState& state) const noexcept {
    if (is_identity_) return state;
    DeviceState placed = state;
    placed.position = settings_.origin_m + settings_.scale * (rotation_ * state.position);
    placed.velocity = settings_.scale * (rotation_ * state.velocity);
    placed.orientation = turn_ * state.orientation;
    return placed;
}

Vec3 DevicePlacement::to_device(const Vec3& force) const noexcept {
    return is_identity_ ? force : glm::transpose(rotation_) * force;
}

Vec3 DevicePlacement::place_in_device(const Vec3& place) const {
    if (is_identity_) return place;
    return glm::transpose(rotation_) * ((place - settings_.origin_m) / settings_.scale);
}

DeviceProperties DevicePlacement::to_scene(const DeviceProperties& properties) const {
    DeviceProperties placed = properties;
    if (is_identity_) return placed;
    placed.stiffness_n_per_m = properties.stiffness_n_per_m / settings_.scale; // scale >= 0.01
    placed.damping_n_s_per_m = properties.damping_n_s_per_m / settings_.scale;
    placed.position_step_m = properties.position_step_m * settings_.scale;
    placed.scale = properties.scale * settings_.scale;
    placed.workspace_m = Box{};
    if (properties.workspace_m.empty()) return placed;
    // R turns axes onto axes: two corners stay corners.
    for (const Vec3& corner : {properties.workspace_m.lower, properties.workspace_m.upper})
        placed.workspace_m.add(settings_.origin_m + settings_.scale * (rotation_ * corner));
    return placed;
}

std::string DevicePlacement::in_words() const {
    if (is_identity_) return "device frame = scene frame";
    const Vec3 origin_mm = 1e3 * settings_.origin_m;
    return fmt::format("device right = {}, up = {}, towards the user = {}; its origin at "
                       "[{:.6g}, {:.6g}, {:.6g}] mm; 1 mm of the device = {:.6g} mm of the scene",
                       words_of(rotation_[1]), words_of(rotation_[2]), words_of(rotation_[0]),
                       origin_mm.x, origin_mm.y, origin_mm.z, settings_.scale);
}

} // namespace palpate
