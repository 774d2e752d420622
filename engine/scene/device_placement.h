// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// A direction of the patient.
enum class PatientSide : std::uint8_t { left, right, anterior, posterior, superior, inferior };

/// As scenes spell them, in the enumeration's order.
inline constexpr std::array<std::string_view, 6> kPatientSideNames{
    "patient_left",      "patient_right",    "patient_anterior",
    "patient_posterior", "patient_superior", "patient_inferior"};

/// Whether two directions are the same or opposite.                                     [any]
constexpr bool along_one_line(PatientSide a, PatientSide b) noexcept {
    return static_cast<int>(a) / 2 == static_cast<int>(b) / 2;
}

/// The way to that side, scene frame (LPS), of length 1.                                [any]
Vec3 direction_of(PatientSide side) noexcept;

/// How a device stands to the patient. The frame of a device is x towards its user, y to the
/// user's right, z up. Without settings of its own a device looks at a patient who stands opposite.
struct DevicePlacementSettings {
    PatientSide right = PatientSide::left;  ///< what the device's right is to the patient
    PatientSide up = PatientSide::superior; ///< and its up: across `right`
    Vec3 origin_m{0.0};                     ///< where the device's origin is, scene frame, m
    double scale = 1.0;                     ///< m of the scene per m of the device, [0.01, 100]
};

/// Device frame to scene frame and back:
///     p_scene = origin + s R p_device,   v_scene = s R v_device,   f_device = R^T f_scene.
/// R turns axes onto axes. The force keeps its newtons, so that every limit of it means the same on
/// both sides. The hand then feels a stiffness of s k, and gets 1/s of the energy that the scene
/// gives: what is passive in the scene is passive in the hand.
class DevicePlacement {
public:
    /// The smallest s, no unit.
    static constexpr double kSmallestScale = 0.01;
    static constexpr double kLargestScale = 100.0; ///< the largest s

    /// The frame of paths, orbits and recordings, which is the scene's: bits stay as they are.
    /// [setup]
    DevicePlacement() = default;
    /// Throws std::invalid_argument where up is along right, the scale is out of range or the
    /// origin is no place. [setup]
    explicit DevicePlacement(const DevicePlacementSettings& settings);

    /// A state in the scene's frame; numbers that are none stay none.                    [loop]
    DeviceState to_scene(const DeviceState& state) const noexcept;
    /// A force of the scene, N, in the device's frame.                                   [loop]
    Vec3 to_device(const Vec3& force) const noexcept;

    /// A place of the scene in the device's frame, m: to_scene() leads back to it.      [setup]
    Vec3 place_in_device(const Vec3& place) const;

    /// What a device declares, as the scene meets it: stiffness and damping / s, lengths s, and
    /// s itself.                                                                        [setup]
    DeviceProperties to_scene(const DeviceProperties& properties) const;

    /// "device right = patient left, up = patient superior, towards the user = ...".    [setup]
    std::string in_words() const;

private:
    bool is_identity_ = true;
    DevicePlacementSettings settings_;
    Mat3 rotation_{1.0};                  ///< R
    Quaternion turn_{1.0, 0.0, 0.0, 0.0}; ///< the same
};

} // namespace palpate
