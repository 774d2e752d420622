// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/workspace.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// Of the coordinates at hand: a place this little outside is outside by rounding.
constexpr double kRounding = 1e-15;

// What a proxy on a plane may be behind it, and outside of a region that is never left.
constexpr double kOnPlane = 1e-9; // m

/// How far from the pull a candidate may be. With nothing but forces, springs and planes that the
/// proxy is in front of, none is further than the proxy: what lies within that needs no plane, and
/// a surface that leads the proxy keeps its own. Lines, points and planes behind which the proxy
/// is, as a magnet's, draw to anywhere.
double reach_of(const PrimitiveSet& primitives, const Vec3& pull, const Vec3& proxy) noexcept {
    bool drawn = primitives.has_tethers();
    for (const PlanePrimitive& plane : primitives.planes())
        drawn = drawn || glm::dot(plane.normal, proxy - plane.anchor) < -kOnPlane;
    return drawn ? std::numeric_limits<double>::infinity() : glm::length(pull - proxy);
}

} // namespace

WorkspaceSphere::WorkspaceSphere(const Vec3& center, double radius_m, LocalStrength strength)
    : center_(center), radius_m_(radius_m), strength_(std::move(strength)) {
    require_finite("workspace: center", center);
    require("workspace: radius_m", radius_m, kPositive);
}

void WorkspaceSphere::begin(const FrameContext& frame) noexcept {
    frame_ = frame;
    strength_.at(frame);
    end_ = center_;
    cuts_ = 0;
    looks_ = frame.looks;
    looked_ = false;
}

void WorkspaceSphere::cut_towards(const Vec3& point) noexcept {
    const Vec3 way = point - center_;
    const double distance = glm::length(way);
    if (distance > 0.0) normal_[cuts_++ % kCuts] = -way / distance;
}

Vec3 WorkspaceSphere::within(const Vec3& wanted) const noexcept {
    const Vec3 way = wanted - center_;
    const double distance = glm::length(way);
    if (!never_left_ || !(distance > radius_m_ + kOnPlane)) return wanted;
    return center_ + (radius_m_ / distance) * way;
}

void WorkspaceSphere::gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept {
    never_left_ = std::isinf(primitives.scaled_n(strength_.now()));
    const auto add_plane = [&](const Vec3& normal) {
        primitives.add({center_ - radius_m_ * normal, normal, strength_.now()});
    };
    const Vec3 out = proxy - center_;
    if (std::exchange(looks_, false) && squared_length(out) > 0.0) { // does it rest where it is?
        looked_ = true;
        add_plane(-glm::normalize(out));
        return;
    }
    if (!(strength_.now() > 0.0)) return;
    if (cuts_ == 0) {
        const Vec3 pull = primitives.pull(frame_.probe, frame_.stiffness);
        const double reach = reach_of(primitives, pull, proxy);
        if (glm::length(pull - center_) + reach > radius_m_) cut_towards(pull);
    }
    const double rounding = kRounding * (radius_m_ + glm::length(center_));
    if (glm::length(end_ - center_) > radius_m_ + rounding) cut_towards(end_);

    const std::size_t kept = never_left_ ? kCuts : 1;
    for (std::size_t i = cuts_ - std::min(cuts_, kept); i < cuts_; ++i)
        add_plane(normal_[i % kCuts]);
}

WorkspaceBox::WorkspaceBox(const Box& box, LocalStrength strength)
    : box_(box), strength_(std::move(strength)) {
    require_finite("workspace: box.lower", box.lower);
    require_finite("workspace: box.upper", box.upper);
    if (box.empty())
        throw std::invalid_argument("workspace: box.upper is below box.lower; swap them");
}

Vec3 WorkspaceBox::within(const Vec3& wanted) const noexcept {
    if (!never_left_) return wanted;
    const Vec3 inside = glm::clamp(wanted, box_.lower, box_.upper);
    return glm::length(wanted - inside) > kOnPlane ? inside : wanted;
}

void WorkspaceBox::gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept {
    never_left_ = std::isinf(primitives.scaled_n(strength_.now()));
    if (!(strength_.now() > 0.0)) return;
    const Vec3 pull = primitives.pull(frame_.probe, frame_.stiffness);
    const double reach = reach_of(primitives, pull, proxy);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 normal{0.0};
        normal[axis] = 1.0;
        if (pull[axis] - reach < box_.lower[axis])
            primitives.add({box_.lower, normal, strength_.now()});
        if (pull[axis] + reach > box_.upper[axis])
            primitives.add({box_.upper, -normal, strength_.now()});
    }
}

} // namespace palpate
