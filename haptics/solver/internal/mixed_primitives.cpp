// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/solver/internal/mixed_primitives.h>

#include <algorithm>
#include <cmath>

#include <palpate/haptics/solver/internal/solver_limits.h>

namespace palpate::internal {

Mat3 across_of(const Vec3& axis) noexcept {
    const Vec3 other = std::abs(axis.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 t = glm::normalize(glm::cross(axis, other));
    return {t, glm::cross(axis, t), Vec3{0.0}};
}

MixedPrimitives::MixedPrimitives(const PrimitiveSet& primitives, const Vec3& target,
                                 double stiffness) noexcept {
    const auto add = [this](const Tether& tether, const Vec3& anchor) {
        tethers.push_back(tether);
        at_target.way.push_back(-(anchor * tether.across));
        scale = std::max(scale, glm::length(anchor));
    };
    for (std::size_t i = 0; i < primitives.planes().size(); ++i) {
        const PlanePrimitive& plane = primitives.planes()[i];
        const double length = glm::length(plane.normal);
        const double bound = plane.strength_n / stiffness;
        if (!is_usable(plane.anchor, length, bound)) continue;
        const Vec3 anchor = plane.anchor - target;
        const Vec3 normal = plane.normal / length;
        hinges.push_back({normal, bound, true, i});
        at_target.gap.push_back(-glm::dot(normal, anchor));
        scale = std::max(scale, glm::length(anchor));
    }
    for (std::size_t i = 0; i < primitives.lines().size(); ++i) {
        const LinePrimitive& line = primitives.lines()[i];
        const double length = glm::length(line.axis);
        const double bound = line.strength_n / stiffness;
        if (!is_usable(line.anchor, length, bound)) continue;
        const Vec3 axis = line.axis / length;
        add({axis, across_of(axis), bound, i}, line.anchor - target);
    }
    line_count = tethers.size();
    for (std::size_t i = 0; i < primitives.points().size(); ++i) {
        const PointPrimitive& point = primitives.points()[i];
        const double bound = point.strength_n / stiffness;
        if (!is_usable(point.anchor, 1.0, bound)) continue;
        add({Vec3{0.0}, Mat3{1.0}, bound, i}, point.anchor - target);
    }
    const double hard = kHardMultiplier * scale;
    for (Hinge& hinge : hinges) {
        hinge.yields = hinge.bound <= hard;
        hinge.bound = std::min(hinge.bound, hard);
    }
    for (Tether& tether : tethers)
        tether.bound = std::min(tether.bound, hard);
}

Vec3 MixedPrimitives::sum(const Multipliers& multipliers) const noexcept {
    Vec3 y{0.0};
    for (std::size_t i = 0; i < hinges.size(); ++i)
        y += multipliers.lambda[i] * hinges[i].normal;
    for (std::size_t j = 0; j < tethers.size(); ++j)
        y += tethers[j].across * multipliers.pull[j];
    return y;
}

double MixedPrimitives::sum_of_lengths(const Multipliers& multipliers) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < hinges.size(); ++i)
        sum += multipliers.lambda[i];
    for (std::size_t j = 0; j < tethers.size(); ++j)
        sum += glm::length(multipliers.pull[j]);
    return sum;
}

double MixedPrimitives::largest_change(const Multipliers& from,
                                       const Multipliers& to) const noexcept {
    double largest = 0.0;
    for (std::size_t i = 0; i < hinges.size(); ++i)
        largest = std::max(largest, std::abs(to.lambda[i] - from.lambda[i]));
    for (std::size_t j = 0; j < tethers.size(); ++j)
        largest = std::max(largest, glm::length(to.pull[j] - from.pull[j]));
    return largest;
}

Offsets MixedPrimitives::moved(const Offsets& offsets, const Vec3& step) const noexcept {
    Offsets result;
    for (std::size_t i = 0; i < hinges.size(); ++i)
        result.gap.push_back(offsets.gap[i] + glm::dot(hinges[i].normal, step));
    for (std::size_t j = 0; j < tethers.size(); ++j)
        result.way.push_back(offsets.way[j] + step * tethers[j].across);
    return result;
}

} // namespace palpate::internal
