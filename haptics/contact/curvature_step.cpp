// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/curvature_step.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <palpate/haptics/solver/internal/mixed_primitives.h>

namespace palpate {
namespace {

// Below this eigenvalue the free directions have (nearly) no minimum, as on the top of a bump:
// slide off (contact.md 1.2, step 5).
constexpr double kSmallestEigenvalue = 0.15;
constexpr double kSlidingEigenvalue = 0.3;
// The normal part may follow the slope only where slope and normal agree to about 73 degrees.
constexpr double kSlopeShare = 0.3;
// Twice as much each time: to 1e9 times the coupling's stiffness.
constexpr int kMostShifts = 32;
// Normals are independent directions when more than this is left of them; a milliradian apart is
// one direction here.
constexpr double kIndependent = 1e-3;

// What both curvature_step() call is put in line, so that frames of hard surfaces pay for no call.

/// The span of the directions in which something holds, orthonormalised.
struct PinnedDirections {
    std::array<Vec3, 3> axis{};
    int count = 0;

    void add(const Vec3& direction) noexcept {
        Vec3 rest = direction;
        for (int j = 0; j < count; ++j)
            rest -= glm::dot(axis[j], rest) * axis[j];
        if (count < 3 && glm::length(rest) > kIndependent) axis[count++] = glm::normalize(rest);
    }
};

/// Directions that nothing pins, at most two: an orthonormal basis of the complement.
struct FreeDirections {
    std::array<Vec3, 2> axis{};
    int count = 0;
};

[[gnu::always_inline]] inline FreeDirections complement(const PinnedDirections& pinned) noexcept {
    const auto& n = pinned.axis;
    if (pinned.count == 1) {
        const Mat3 plane = internal::across_of(n[0]);
        return {{plane[0], plane[1]}, 2};
    }
    if (pinned.count == 2) return {{glm::normalize(glm::cross(n[0], n[1])), Vec3{0.0}}, 1};
    return {};
}

/// What lines and points come to: they pin where they hold, and turn with the proxy where they
/// slip.
struct Tethers {
    bool hold = false;
    bool slip = false;
    Mat3 turning{0.0}; // C = sum (sigma / |r|) (Pi - t t^T), t the unit way r from the tether

    /// A tether that slips at `way` from the proxy and draws with `sigma` = force / stiffness, m;
    /// `across` projects onto the directions in which it draws.
    void add_slipping(const Vec3& way, double sigma, const Mat3& across) noexcept {
        const double distance = glm::length(way);
        if (!(distance > 0.0)) return;
        slip = true;
        const Vec3 t = way / distance;
        turning += (sigma / distance) * (across - glm::outerProduct(t, t));
    }
};

[[gnu::always_inline]] inline Tethers tethers_of(const PrimitiveSet& primitives,
                                                 const ProxySolution& solution, double stiffness,
                                                 PinnedDirections& pinned) noexcept {
    Tethers tethers;
    for (std::size_t i = 0; i < primitives.lines().size(); ++i) {
        const LinePrimitive& line = primitives.lines()[i];
        const TetherState state = solution.lines[i].state;
        if (state == TetherState::released) continue;
        const Vec3 axis = glm::normalize(line.axis); // not released: it has a length
        const Mat3 projection = Mat3(1.0) - glm::outerProduct(axis, axis);
        if (state == TetherState::slipping) {
            tethers.add_slipping(projection * (solution.proxy - line.anchor),
                                 glm::length(solution.lines[i].force_n) / stiffness, projection);
            continue;
        }
        const Mat3 plane = internal::across_of(axis);
        pinned.add(plane[0]);
        pinned.add(plane[1]);
        tethers.hold = true;
    }
    for (std::size_t i = 0; i < primitives.points().size(); ++i) {
        const TetherState state = solution.points[i].state;
        if (state == TetherState::slipping)
            tethers.add_slipping(solution.proxy - primitives.points()[i].anchor,
                                 glm::length(solution.points[i].force_n) / stiffness, Mat3(1.0));
        if (state != TetherState::held) continue;
        for (int axis = 0; axis < 3; ++axis)
            pinned.add(Mat3(1.0)[axis]);
        tethers.hold = true;
    }
    return tethers;
}

/// Solves M z = r for two directions; where M has no minimum to find, along its eigenvectors with
/// their curvature made positive.
[[gnu::always_inline]] inline std::array<double, 2>
newton_in_plane(double m00, double m01, double m10, double m11, double r0, double r1) noexcept {
    const double off = 0.5 * (m01 + m10);
    const double mean = 0.5 * (m00 + m11);
    const double half = 0.5 * (m00 - m11);
    // No eigenvalue is below `mean` less the sum, which costs less than the root.
    const bool far_from_sliding = mean - (std::abs(half) + std::abs(off)) > kSmallestEigenvalue;
    // Of three numbers: that of two is the C library's, with another last bit on other processors.
    const double radius = far_from_sliding ? 0.0 : std::hypot(half, off, 0.0);
    if (mean - radius > kSmallestEigenvalue) {
        const double det =
            m00 * m11 - m01 * m10; // >= product of the symmetric part's eigenvalues > 0
        return {(m11 * r0 - m01 * r1) / det, (m00 * r1 - m10 * r0) / det};
    }
    const double angle = 0.5 * std::atan2(off, half);
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const double high = std::max(std::abs(mean + radius), kSlidingEigenvalue);
    const double low = std::max(std::abs(mean - radius), kSlidingEigenvalue);
    const double along_high = (c * r0 + s * r1) / high;
    const double along_low = (-s * r0 + c * r1) / low;
    return {c * along_high - s * along_low, s * along_high + c * along_low};
}

/// Solves M z = r, M symmetric; where M has no minimum to find, with so much of the unit matrix
/// added that it has one.
Vec3 newton_in_space(Mat3 m, const Vec3& r) noexcept {
    m = 0.5 * (m + glm::transpose(m));
    // Gauss, without a choice of pivots: they are all above the smallest eigenvalue, or M is not
    // one to step with.
    double shift = 0.0;
    for (int tries = 0; tries < kMostShifts; ++tries) {
        const Mat3 a = m + shift * Mat3(1.0);
        shift = std::max(kSlidingEigenvalue, 2.0 * shift);
        const double p0 = a[0][0];
        if (!(p0 > kSmallestEigenvalue)) continue;
        const double l1 = a[0][1] / p0, l2 = a[0][2] / p0;
        const double p1 = a[1][1] - l1 * a[0][1], q = a[1][2] - l1 * a[0][2];
        if (!(p1 > kSmallestEigenvalue)) continue;
        const double l3 = q / p1;
        const double p2 = a[2][2] - l2 * a[0][2] - l3 * q;
        if (!(p2 > kSmallestEigenvalue)) continue;
        const double y1 = r.y - l1 * r.x, y2 = r.z - l2 * r.x - l3 * y1;
        const double z2 = y2 / p2, z1 = (y1 - q * z2) / p1;
        return {(r.x - a[0][1] * z1 - a[0][2] * z2) / p0, z1, z2};
    }
    return r;
}

/// Normal part of a step along one plane: meets the level with the exact slope (contact.md 1.2,
/// step 5).
[[gnu::always_inline]] inline double step_to_level(const ContactPlane& contact,
                                                   const Vec3& tangential) noexcept {
    const Vec3& n = contact.plane.normal;
    double along_normal = glm::dot(contact.slope, n); // < 0: the value falls towards free space
    if (along_normal > -kSlopeShare * contact.gradient_length)
        along_normal = -contact.gradient_length;
    const double sigma = (contact.level_gap - glm::dot(contact.slope, tangential)) / along_normal;
    const double longest =
        0.5 * glm::length(tangential) + std::abs(contact.level_gap) / contact.gradient_length;
    return std::clamp(sigma, -longest, longest);
}

/// Frames without softness take it as if there were none.
template <bool kWithTissue>
Vec3 corrected_step(const PrimitiveSet& primitives, const ContactSet& contacts,
                    const ProxySolution& solution, const Vec3& proxy, double stiffness,
                    double damping, const Mat3& tissue) noexcept {
    const Vec3 full = solution.proxy - proxy;
    if (!kWithTissue && primitives.planes().empty())
        return full; // what lines and points add is no curvature

    // The planes that hold, and the curvature they bring.
    PinnedDirections pinned;
    std::size_t holding = 0;
    std::size_t holds = 0;
    Mat3 curvature{0.0};
    for (std::size_t i = 0; i < primitives.planes().size(); ++i) {
        if (solution.planes[i].state == MultiplierState::released) continue;
        if (i < contacts.size())
            curvature += (solution.planes[i].multiplier_n / stiffness) * contacts[i].depth_hessian;
        if (solution.planes[i].state == MultiplierState::saturated) continue;
        ++holding;
        holds = i;
        pinned.add(primitives.planes()[i].normal);
    }
    const Tethers tethers = tethers_of(primitives, solution, stiffness, pinned);
    const FreeDirections free = complement(pinned);
    if constexpr (kWithTissue) {
        curvature += tissue;
        if (pinned.count == 0)
            return damping * newton_in_space(Mat3(1.0) + curvature + tethers.turning,
                                             full + tethers.turning * full);
    }
    if (free.count == 0) return full;

    Vec3 tangential_full{0.0};
    for (int k = 0; k < free.count; ++k)
        tangential_full += glm::dot(full, free.axis[k]) * free.axis[k];
    const Vec3 normal_part = full - tangential_full;
    Vec3 rest = full - curvature * normal_part;
    if (tethers.slip) {
        curvature += tethers.turning; // the matrix I + B + C of the free directions
        rest += tethers.turning * tangential_full;
    }

    Vec3 tangential{0.0};
    if (free.count == 2) {
        const Vec3& u = free.axis[0];
        const Vec3& w = free.axis[1];
        const Vec3 bu = curvature * u;
        const Vec3 bw = curvature * w;
        const std::array<double, 2> z =
            newton_in_plane(1.0 + glm::dot(u, bu), glm::dot(u, bw), glm::dot(w, bu),
                            1.0 + glm::dot(w, bw), glm::dot(rest, u), glm::dot(rest, w));
        tangential = z[0] * u + z[1] * w;
    } else {
        const Vec3& u = free.axis[0];
        const double gain = 1.0 + glm::dot(u, curvature * u);
        const double safe =
            gain > kSmallestEigenvalue ? gain : std::max(std::abs(gain), kSlidingEigenvalue);
        tangential = (glm::dot(rest, u) / safe) * u;
    }
    tangential *= damping;

    const bool follows_slope = holding == 1 && !tethers.hold && holds < contacts.size() &&
                               squared_length(contacts[holds].slope) > 0.0;
    if (!follows_slope) return normal_part + tangential;
    return tangential + step_to_level(contacts[holds], tangential) * contacts[holds].plane.normal;
}

} // namespace

Vec3 curvature_step(const PrimitiveSet& primitives, const ContactSet& contacts,
                    const ProxySolution& solution, const Vec3& proxy, double stiffness,
                    double damping) noexcept {
    static constexpr Mat3 none(0.0);
    return corrected_step<false>(primitives, contacts, solution, proxy, stiffness, damping, none);
}

Vec3 curvature_step(const PrimitiveSet& primitives, const ContactSet& contacts,
                    const ProxySolution& solution, const Vec3& proxy, double stiffness,
                    double damping, const Mat3& tissue) noexcept {
    return corrected_step<true>(primitives, contacts, solution, proxy, stiffness, damping, tissue);
}

} // namespace palpate
