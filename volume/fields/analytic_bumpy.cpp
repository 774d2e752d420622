// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/analytic_fields.h>

#include <array>
#include <numbers>
#include <vector>

#include <palpate/volume/fields/internal/analytic_field.h>
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

    std::optional<double> root(const Vec3& from, const Vec3& along, double level) const noexcept;

    Box bounds() const {
        return internal::centred_cube(internal::kBoundsMargin * (radius + amplitude));
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

/// Searches a stretch [a,b] of a segment for the first root, with a proof for what it passes.
///
/// Along the segment f'' >= -bend, so on an interval of length h between values f_0 and f_1 the
/// field stays below max(f_0, f_1) + bend h^2 / 8; and where f' at its start exceeds bend h it
/// grows throughout. With v the direction, u = x/|x|, q = u.v, p = |v - q u|, p^2 + q^2 = 1, from
/// the Hessian above:
///   -f'' <= amplitude / r^2 (|H| p^2 + |u.g| p^2 + 2 |g| p |q|),  |H| <= w^2, |g| <= w, |u.g| <=
///   w, 2 p |q| <= 1.
/// The bounds: |g|^2 / w^2 is linear in each sin^2, hence largest where those are 0 or 1, where it
/// is at most 1. A product of three sines is a quarter of four sines of (+-x +-y +-z) w; their
/// second derivatives along a unit vector add up to w^2.
class BumpySearch {
public:
    BumpySearch(const Bumpy& shape, const Vec3& from, const Vec3& along, double level) noexcept
        : shape_(shape), from_(from), along_(along), level_(level),
          length_(internal::safe_length(along)) {
        // The rounding of a position, as t: nothing is resolved below it.
        resolution_ = std::max(0x1p-50, 0x1p-52 * shape.radius / length_);
    }

    /// The first root in [a,b], where the field is not nearer to the origin than `nearest`. Where
    /// the evaluations do not suffice for a proof, the start of what is not proven.
    std::optional<double> first_in(double a, double b, double nearest) noexcept {
        const double w = shape_.frequency();
        const double bend =
            shape_.amplitude / nearest / nearest * (w * w + 2.0 * w) * length_ * length_;
        std::array<End, kMaxDepth> later;
        int depth = 0;
        End start{a, excess(a)};
        End end{b, excess(b)};
        while (true) {
            const double h = end.t - start.t;
            if (std::max(start.f, end.f) + 0.125 * bend * h * h < 0.0) {
                if (depth == 0) return std::nullopt;
                start = end;
                end = later[static_cast<std::size_t>(--depth)];
                continue;
            }
            if (start.f >= 0.0 || h <= resolution_ || depth == kMaxDepth ||
                evaluations_ >= kMaxEvaluations)
                return start.t;
            if (end.f >= 0.0 && slope(start.t) > bend * h) return growing_root(start, end);
            later[static_cast<std::size_t>(depth++)] = end;
            const double middle = start.t + 0.5 * h;
            end = {middle, excess(middle)};
        }
    }

private:
    struct End {
        double t = 0.0;
        double f = 0.0; // value - level
    };

    double excess(double t) noexcept {
        ++evaluations_;
        return shape_.value(internal::point_at(from_, along_, t)) - level_;
    }
    double slope(double t) noexcept {
        evaluations_ += 2; // costs about as much as two values
        return glm::dot(shape_.sample(internal::point_at(from_, along_, t)).slope, along_);
    }

    /// The root between a < 0 <= b where the field grows: regula falsi with halved weights
    /// (Illinois).
    double growing_root(End a, End b) noexcept {
        double nudge = 0.5 * resolution_;
        double weight_a = a.f;
        double weight_b = b.f;
        int side = 0; // of the last step: an end that stays for a second one is halved
        for (int n = 0; n < kMaxRootSteps && b.t - a.t > resolution_; ++n) {
            double t = n % 4 == 3
                           ? 0.5 * (a.t + b.t)
                           : a.t - weight_a * (b.t - a.t) / (weight_b - weight_a); // divisor > 0
            // From either end only the other end is pulled in: step over the root when there.
            if (t - a.t < nudge || b.t - t < nudge) {
                t = t - a.t < nudge ? a.t + nudge : b.t - nudge;
                nudge *= 4.0;
            }
            t = std::clamp(t, a.t, b.t);
            const double f = excess(t);
            if (f < 0.0) {
                a = {t, f};
                weight_a = f;
                weight_b = side < 0 ? 0.5 * weight_b : b.f;
                side = -1;
            } else {
                b = {t, f};
                weight_b = f;
                weight_a = side > 0 ? 0.5 * weight_a : a.f;
                side = 1;
            }
        }
        return a.t;
    }

    static constexpr int kMaxDepth = 64; // halvings; resolution_ ends them after 50
    static constexpr int kMaxEvaluations =
        512; // about 40 us; a segment of 100 mm along the bumps needs about 300
    static constexpr int kMaxRootSteps = 64;

    const Bumpy& shape_;
    Vec3 from_;
    Vec3 along_;
    double level_;
    double length_;
    double resolution_ = 0.0;
    int evaluations_ = 0;
};

std::optional<double> Bumpy::root(const Vec3& from, const Vec3& along,
                                  double level) const noexcept {
    constexpr double kStill = 1e-100; // m
    if (internal::safe_length(along) < kStill) return std::nullopt;
    // Inside this sphere the field is below the level whatever the bumps are.
    const double free_radius = radius - amplitude + level;
    const std::optional<internal::SphereChord> chord =
        internal::sphere_chord(from, along, free_radius);
    const double nearest = std::max(free_radius, internal::kSingular);
    BumpySearch search(*this, from, along, level);
    if (!chord || chord->enter >= 1.0 || chord->leave <= 0.0)
        return search.first_in(0.0, 1.0, nearest);
    if (chord->enter > 0.0)
        if (const std::optional<double> t = search.first_in(0.0, chord->enter, nearest)) return t;
    if (chord->leave < 1.0) return search.first_in(chord->leave, 1.0, nearest);
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
