// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/wooden_model.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace palpate {

namespace {

/// The angle between the sides `near_1` and `near_2` of a triangle, and how it changes with near_1.
/// NaN where there is no such triangle.
struct Corner {
    double angle;
    double by_near_1;
};

Corner corner(double near_1, double near_2, double opposite) noexcept {
    const double cosine =
        (near_1 * near_1 + near_2 * near_2 - opposite * opposite) / (2.0 * near_1 * near_2);
    const double slope = -1.0 / std::sqrt(1.0 - cosine * cosine);
    return {std::acos(cosine), slope * (1.0 / near_2 - cosine / near_1)};
}

/// Radius from the base's axis and height, with their derivatives by the angles B and C.
struct Reach {
    double radius, radius_by_b, radius_by_c;
    double height, height_by_b, height_by_c;
    double pitch; // of the last body, rad, from level downwards
};

Reach parallelogram_reach(const WoodenModel& model, double b, double c) noexcept {
    const auto [length_a, length_b, length_c] = model.body_length_m;
    return {length_b * std::sin(b) + length_c * std::sin(c),
            length_b * std::cos(b),
            length_c * std::cos(c),
            length_a + length_b * std::cos(b) - length_c * std::cos(c),
            -length_b * std::sin(b),
            length_c * std::sin(c),
            0.5 * std::numbers::pi - c};
}

/// Links 0 to 5. P is the far end of link 1 as seen from that of the crank (link 2); the triangle
/// of links 3 and 4 on it turns link 5.
Reach polhem_reach(const WoodenModel& model, double b, double c) noexcept {
    const auto [link_0, link_2, link_3, link_4] = model.link_length_m;
    const double link_1 = model.body_length_m[1];
    const double link_5 = model.body_length_m[2];

    const double p_x = link_0 + link_1 * std::cos(b) - link_2 * std::cos(c);
    const double p_y = link_1 * std::sin(b) - link_2 * std::sin(c);
    const double p = std::hypot(p_x, p_y);
    const double p_by_b = (-p_x * std::sin(b) + p_y * std::cos(b)) * link_1 / p;
    const double p_by_c = (p_x * std::sin(c) - p_y * std::cos(c)) * link_2 / p;
    const double turn_by_b = (p_x * std::cos(b) + p_y * std::sin(b)) * link_1 / (p * p);
    const double turn_by_c = -(p_x * std::cos(c) + p_y * std::sin(c)) * link_2 / (p * p);

    const Corner at_p = corner(p, link_4, link_3);
    const double lambda = std::atan2(p_y, p_x) - at_p.angle;
    const double lambda_by_b = turn_by_b - at_p.by_near_1 * p_by_b;
    const double lambda_by_c = turn_by_c - at_p.by_near_1 * p_by_c;

    return {0.5 * link_0 + link_1 * std::cos(b) + link_5 * std::cos(lambda),
            -link_1 * std::sin(b) - link_5 * std::sin(lambda) * lambda_by_b,
            -link_5 * std::sin(lambda) * lambda_by_c,
            link_1 * std::sin(b) + link_5 * std::sin(lambda),
            link_1 * std::cos(b) + link_5 * std::cos(lambda) * lambda_by_b,
            link_5 * std::cos(lambda) * lambda_by_c,
            -lambda};
}

bool has_gimbal(const WoodenModel& model) noexcept {
    return model.counts_per_turn[3] > 0.0 && model.counts_per_turn[4] > 0.0 &&
           model.counts_per_turn[5] > 0.0;
}

Quaternion handle_orientation(const std::array<double, 6>& angles, double pitch) noexcept {
    const Vec3 x(1.0, 0.0, 0.0);
    const Vec3 y(0.0, 1.0, 0.0);
    return glm::angleAxis(angles[0], Vec3(0.0, 0.0, 1.0)) * glm::angleAxis(pitch, y) *
           glm::angleAxis(angles[3], x) * glm::angleAxis(angles[4], y) *
           glm::angleAxis(angles[5], x);
}

void require(bool holds, const WoodenModel& model, const char* what) {
    if (!holds) throw std::invalid_argument("device model " + model.name + ": " + what);
}

template <std::size_t N>
bool all_positive(const std::array<double, N>& values) {
    return std::all_of(values.begin(), values.end(),
                       [](double v) { return std::isfinite(v) && v > 0.0; });
}

template <std::size_t N>
bool all_signs(const std::array<double, N>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::abs(v) == 1.0; });
}

} // namespace

void check(const WoodenModel& model) {
    require(all_positive(model.capstan_diameter_m), model, "capstan diameters must be > 0 m");
    require(all_positive(model.body_diameter_m), model, "body diameters must be > 0 m");
    require(all_positive(model.body_length_m), model, "body lengths must be > 0 m");
    require(model.linkage != WoodenLinkage::polhem || all_positive(model.link_length_m), model,
            "link lengths must be > 0 m");
    require(is_finite(model.workspace_origin_m), model, "the workspace's origin must be finite");
    require(all_positive<1>({model.workspace_radius_m}), model,
            "the workspace's radius must be > 0 m");
    require(all_positive(model.torque_constant_nm_per_a), model,
            "torque constants must be > 0 N m/A");
    for (std::size_t i = 0; i < 6; ++i) {
        const double counts = model.counts_per_turn[i];
        require(std::isfinite(counts) && (i < 3 ? counts > 0.0 : counts >= 0.0), model,
                "counts per turn must be > 0, those of the gimbal >= 0");
        require(std::abs(model.home_counts[i]) <= 32767.0, model,
                "home counts must fit into 16 bits");
    }
    require(all_signs(model.count_direction) && all_signs(model.joint_sign), model,
            "directions and signs must be 1 or -1");
    require(all_positive<2>({model.force_n, model.stiffness_n_per_m}), model,
            "largest force and stiffness must be > 0");
    require(wooden_pose(model, wooden_angles(model, model.home_counts)).has_value(), model,
            "its links do not reach each other at the home pose");
}

std::array<double, 6> wooden_angles(const WoodenModel& model,
                                    const std::array<double, 6>& counts) noexcept {
    std::array<double, 6> angles{};
    for (std::size_t i = 0; i < 6; ++i) {
        if (model.counts_per_turn[i] == 0.0) continue;
        angles[i] =
            model.joint_sign[i] * 2.0 * std::numbers::pi * counts[i] / model.counts_per_turn[i];
        if (i < 3) angles[i] *= model.capstan_diameter_m[i] / model.body_diameter_m[i];
    }
    return angles;
}

std::optional<WoodenPose> wooden_pose(const WoodenModel& model,
                                      const std::array<double, 6>& angles) noexcept {
    const auto [a, b, c, d, e, f] = angles;
    const Reach reach = model.linkage == WoodenLinkage::polhem ? polhem_reach(model, b, c)
                                                               : parallelogram_reach(model, b, c);
    const Vec3 outwards(std::cos(a), std::sin(a), 0.0);
    const Vec3 sideways(-std::sin(a), std::cos(a), 0.0);
    const Vec3 up(0.0, 0.0, 1.0);

    WoodenPose pose;
    pose.position = reach.radius * outwards + reach.height * up - model.workspace_origin_m;
    pose.jacobian =
        Mat3(reach.radius * sideways, reach.radius_by_b * outwards + reach.height_by_b * up,
             reach.radius_by_c * outwards + reach.height_by_c * up);
    if (has_gimbal(model)) pose.orientation = handle_orientation(angles, reach.pitch);

    const bool finite = is_finite(pose.position) && is_finite(pose.jacobian[0]) &&
                        is_finite(pose.jacobian[1]) && is_finite(pose.jacobian[2]) &&
                        std::isfinite(d) && std::isfinite(e) && std::isfinite(f);
    if (!finite) return std::nullopt;
    return pose;
}

Vec3 wooden_currents_ma(const WoodenModel& model, const Mat3& jacobian,
                        const Vec3& force) noexcept {
    const Vec3 torque = glm::transpose(jacobian) * force;
    Vec3 currents;
    for (int i = 0; i < 3; ++i) {
        const auto motor = static_cast<std::size_t>(i);
        currents[i] = 1000.0 * model.joint_sign[motor] * torque[i] *
                      model.capstan_diameter_m[motor] / model.body_diameter_m[motor] /
                      model.torque_constant_nm_per_a[motor];
    }
    return currents;
}

std::array<std::int16_t, 3> limited_wooden_currents(const Vec3& currents_ma) noexcept {
    if (!is_finite(currents_ma)) return {};
    const Vec3 size = glm::abs(currents_ma);
    const double largest = std::max({size.x, size.y, size.z});
    const double share = largest > kWoodenCurrentLimitMa ? kWoodenCurrentLimitMa / largest : 1.0;
    std::array<std::int16_t, 3> whole{};
    for (int i = 0; i < 3; ++i)
        whole[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(share * currents_ma[i]);
    return whole;
}

double wooden_home_force_n(const WoodenModel& model) noexcept {
    const auto pose = wooden_pose(model, wooden_angles(model, model.home_counts));
    if (!pose) return 0.0;
    // Motor i's current is a row times the force: the direction along that row needs the most.
    double force = model.force_n;
    const std::array axes{Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0)};
    for (int i = 0; i < 3; ++i) {
        Vec3 row;
        for (int k = 0; k < 3; ++k)
            row[k] =
                wooden_currents_ma(model, pose->jacobian, axes[static_cast<std::size_t>(k)])[i];
        if (const double length = glm::length(row); length > 0.0)
            force = std::min(force, kWoodenCurrentLimitMa / length);
    }
    return force;
}

double wooden_home_step_m(const WoodenModel& model) noexcept {
    constexpr double kCoarsest_m = 0.01; // as of plug-ins; also where a count is no angle
    const auto pose = wooden_pose(model, wooden_angles(model, model.home_counts));
    if (!pose) return 0.0;
    Vec3 step(0.0);
    for (int i = 0; i < 3; ++i) {
        const auto motor = static_cast<std::size_t>(i);
        const double count_rad = 2.0 * std::numbers::pi / model.counts_per_turn[motor] *
                                 model.capstan_diameter_m[motor] / model.body_diameter_m[motor];
        step += count_rad * glm::abs(pose->jacobian[i]);
    }
    return std::min(kCoarsest_m, std::max({step.x, step.y, step.z}));
}

} // namespace palpate
