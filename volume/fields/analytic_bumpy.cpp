// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/analytic_fields.h>

#include <array>
#include <numbers>
#include <vector>

#include <palpate/volume/fields/internal/analytic_field.h>
#include <palpate/volume/fields/internal/root_search.h>
#include <palpate/volume/fields/internal/sphere_chord.h>

namespace palpate {
namespace {

/// s(u) = sin(w u_x) sin(w u_y) sin(w u_z) on unit vectors u, and its derivatives by u.
struct Bumps {
    double s = 0.0;
    Vec3 gradient{0.0};
    Mat3 hessian{0.0};
};

Bumps bumps_at(const Vec3& u, double w) noexcept {
    const Vec3 sine(std::sin(w * u.x), std::sin(w * u.y), std::sin(w * u.z));
    const Vec3 cosine(std::cos(w * u.x), std::cos(w * u.y), std::cos(w * u.z));
    Bumps b;
    b.s = sine.x * sine.y * sine.z;
    b.gradient = w * Vec3(cosine.x * sine.y * sine.z, sine.x * cosine.y * sine.z,
                          sine.x * sine.y * cosine.z);
    const double xy = w * w * cosine.x * cosine.y * sine.z;
    const double xz = w * w * cosine.x * sine.y * cosine.z;
    const double yz = w * w * sine.x * cosine.y * cosine.z;
    const double xx = -w * w * b.s;
    b.hessian = Mat3(xx, xy, xz, xy, xx, yz, xz, yz, xx);
    return b;
}

/// |x| - (radius + amplitude s(x / |x|)).
struct Bumpy {
    double radius;
    double amplitude;
    double wavelength;

    double frequency() const noexcept { return 2.0 * std::numbers::pi * radius / wavelength; }

    double value(const Vec3& x) const noexcept {
        const double r = internal::safe_length(x);
        if (r < internal::kSingular) return r - radius;
        const double w_r = frequency() / r;
        return r - radius -
               amplitude * (std::sin(w_r * x.x) * std::sin(w_r * x.y) * std::sin(w_r * x.z));
    }

    FieldSample sample(const Vec3& x) const noexcept {
        FieldSample result;
        result.value = value(x);
        const double r = internal::safe_length(x);
        if (r < internal::kSingular) return result;
        const Vec3 u = x / r;
        const Bumps b = bumps_at(u, frequency());
        const Mat3 tangential = Mat3(1.0) - glm::outerProduct(u, u);
        const Vec3 g = tangential * b.gradient;
        result.slope = u - (amplitude / r) * g;
        // s depends on the direction alone, so its second derivative by x has, beside the
        // tangential part of that by u, the turning of u itself.
        const Mat3 bend = tangential * b.hessian * tangential -
                          glm::dot(u, b.gradient) * tangential - glm::outerProduct(u, g) -
                          glm::outerProduct(g, u);
        result.hessian = (1.0 / r) * tangential - (amplitude / r / r) * bend;
        return result;
    }

    Vec3 slope(const Vec3& x) const noexcept { return sample(x).slope; }

    /// The most that the slope along a line falls per m, where nothing is nearer to the origin.
    double bend_per_m2(double nearest) const noexcept;

    std::optional<double> root(const Vec3& from, const Vec3& along, double level) const noexcept;

    Box bounds(double level) const {
        return internal::centred_cube(internal::kBoundsMargin *
                                      (radius + amplitude + std::max(level, 0.0)));
    }

    /// On a crest of amplitude sin(2 pi x / wavelength) the curvature is amplitude (2 pi /
    /// wavelength)^2.
    double feature_size_m() const noexcept {
        const double wave = wavelength / (2.0 * std::numbers::pi);
        return std::min(radius, wave * wave / amplitude);
    }
    double patch_cosine() const noexcept { return internal::kSmoothPatch; }
    double typical_slope(double level) const;
};

/// Along a segment of direction v, with u = x/|x|, q = u.v, p = |v - q u|, p^2 + q^2 = 1, from the
/// Hessian above:
///   -f'' <= amplitude / r^2 (|H| p^2 + |u.g| p^2 + 2 |g| p |q|),  |H| <= w^2, |g| <= w, |u.g| <=
///   w, 2 p |q| <= 1.
/// The bounds: |g|^2 / w^2 is linear in each sin^2, hence largest where those are 0 or 1, where it
/// is at most 1. A product of three sines is a quarter of four sines of (+-x +-y +-z) w; their
/// second derivatives along a unit vector add up to w^2.
double Bumpy::bend_per_m2(double nearest) const noexcept {
    const double w = frequency();
    return amplitude / nearest / nearest * (w * w + 2.0 * w);
}

std::optional<double> Bumpy::root(const Vec3& from, const Vec3& along,
                                  double level) const noexcept {
    constexpr double kStill = 1e-100; // m
    if (internal::safe_length(along) < kStill) return std::nullopt;
    // Inside this sphere the field is below the level whatever the bumps are.
    const double free_radius = radius - amplitude + level;
    const std::optional<internal::SphereChord> chord =
        internal::sphere_chord(from, along, free_radius);
    const double nearest = std::max(free_radius, internal::kSingular);
    internal::RootSearch search(*this, from, along, level, bend_per_m2(nearest), radius);
    if (!chord || chord->enter >= 1.0 || chord->leave <= 0.0) return search.first_in(0.0, 1.0);
    if (chord->enter > 0.0)
        if (const std::optional<double> t = search.first_in(0.0, chord->enter)) return t;
    if (chord->leave < 1.0) return search.first_in(chord->leave, 1.0);
    return std::nullopt;
}

double Bumpy::typical_slope(double level) const {
    constexpr int kDirections = 2000; // spread evenly on a golden spiral
    std::vector<double> slopes;
    for (int n = 0; n < kDirections; ++n) {
        const double z = 1.0 - (2.0 * n + 1.0) / kDirections;
        const double angle = n * std::numbers::pi * (3.0 - std::sqrt(5.0));
        const double flat = std::sqrt(1.0 - z * z);
        const Vec3 u(flat * std::cos(angle), flat * std::sin(angle), z);
        const double r = radius + level + amplitude * bumps_at(u, frequency()).s;
        if (r > internal::kSingular) slopes.push_back(glm::length(sample(r * u).slope));
    }
    if (slopes.empty()) return 0.0;
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    return *middle;
}

} // namespace

std::unique_ptr<ScalarField> make_bumpy_cavity(double radius_m, double amplitude_m,
                                               double wavelength_m) {
    internal::require_positive("bumpy_cavity", "radius", radius_m);
    internal::require_positive("bumpy_cavity", "amplitude", amplitude_m);
    internal::require_positive("bumpy_cavity", "wavelength", wavelength_m);
    if (amplitude_m >= radius_m)
        throw std::invalid_argument("bumpy_cavity: amplitude = " + std::to_string(amplitude_m) +
                                    " m, radius = " + std::to_string(radius_m) +
                                    " m; give an amplitude below the radius");
    return internal::make_analytic(Bumpy{radius_m, amplitude_m, wavelength_m});
}

} // namespace palpate
