// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <palpate/geometry/vec.h>

namespace palpate {

/// How motors B and C move the handle.
enum class WoodenLinkage : std::uint8_t {
    parallelogram, ///< C's angle is absolute: WoodenHaptics, AluHaptics, Vintage, Polhem v1
    polhem         ///< a closed chain of six links: Polhem v2 and v3
};

/// Who sets the counters to WoodenModel::home_counts.
enum class WoodenZeroing : std::uint8_t {
    host,  ///< counters begin anywhere: the first report is that of the home pose
    device ///< the device keeps them; its button or our calibration sets them in the home pose
};

/// One build of the WoodenHaptics family: data, as builders measure them; signs included. Indices
/// 0, 1, 2 are the motors and bodies A, B, C; 3, 4, 5 the gimbal's joints D, E, F.
struct WoodenModel {
    std::string name;                                     ///< as device tables and messages say it
    WoodenLinkage linkage = WoodenLinkage::parallelogram; ///< decides which kinematics apply
    WoodenZeroing zeroing = WoodenZeroing::host;          ///< decides who has to know the home pose
    std::array<double, 3> capstan_diameter_m{};           ///< > 0
    std::array<double, 3> body_diameter_m{};              ///< > 0
    std::array<double, 3> body_length_m{};            ///< > 0; polhem: B and C are links 1 and 5
    std::array<double, 4> link_length_m{};            ///< polhem: links 0, 2, 3, 4, > 0
    Vec3 workspace_origin_m{0.0};                     ///< of the device frame, from the base's axis
    double workspace_radius_m = 0.1;                  ///< > 0
    std::array<double, 3> torque_constant_nm_per_a{}; ///< > 0
    std::array<double, 6> counts_per_turn{};          ///< A to C > 0; D to F 0: no gimbal
    std::array<double, 6> home_counts{};              ///< of the home pose
    std::array<double, 6> count_direction{1, 1, 1, 1, 1, 1}; ///< 1 or -1: counter to count
    std::array<double, 6> joint_sign{1, 1, 1, 1, 1, 1}; ///< 1 or -1: count to angle, torque to A
    double force_n = 5.0;                               ///< > 0, what the frame bears
    double stiffness_n_per_m = 1000.0;                  ///< > 0, what it renders stably at 1 kHz
};

/// Throws std::invalid_argument that names what is not as the lines above say.           [setup]
void check(const WoodenModel& model);

/// Where the handle is. Device frame: x towards the user, y right, z up; m.
struct WoodenPose {
    Vec3 position{0.0}; ///< of the handle, from the origin of the device frame
    Quaternion orientation{1.0, 0.0, 0.0, 0.0}; ///< handle to device; identity without a gimbal
    Mat3 jacobian{0.0}; ///< column i: change of position with joint angle i, m/rad
};

/// Joint angles, rad, of six counts: sign 2 pi count / counts per turn, for A to C times capstan
/// over body; 0 where there is no encoder.                                                 [any]
std::array<double, 6> wooden_angles(const WoodenModel& model,
                                    const std::array<double, 6>& counts) noexcept;

/// The pose that belongs to six joint angles, in closed form; nothing where the links do not reach
/// each other or a number is not finite.                                                   [any]
std::optional<WoodenPose> wooden_pose(const WoodenModel& model,
                                      const std::array<double, 6>& angles) noexcept;

/// Motor currents, mA, that put the force (N, device frame) on the handle: tau = J^T F through
/// capstan and motor. Not limited; not finite where the force is not.                      [any]
Vec3 wooden_currents_ma(const WoodenModel& model, const Mat3& jacobian, const Vec3& force) noexcept;

/// What a motor's drive holds for longer than four seconds, mA, less one.
constexpr double kWoodenCurrentLimitMa = 1999.0;

/// Whole mA within the limit, all three shortened alike so that the force keeps its direction;
/// zero when one of them is not finite.                                                    [any]
std::array<std::int16_t, 3> limited_wooden_currents(const Vec3& currents_ma) noexcept;

/// The longest force, N, that the motors hold in every direction at the home pose within that
/// limit, no longer than WoodenModel::force_n.                                             [any]
double wooden_home_force_n(const WoodenModel& model) noexcept;

/// How far the handle gets along an axis, m, at the home pose, while no counter changes: what
/// positions are rounded to. At most 0.01.                                                 [any]
double wooden_home_step_m(const WoodenModel& model) noexcept;

} // namespace palpate
