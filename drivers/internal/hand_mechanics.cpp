// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/hand_mechanics.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {
namespace {

/// The velocity that is left of one after friction's impulse; it never turns round.
Vec3 after_friction(const Vec3& velocity, double impulse_m_per_s) noexcept {
    const double speed = glm::length(velocity);
    return speed > impulse_m_per_s ? velocity * (1.0 - impulse_m_per_s / speed) : Vec3{0.0};
}

} // namespace

HandMechanics::HandMechanics(const HandSettings& settings, const Vec3& start) noexcept
    : arm_(settings.arm), grip_(settings.grip), mechanism_(settings.mechanism), intent_(start),
      handle_(start), hand_(start) {}

double HandMechanics::stretch_of(int axis) const noexcept {
    // Between the sides of the play there is no force.
    const double apart = handle_[axis] - hand_[axis];
    const double play = 0.5 * grip_.backlash_m;
    return apart - std::clamp(apart, -play, play);
}

double HandMechanics::spring_energy() const noexcept {
    const Vec3 grip{stretch_of(0), stretch_of(1), stretch_of(2)};
    return 0.5 * grip_.stiffness_n_per_m * squared_length(grip) +
           0.5 * arm_.stiffness_n_per_m * squared_length(hand_ - intent_);
}

double HandMechanics::energy_j() const noexcept {
    return spring_energy() + 0.5 * mechanism_.mass_kg * squared_length(handle_velocity_) +
           0.5 * arm_.mass_kg * squared_length(hand_velocity_);
}

void HandMechanics::step(double dt, const Vec3& motor, const Vec3& tremor,
                         const Vec3& intent) noexcept {
    // An intent that moves stretches the arm's spring.
    const double before_j = squared_length(hand_ - intent_);
    intent_ = intent;
    ledger_.muscles += 0.5 * arm_.stiffness_n_per_m * (squared_length(hand_ - intent_) - before_j);

    const double m1 = 2.0 * mechanism_.mass_kg / dt;
    const double m2 = 2.0 * arm_.mass_kg / dt;
    const double b1 = mechanism_.damping_n_s_per_m;
    Vec3 moved, new_velocity; // u and v' of the device, before friction
    Vec3 hand_moved;
    Vec3 grip_force;   // on the hand
    Vec3 grip_damping; // of it, what the damper does
    for (int axis = 0; axis < 3; ++axis) {
        const double stretch = stretch_of(axis);
        const bool touches = stretch != 0.0 || grip_.backlash_m == 0.0;
        const double kj = touches ? grip_.stiffness_n_per_m : 0.0;
        const double bj = touches ? grip_.damping_n_s_per_m : 0.0;
        const double joint = bj + 0.5 * dt * kj;
        // [a1, -joint; -joint, a2] u = r; a1 a2 > joint^2, as both have joint and a mass.
        const double a1 = m1 + b1 + joint;
        const double a2 = m2 + arm_.damping_n_s_per_m + 0.5 * dt * arm_.stiffness_n_per_m + joint;
        const double r1 = m1 * handle_velocity_[axis] + motor[axis] - kj * stretch;
        const double r2 = m2 * hand_velocity_[axis] + tremor[axis] + kj * stretch -
                          arm_.stiffness_n_per_m * (hand_[axis] - intent_[axis]);
        const double determinant = a1 * a2 - joint * joint;
        const double u1 = (a2 * r1 + joint * r2) / determinant;
        const double u2 = (joint * r1 + a1 * r2) / determinant;
        new_velocity[axis] = 2.0 * u1 - handle_velocity_[axis];
        hand_moved[axis] = u2;
        moved[axis] = u1;
        grip_force[axis] = kj * stretch + joint * (u1 - u2);
        grip_damping[axis] = bj * (u1 - u2);
    }

    const double mass = mechanism_.mass_kg;
    const Vec3 slowed = after_friction(new_velocity, dt * mechanism_.friction_n / mass);
    const Vec3 way = 0.5 * dt * (handle_velocity_ + slowed);
    const Vec3 hand_way = dt * hand_moved;
    ledger_.motors += glm::dot(motor, way);
    ledger_.muscles += glm::dot(tremor, hand_way);
    ledger_.to_hand += glm::dot(grip_force, hand_way);
    ledger_.friction += mass / dt * glm::dot(new_velocity - slowed, way);
    ledger_.viscous += b1 * glm::dot(moved, way) + glm::dot(grip_damping, way - hand_way) +
                       arm_.damping_n_s_per_m * glm::dot(hand_moved, hand_way);
    handle_ += way;
    handle_velocity_ = slowed;
    hand_ += hand_way;
    hand_velocity_ = 2.0 * hand_moved - hand_velocity_;
}

} // namespace palpate::internal
