// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/analytic_fields.h>

#include <palpate/volume/fields/internal/analytic_field.h>
#include <palpate/volume/fields/internal/polynomial_root.h>
#include <palpate/volume/fields/internal/sphere_chord.h>

namespace palpate {
namespace {

/// tube - distance to the circle of `radius` around z.
struct Torus {
    double radius;
    double tube;

    double value(const Vec3& x) const noexcept {
        return tube - internal::safe_length(internal::safe_length(x.x, x.y) - radius, x.z);
    }

    FieldSample sample(const Vec3& x) const noexcept {
        FieldSample s;
        const double axial = internal::safe_length(x.x, x.y); // distance from the axis
        const double distance = internal::safe_length(axial - radius, x.z);
        s.value = tube - distance;
        if (axial < internal::kSingular || distance < internal::kSingular) return s;
        const Vec3 outward(x.x / axial, x.y / axial, 0.0);
        const Vec3 around(-outward.y, outward.x, 0.0);
        const double n_outward = (axial - radius) / distance;
        const double n_up = x.z / distance;
        const Vec3 normal = n_outward * outward + Vec3(0.0, 0.0, n_up);
        const Vec3 across = n_up * outward - Vec3(0.0, 0.0, n_outward);
        s.slope = -normal;
        // The distance curves across the normal in the plane through the axis like a circle of its
        // own size, and along the circle like the circle through the point.
        s.hessian = -(1.0 / distance) * glm::outerProduct(across, across) -
                    (n_outward / axial) * glm::outerProduct(around, around);
        return s;
    }

    /// The isosurface is (|x|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + y^2), a quartic on the segment; for r
    /// > R, where that surface has a second sheet, the sheet lies inside. The segment is cut to the
    /// sphere around the torus first: coefficients stay as small as the torus.
    std::optional<double> root(const Vec3& from, const Vec3& along, double level) const noexcept {
        const double r = tube - level;
        if (r < 0.0) return std::nullopt;
        const std::optional<internal::SphereChord> chord =
            internal::sphere_chord(from, along, radius + r);
        if (!chord || chord->enter > 1.0 || chord->leave < 0.0) return std::nullopt;
        const double a = std::clamp(chord->enter, 0.0, 1.0);
        const double b = std::clamp(chord->leave, 0.0, 1.0);
        // In units of the circle's radius.
        const Vec3 p = internal::point_at(from, along, a) / radius;
        const Vec3 d = ((b - a) / radius) * along;
        const double q_0 = glm::dot(p, p) + (1.0 - r / radius) * (1.0 + r / radius);
        const double q_1 = 2.0 * glm::dot(p, d);
        const double q_2 = glm::dot(d, d);
        const internal::Polynomial<4> inside{4.0 * (p.x * p.x + p.y * p.y) - q_0 * q_0,
                                             8.0 * (p.x * d.x + p.y * d.y) - 2.0 * q_0 * q_1,
                                             4.0 * (d.x * d.x + d.y * d.y) - q_1 * q_1 -
                                                 2.0 * q_0 * q_2,
                                             -2.0 * q_1 * q_2, -q_2 * q_2};
        const std::optional<double> t = internal::first_reach<4>(inside, 0.0);
        if (!t) return std::nullopt;
        return a + *t * (b - a);
    }

    Box bounds(double level) const {
        const double out = internal::kBoundsMargin * (radius + std::max(tube, tube - level));
        const double up = out - radius; // the same room above as around
        return {{-out, -out, -up}, {out, out, up}};
    }
    double feature_size_m() const noexcept { return tube; }
    double patch_cosine() const noexcept { return internal::kSmoothPatch; }
    double typical_slope(double level) const { return level < tube ? 1.0 : 0.0; }
};

} // namespace

std::unique_ptr<ScalarField> make_torus(double radius_m, double tube_m) {
    internal::require_positive("torus", "radius", radius_m);
    internal::require_positive("torus", "tube", tube_m);
    if (tube_m >= radius_m)
        throw std::invalid_argument("torus: tube = " + std::to_string(tube_m) + " m, radius = " +
                                    std::to_string(radius_m) + " m; give a tube below the radius");
    return internal::make_analytic(Torus{radius_m, tube_m});
}

} // namespace palpate
