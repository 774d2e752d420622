// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/drivers/haptic_device.h>

namespace palpate::internal {

// Messages of Haply's Inverse Service in the format of its port 10001, versions 3.1 to 3.5
// (docs/devices.md, "Haply Inverse3", names the sources). Its frame is right-handed: x to the
// user's right, y forward, away from the user, z up; m, m/s, N.

/// A vector of the service's frame in the device frame: x towards the user, y right, z up. [any]
Vec3 from_service(const Vec3& vector) noexcept;
/// A vector of the device frame in the service's.                                         [any]
Vec3 to_service(const Vec3& vector) noexcept;
/// A turn likewise: of a handle whose axes are named as those of the frame.               [any]
Quaternion from_service(const Quaternion& turn) noexcept;

/// Under which key a force is sent.
enum class ForceKey : std::uint8_t {
    values, ///< 3.1 and what followed it
    vector  ///< 3.5
};

/// An Inverse3, Inverse3x or Minverse, as the first message of a service has it.
struct ServiceDevice {
    std::string id;            ///< as commands name it
    std::string type;          ///< "inverse3", "minverse"; empty: not told
    std::string handedness;    ///< "right" or "left": how it is built; empty: not told
    bool is_calibrated = true; ///< false: its positions are of no use yet
    bool has_power = true;     ///< false: it cannot push
    bool is_in_use = false;    ///< another program sends it forces, which are added to ours
};

/// The first message of a service: all that it has.
struct ServiceInventory {
    std::vector<ServiceDevice> devices;
    std::vector<std::string> grips; ///< VerseGrips, with and without a wire
    ForceKey key = ForceKey::values;
};

/// Nothing where the text is no such message. Devices whose id is no id of 1 to 64 letters, digits,
/// '.', '_', ':' and '-' are left out.                                                  [setup]
std::optional<ServiceInventory> inventory_in(std::string_view text);

/// What a state message says of one device.
struct ServiceReading {
    /// Why there is no state in it.
    enum class Fault : std::uint8_t {
        none,
        unreadable,   ///< no JSON object with states of devices
        not_there,    ///< nothing of this device, or of two with its id
        out_of_range, ///< a number that is missing, not finite, or farther or faster than an arm;
                      ///< where no velocity is told, it is zero
        uncalibrated  ///< the service says that positions are of no use
    };
    Fault fault = Fault::none;
    DeviceState state;              ///< device frame, without time, trial and freshness
    std::optional<Vec3> force_echo; ///< what the service says it applies, N, device frame
};

constexpr double kFarthestReach_m = 1.0;      ///< of a position in a state; the arm has 0.4 m
constexpr double kFastestReach_m_per_s = 50.; ///< of a velocity in a state

/// Reads a state of the device `id`, with the turn and the buttons of the grip `grip` where there
/// is one: a, b, c are bits 0, 1, 2. A grip that says nothing useful leaves the identity and no
/// button.                                                                              [setup]
ServiceReading reading_in(std::string_view text, std::string_view id, std::string_view grip);

/// What is sent once, before anything else: who we are, and that positions are to be in the
/// service's own frame. Empty: nothing, to versions that know no such settings.         [setup]
std::string greeting(const ServiceInventory& inventory, std::string_view id);
/// Asks for the first message once more.                                                [setup]
std::string inventory_request();
/// A force, N, device frame; one that is not finite is zero.                             [setup]
std::string force_command(std::string_view id, ForceKey key, const Vec3& force);

/// What a fault is, in words.                                                             [any]
const char* in_words(ServiceReading::Fault fault) noexcept;

} // namespace palpate::internal
