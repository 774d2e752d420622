// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/isosurface_material.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::internal {
namespace {

constexpr double kRootEnd = 1.0e-7; // mm, that is 0.1 nm

/// Root between a point where the value is > 0 and one where it is not: regula falsi, every third
/// step a bisection.
Vec3 root_between(Material& material, Vec3 inside, double value_inside, Vec3 outside,
                  double value_outside) {
    constexpr int kMostSteps = 120; // every third halves: 2^-40 of the first bracket at the worst
    for (int step = 0; step < kMostSteps && glm::distance(inside, outside) > kRootEnd; ++step) {
        double share = 0.5; // of the way from inside to outside
        if (step % 3 != 2 && std::isfinite(value_inside - value_outside))
            share = std::clamp(value_inside / (value_inside - value_outside), 0.01, 0.99);
        const Vec3 p = inside + share * (outside - inside);
        const double value = material.value(p);
        if (value > 0.0) {
            inside = p;
            value_inside = value;
        } else {
            outside = p;
            value_outside = value;
        }
    }
    return 0.5 * (inside + outside);
}

} // namespace

Material::Material(const Isosurface& surface, ExtractionProgress& progress)
    : surface_(surface), progress_(progress), center_(surface.bounds.center()) {}

double Material::value(const Vec3& p_mm) {
    progress_.work();
    const Vec3 p = to_scene(p_mm);
    if (glm::any(glm::lessThan(p, surface_.bounds.lower)) ||
        glm::any(glm::greaterThan(p, surface_.bounds.upper)))
        return -1.0;
    const double value = surface_.value(p);
    return std::isnan(value) ? -1.0 : value;
}

Vec3 gradient(Material& material, const Vec3& p) {
    constexpr double kHalf = 1.0e-3; // mm
    Vec3 g{0.0};
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step{0.0};
        step[axis] = kHalf;
        g[axis] = (material.value(p + step) - material.value(p - step)) / (2.0 * kHalf);
    }
    return g;
}

std::optional<Vec3> onto_surface(Material& material, const Vec3& p, double reach) {
    const double value = material.value(p);
    if (value == 0.0) return p;
    const Vec3 g = gradient(material, p);
    const double slope = glm::length(g);
    if (!(slope > 0.0) || !std::isfinite(slope)) return std::nullopt;
    const Vec3 direction = (value > 0.0 ? -1.0 : 1.0) / slope * g;

    // The linear step, a little more, then twice as far each time.
    double step = std::clamp(1.5 * std::abs(value) / slope, 1.0e-3 * reach, reach);
    while (true) {
        const Vec3 q = p + step * direction;
        const double there = material.value(q);
        if ((there > 0.0) != (value > 0.0))
            return value > 0.0 ? root_between(material, p, value, q, there)
                               : root_between(material, q, there, p, value);
        if (step >= reach) return std::nullopt;
        step = std::min(2.0 * step, reach);
    }
}

std::vector<Vec3> ring(Material& material, const Vec3& p, double spacing) {
    const Vec3 g = gradient(material, p);
    const double slope = glm::length(g);
    if (!(slope > 0.0) || !std::isfinite(slope)) return {};
    const Vec3 n = g / slope;
    const Vec3 across = std::abs(n.x) < 0.6 ? Vec3{1.0, 0.0, 0.0} : Vec3{0.0, 1.0, 0.0};
    const Vec3 u = glm::normalize(glm::cross(n, across)), v = glm::cross(n, u);
    std::vector<Vec3> points;
    for (int k = 0; k < 6; ++k) {
        const double angle = k * std::numbers::pi / 3.0;
        const auto q = onto_surface(
            material, p + spacing * (std::cos(angle) * u + std::sin(angle) * v), spacing);
        if (q) points.push_back(*q);
    }
    return points;
}

} // namespace palpate::internal
