// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <palpate/volume/scalar_field.h>

namespace palpate::test {

/// A solid ball as a program would hand it in: the depth below its surface, m. What is asked of it
/// may be changed by `spoil`, for tests of what a field promises.
class HostBall : public ScalarField {
public:
    struct Spoil {
        double slope_factor = 1.0;   ///< of slope and gradient
        double value_offset_m = 0.0; ///< of value(), not of sample()
        double feature_size_m = 0.0; ///< 0: as it is
        double root_factor = 1.0;    ///< of first_root()
        double turn_factor = 1.0;    ///< of the hessian
        bool has_roots = true;
        bool is_finite = true;
        bool has_sampler = true;
        bool has_bounds = true;
    };
    explicit HostBall(double radius_m) : HostBall(radius_m, Spoil{}) {}
    HostBall(double radius_m, const Spoil& spoil) : radius_m_(radius_m), spoil_(spoil) {}

    std::unique_ptr<FieldSampler> make_sampler() const override {
        if (!spoil_.has_sampler) return nullptr;
        return std::make_unique<Sampler>(*this);
    }
    Box bounds() const override {
        return spoil_.has_bounds ? Box{Vec3(-1.2 * radius_m_), Vec3(1.2 * radius_m_)} : Box{};
    }
    double feature_size_m() const noexcept override {
        return spoil_.feature_size_m != 0.0 ? spoil_.feature_size_m : radius_m_;
    }
    double patch_cosine() const noexcept override { return 0.9; }
    double typical_slope(double level) const override { return level < radius_m_ ? 1.0 : 0.0; }

private:
    class Sampler final : public FieldSampler {
    public:
        explicit Sampler(const HostBall& ball) : ball_(ball) {}

        FieldSample sample(const Vec3& p) noexcept override {
            ++samples_;
            FieldSample s;
            const double r = glm::length(p);
            s.valid = true;
            s.value = ball_.spoil_.is_finite ? ball_.radius_m_ - r
                                             : std::numeric_limits<double>::quiet_NaN();
            if (r < 1e-12) return s;
            const Vec3 u = p / r;
            s.slope = s.gradient = -ball_.spoil_.slope_factor * u;
            s.hessian = (-ball_.spoil_.turn_factor / r) * (Mat3(1.0) - glm::outerProduct(u, u));
            return s;
        }
        double value(const Vec3& p) noexcept override {
            ++samples_;
            return ball_.radius_m_ - glm::length(p) + ball_.spoil_.value_offset_m;
        }
        /// |from + t along| = radius - level, the first t.
        std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                         double level) noexcept override {
            ++roots_;
            const Vec3 along = to - from;
            const double r = ball_.radius_m_ - level;
            const double a = glm::dot(along, along), b = glm::dot(from, along);
            const double c = glm::dot(from, from) - r * r;
            if (!(c > 0.0)) return 0.0;
            const double root = b * b - a * c;
            if (!ball_.spoil_.has_roots || !(b < 0.0) || !(root > 0.0)) return std::nullopt;
            double t = c / (-b + std::sqrt(root)) * ball_.spoil_.root_factor;
            if (!(t <= 1.0)) return std::nullopt;
            // On the side below the level; in ever longer steps, as short ones may be rounding.
            double back = std::numeric_limits<double>::epsilon() * t;
            for (; t > 0.0 && ball_.spoil_.root_factor == 1.0 &&
                   ball_.radius_m_ - glm::length(from + t * along) >= level;
                 back *= 2.0)
                t = std::max(0.0, t - back);
            return t;
        }

    private:
        const HostBall& ball_;
    };

    double radius_m_;
    Spoil spoil_;
};

} // namespace palpate::test
