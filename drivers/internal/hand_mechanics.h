// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/drivers/simulated_hand.h>

namespace palpate::internal {

/// Where energy went since the start, J.
struct HandLedger {
    double motors = 0.0;   ///< in: of the motors on the handle
    double muscles = 0.0;  ///< in: of intents and tremor
    double to_hand = 0.0;  ///< of the grip on the hand: inside
    double viscous = 0.0;  ///< out: dampers of device, grip, arm
    double friction = 0.0; ///< out: of the device
};

/// Device and arm as two masses per axis: the device with damping and Coulomb friction, a grip with
/// play between them, the arm's spring and damper to the intent.
///
/// Springs and dampers by the midpoint rule, which gives and takes no energy:
///   m (v' - v)/dt = F(x + dt u/2, u),  u = (v + v')/2,  x' = x + dt u
/// Friction is an impulse afterwards, which at most stops the device.
class HandMechanics {
public:
    HandMechanics(const HandSettings& settings, const Vec3& start) noexcept;

    /// A step of dt s with the motors' force on the handle and the muscles' on the hand, N, and the
    /// arm's spring towards `intent`, m.                                                 [loop]
    void step(double dt, const Vec3& motor, const Vec3& tremor, const Vec3& intent) noexcept;

    const Vec3& handle() const noexcept { return handle_; }
    const Vec3& handle_velocity() const noexcept { return handle_velocity_; }
    const Vec3& hand() const noexcept { return hand_; }
    const HandLedger& ledger() const noexcept { return ledger_; }
    double energy_j() const noexcept; ///< kinetic, and in the springs, J

private:
    double stretch_of(int axis) const noexcept;
    double spring_energy() const noexcept;

    ArmSettings arm_;
    GripSettings grip_;
    MechanismSettings mechanism_;
    Vec3 intent_;
    Vec3 handle_, hand_;
    Vec3 handle_velocity_{0.0}, hand_velocity_{0.0};
    HandLedger ledger_;
};

} // namespace palpate::internal
