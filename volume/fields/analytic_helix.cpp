// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/vector_field.h>

#include <cmath>
#include <numbers>

#include <palpate/volume/fields/internal/analytic_field.h>

namespace palpate {
namespace {

class HelixSampler final : public VectorSampler {
public:
    explicit HelixSampler(double rise) noexcept : rise_(rise) {}

    VectorSample sample(const Vec3& point) noexcept override {
        ++samples_;
        VectorSample s;
        if (!is_finite(point)) return s;
        const Vec3 along{-point.y, point.x, rise_};
        const double length = internal::safe_length(along); // >= rise > 0
        s.value = along / length;
        // d(w / |w|) = (dw - v (v . dw)) / |w|, with dw = (0, 1, 0) by x and (-1, 0, 0) by y.
        s.derivative[0] = (Vec3{0, 1, 0} - s.value.y * s.value) / length;
        s.derivative[1] = (Vec3{-1, 0, 0} + s.value.x * s.value) / length;
        s.valid = true;
        return s;
    }

private:
    double rise_; // m per radian
};

class Helix final : public VectorField {
public:
    Helix(double radius, double rise) noexcept : radius_(radius), rise_(rise) {}

    std::unique_ptr<VectorSampler> make_sampler() const override {
        return std::make_unique<HelixSampler>(rise_);
    }

    Box bounds() const override {
        const double turn = 2.0 * std::numbers::pi * rise_;
        return {{-internal::kBoundsMargin * radius_, -internal::kBoundsMargin * radius_, -turn},
                {internal::kBoundsMargin * radius_, internal::kBoundsMargin * radius_, turn}};
    }

    /// Curvature r / (r^2 + c^2) is largest at r = c.
    double feature_size_m() const noexcept override {
        const double r = std::min(radius_, rise_);
        return (r * r + rise_ * rise_) / r;
    }

private:
    double radius_; // m
    double rise_;   // m per radian, > 0
};

} // namespace

std::unique_ptr<VectorField> make_helix(double radius_m, double pitch_m) {
    internal::require_positive("helix", "radius", radius_m);
    internal::require_positive("helix", "pitch", pitch_m);
    return std::make_unique<Helix>(radius_m, pitch_m / (2.0 * std::numbers::pi));
}

} // namespace palpate
