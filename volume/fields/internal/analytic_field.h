// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include <palpate/volume/scalar_field.h>

/// What analytic fields share. A shape is a small copyable struct with
///   FieldSample sample(const Vec3&), double value(const Vec3&), Box bounds(double
///   level), double feature_size_m(), double patch_cosine(), double typical_slope(double level),
///   and std::optional<double> root(from, along, level): the first root on from + t along, t in
///   [0,1], to rounding; asked only when the value at `from` is below the level, and for
///   coordinates that are finite. A shape of flat faces has a double relief_limit_m(), too.
namespace palpate::internal {

/// From the centre of a sphere, the circle or the axis of a torus: nearer than this, m, the
/// direction is rounding. It is far below what any device resolves, and keeps 1 / distance, a
/// curvature, finite.
inline constexpr double kSingular = 1e-12;

/// Length of a vector without overflow of its square.                                   [loop]
inline double safe_length(const Vec3& v) noexcept { return std::hypot(v.x, v.y, v.z); }
/// The same in two dimensions. Not std::hypot() of two numbers, which is the C library's: its last
/// bit is another one on another kind of processor.
inline double safe_length(double x, double y) noexcept { return std::hypot(x, y, 0.0); }

/// The point at t of a segment.                                                         [loop]
inline Vec3 point_at(const Vec3& from, const Vec3& along, double t) noexcept {
    return from + t * along;
}

/// The largest t' <= t, up to a few roundings, where the value is below the level: the closed forms
/// are right to rounding, on either side. `from` itself must be below. [loop]
template <typename Shape>
double on_lower_side(const Shape& shape, const Vec3& from, const Vec3& along, double t,
                     double level) noexcept {
    double back = 0x1p-53; // half of the spacing of doubles below 1
    while (t > 0.0 && shape.value(point_at(from, along, t)) >= level) {
        t -= back; // ends: `back` exceeds 1 after 54 rounds
        back *= 2.0;
    }
    return std::max(t, 0.0);
}

template <typename Shape>
class AnalyticSampler final : public FieldSampler {
public:
    explicit AnalyticSampler(const Shape& shape) noexcept : shape_(shape) {}

    FieldSample sample(const Vec3& point) noexcept override {
        ++samples_;
        FieldSample s = shape_.sample(point);
        s.gradient = s.slope;
        s.valid = true;
        return s;
    }

    double value(const Vec3& point) noexcept override {
        ++samples_;
        return shape_.value(point);
    }

    std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                     double level) noexcept override {
        ++roots_;
        const Vec3 along = to - from;
        if (!is_finite(from) || !is_finite(along) || shape_.value(from) >= level) return 0.0;
        const std::optional<double> t = shape_.root(from, along, level);
        if (!t) return std::nullopt;
        return on_lower_side(shape_, from, along, *t, level);
    }

private:
    Shape shape_;
};

template <typename Shape>
class AnalyticField final : public ScalarField {
public:
    explicit AnalyticField(const Shape& shape) : shape_(shape) {}

    std::unique_ptr<FieldSampler> make_sampler() const override {
        return std::make_unique<AnalyticSampler<Shape>>(shape_);
    }
    Box bounds() const override { return shape_.bounds(0.0); }
    Box bounds_at(double level) const override { return shape_.bounds(level); }
    double feature_size_m() const noexcept override { return shape_.feature_size_m(); }
    double relief_limit_m() const noexcept override {
        if constexpr (requires { shape_.relief_limit_m(); }) return shape_.relief_limit_m();
        return feature_size_m();
    }
    double patch_cosine() const noexcept override { return shape_.patch_cosine(); }
    double typical_slope(double level) const override { return shape_.typical_slope(level); }

private:
    Shape shape_;
};

template <typename Shape>
std::unique_ptr<ScalarField> make_analytic(const Shape& shape) {
    return std::make_unique<AnalyticField<Shape>>(shape);
}

/// Throws std::invalid_argument unless the parameter is finite and > 0.                 [setup]
inline void require_positive(const char* field, const char* name, double value) {
    if (!(std::isfinite(value) && value > 0.0))
        throw std::invalid_argument(std::string(field) + ": " + name + " = " +
                                    std::to_string(value) + "; give a finite number > 0");
}

/// The cube of half-edge `half_m` around the origin.                                    [any]
inline Box centred_cube(double half_m) { return {Vec3(-half_m), Vec3(half_m)}; }

/// Bounds are this much larger than the surface: extraction wants room around it.
inline constexpr double kBoundsMargin = 1.1;

/// Smooth surfaces: normals within 26 degrees belong to one patch.
inline constexpr double kSmoothPatch = 0.9;

/// Flat faces: only rounding separates normals of one patch.
inline constexpr double kFlatPatch = 0.99999;

/// Flat faces turn nowhere; their feature size is a length that limits no step, and stays finite to
/// be halved and compared, m.
inline constexpr double kFlatFeature = 1.0;

} // namespace palpate::internal
