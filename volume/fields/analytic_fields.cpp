// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/analytic_fields.h>

#include <numbers>

#include <palpate/volume/fields/internal/analytic_field.h>
#include <palpate/volume/fields/internal/sphere_chord.h>

namespace palpate {
namespace {

/// sign (|x| - radius): the cavity with sign +1, the solid sphere with -1.
struct Sphere {
    double radius;
    double sign;

    double value(const Vec3& x) const noexcept {
        return sign * (internal::safe_length(x) - radius);
    }

    FieldSample sample(const Vec3& x) const noexcept {
        FieldSample s;
        const double r = internal::safe_length(x);
        s.value = sign * (r - radius);
        if (r < internal::kSingular) return s;
        const Vec3 u = x / r;
        s.slope = sign * u;
        s.hessian = (sign / r) * (Mat3(1.0) - glm::outerProduct(u, u));
        return s;
    }

    /// Radius of the isosurface; negative when there is none.
    double radius_at(double level) const noexcept { return radius + sign * level; }

    std::optional<double> root(const Vec3& from, const Vec3& along, double level) const noexcept {
        if (sign < 0.0 && glm::dot(from, along) >= 0.0)
            return std::nullopt; // outside and moving away; asked first, for `enter` may round to
                                 // either side of 0
        const std::optional<internal::SphereChord> chord =
            internal::sphere_chord(from, along, radius_at(level));
        if (!chord) return std::nullopt;
        const double t = sign > 0.0 ? chord->leave : chord->enter;
        if (t > 1.0) return std::nullopt;
        return std::max(t, 0.0);
    }

    Box bounds(double level) const {
        return internal::centred_cube(internal::kBoundsMargin * std::max(radius, radius_at(level)));
    }
    double feature_size_m() const noexcept { return radius; }
    double patch_cosine() const noexcept { return internal::kSmoothPatch; }
    double typical_slope(double level) const { return radius_at(level) > 0.0 ? 1.0 : 0.0; }
};

constexpr double kReach = 0.1; // m: faces without an end are for a hand's reach of them

/// half - |z|.
struct Slab {
    double half;

    double value(const Vec3& x) const noexcept { return half - std::abs(x.z); }

    FieldSample sample(const Vec3& x) const noexcept {
        FieldSample s;
        s.value = value(x);
        s.slope = {0.0, 0.0, x.z >= 0.0 ? -1.0 : 1.0}; // the middle counts to the upper face
        return s;
    }

    std::optional<double> root(const Vec3& from, const Vec3& along, double level) const noexcept {
        const double face = half - level; // |z| of the isosurface, which |from.z| exceeds
        const double way = std::abs(from.z) - face;
        const double towards = from.z >= 0.0 ? -along.z : along.z;
        if (face < 0.0 || !(towards > 0.0) || towards < way) return std::nullopt;
        return way / towards;
    }

    Box bounds(double level) const {
        const double z = std::max(kReach, internal::kBoundsMargin * std::max(half, half - level));
        return {{-kReach, -kReach, -z}, {kReach, kReach, z}};
    }
    double feature_size_m() const noexcept { return internal::kFlatFeature; }
    double relief_limit_m() const noexcept { return std::min(half, kReach); }
    double patch_cosine() const noexcept { return internal::kFlatPatch; }
    double typical_slope(double level) const { return level < half ? 1.0 : 0.0; }
};

/// The distances into the two faces are -cos(a) (+-x) - sin(a) z with a = half the angle. The body
/// is where both are > 0 when a < 90 degrees, the smaller counts; and where one is > 0 when a > 90,
/// the larger counts. Both are -cos(a) |x| - sin(a) z.
struct Wedge {
    double cosine;
    double sine;

    double value(const Vec3& p) const noexcept { return -cosine * std::abs(p.x) - sine * p.z; }

    FieldSample sample(const Vec3& p) const noexcept {
        FieldSample s;
        s.value = value(p);
        s.slope = {p.x >= 0.0 ? -cosine : cosine, 0.0,
                   -sine}; // above and below the edge: the face at x > 0
        return s;
    }

    std::optional<double> root(const Vec3& from, const Vec3& along, double level) const noexcept {
        // Linear up to the plane x = 0 and after it.
        double a = 0.0;
        double f_a = value(from);
        const bool crosses = (from.x > 0.0) != (from.x + along.x > 0.0) && along.x != 0.0;
        const double middle = crosses ? std::clamp(-from.x / along.x, 0.0, 1.0) : 1.0;
        for (const double b : {middle, 1.0}) {
            const double f_b = value(internal::point_at(from, along, b));
            if (f_b >= level) // > f_a, which is below it
                return a + (level - f_a) / (f_b - f_a) * (b - a);
            a = b;
            f_a = f_b;
        }
        return std::nullopt;
    }

    /// The faces are |level| from those of the level 0, which meet in the middle. Where they begin
    /// farther off, at their edge, that is what a hand reaches of them.
    Box bounds(double level) const {
        if (!(level * cosine > 0.0)) return internal::centred_cube(kReach + std::abs(level));
        const Vec3 edge{0.0, 0.0, -level / sine};
        return {edge - kReach, edge + kReach};
    }
    double feature_size_m() const noexcept { return internal::kFlatFeature; }
    double relief_limit_m() const noexcept { return kReach; }
    double patch_cosine() const noexcept { return internal::kFlatPatch; }
    double typical_slope(double) const { return 1.0; }
};

} // namespace

std::unique_ptr<ScalarField> make_sphere_cavity(double radius_m) {
    internal::require_positive("sphere_cavity", "radius", radius_m);
    return internal::make_analytic(Sphere{radius_m, 1.0});
}

std::unique_ptr<ScalarField> make_solid_sphere(double radius_m) {
    internal::require_positive("solid_sphere", "radius", radius_m);
    return internal::make_analytic(Sphere{radius_m, -1.0});
}

std::unique_ptr<ScalarField> make_slab(double thickness_m) {
    internal::require_positive("slab", "thickness", thickness_m);
    return internal::make_analytic(Slab{0.5 * thickness_m});
}

std::unique_ptr<ScalarField> make_wedge(double angle_deg) {
    if (!(angle_deg > 0.0 && angle_deg < 360.0) || angle_deg == 180.0)
        throw std::invalid_argument("wedge: angle_deg = " + std::to_string(angle_deg) +
                                    "; give one in (0, 360) that is not 180");
    const double half = 0.5 * angle_deg * std::numbers::pi / 180.0;
    return internal::make_analytic(Wedge{std::cos(half), std::sin(half)});
}

} // namespace palpate
