// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// The arm: a mass on a spring and a damper, drawn to where it intends to be; alike in all
/// directions. Orders of magnitude as Hajian & Howe 1997 (fingers) and Speich, Shao & Goldfarb 2005
/// (arm at a master device) fit them; people differ by factors of three.
struct ArmSettings {
    double mass_kg = 0.3;             ///< that moves with the hand, (0, 10]
    double damping_n_s_per_m = 5.0;   ///< [0, 1e3]
    double stiffness_n_per_m = 300.0; ///< towards the intent, (0, 1e5]
    double tremor_m = 100e-6; ///< rms of the free arm's in each axis, 8-12 Hz, [0, 0.01]; 15-250 um
                              ///< with a held instrument (PMC3032442)
    double reaction_s = 0.15; ///< from an intent to the arm, [0, 1]
};

/// How the hand holds the handle, the play of the mechanism included: a spring and a damper
/// between device and arm, per axis.
struct GripSettings {
    double stiffness_n_per_m = 2000.0; ///< [0, 1e5]; 0 with damping 0: let go. Pinch grips as in
                                       ///< Hasser & Cutkosky 2002
    double damping_n_s_per_m = 6.0;    ///< [0, 1e3]
    double backlash_m = 0.0; ///< way without force from one side to the other, [0, 0.01]; geared
                             ///< devices have 20-100 um
};

/// The device, as seen at its handle; alike in all directions. Defaults: a desktop arm with
/// capstans, as their data sheets say (45-100 g, 0.04-0.3 N, 20-60 um).
struct MechanismSettings {
    double mass_kg = 0.08;          ///< (0, 10]
    double damping_n_s_per_m = 0.3; ///< [0, 1e3]
    double friction_n = 0.06;       ///< Coulomb, [0, 10]
    double step_m = 30e-6;          ///< of the encoders, [0, 0.01]; 0: exact
    double force_n = 8.0;           ///< where the amplifiers saturate, (0, 1e3]
    double bandwidth_hz = 500.0;    ///< of the amplifiers, first order, (0, 1e5]
};

/// The way between device and computer. USB 2 at full speed: a millisecond each way, less a
/// frame's luck.
struct TransportSettings {
    double read_delay_s = 0.5e-3;  ///< age of a position when it is read, [0, 0.02]
    double write_delay_s = 0.5e-3; ///< from a write until the amplifiers have it, [0, 0.02]
    double jitter_s = 0.1e-3;      ///< added to either, uniform in [0, jitter], [0, 0.005]
};

/// A simulated hand with its device: its parts, its rate, and how long it lasts.
struct HandSettings {
    ArmSettings arm;             ///< the arm that moves the hand towards where it wants to be
    GripSettings grip;           ///< the fingers between the hand's mass and the handle
    MechanismSettings mechanism; ///< the device's moving parts, encoders and motors
    TransportSettings transport; ///< between computer and device, both ways
    double rate_hz = 1000.0;     ///< frames, [50, 20000]
    double duration_s = std::numeric_limits<double>::infinity(); ///< then there is no state any
                                                                 ///< more, > 0
    std::uint64_t seed = 1;                                      ///< of tremor and jitter
};

/// Where the arm wants to be at a time, s, m, device frame: linear between two, constant outside.
struct HandIntent {
    double time_s = 0.0; ///< since the first read(), s, not decreasing
    Vec3 position{0.0};  ///< of the probe, m, device frame
};

/// Intents that come from `distance_m` in front of a point, press `depth_m` behind it along
/// `outward` (of length 1) within `approach_s`, hold for `hold_s`, and go back.            [any]
std::vector<HandIntent> press_into(const Vec3& point, const Vec3& outward, double distance_m,
                                   double depth_m, double approach_s, double hold_s);

/// A device in a hand, both simulated: two bodies per axis, stepped by at most 20 us from frame to
/// frame. Its time is its own: one period with each read(), so that it can run as fast as it is
/// computed. Same settings and same forces: the same bits.
class SimulatedHand final : public HapticDevice {
public:
    /// Begins at rest at the first intent. Throws std::invalid_argument that names a setting that
    /// is out of range, or intents that are none, not finite or not in order of time.  [setup]
    SimulatedHand(const HandSettings& settings, std::vector<HandIntent> intents);
    ~SimulatedHand() override;

    /// Damping, step, force and delay as they are: what a good driver declares.         [setup]
    DeviceProperties properties() const override;

    /// No force from now on, also not of those under way.                               [setup]
    void stop() noexcept override;

    /// A period later: the position as it was a delay ago, rounded.                      [loop]
    bool read(DeviceState& state) noexcept override;
    /// What is not finite is not sent.                                                   [loop]
    void write(const Vec3& force) noexcept override;

    /// What no computer sees: the truth at the last read.
    struct Truth {
        double time_s = 0.0;       ///< of the device's own clock, s
        Vec3 handle{0.0};          ///< m
        Vec3 handle_velocity{0.0}; ///< m/s
        Vec3 hand{0.0};            ///< the arm's mass, m
        Vec3 motor_force{0.0};     ///< behind amplifiers and saturation, N
        double motor_work_j = 0.0; ///< of the motors on the handle, since the start, J
        double hand_work_j = 0.0;  ///< of the handle on the hand, since the start, J
    };
    Truth truth() const noexcept; ///< [loop]

private:
    struct Inside;
    std::unique_ptr<Inside> inside_;
};

} // namespace palpate
