// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <optional>

#include <palpate/volume/scalar_field.h>

namespace palpate::test {

/// Matter where n.p < c.
struct Plane {
    Vec3 n{0.0, 0.0, 1.0};
    double c = 0.0; ///< m
    double depth(const Vec3& p) const { return c - glm::dot(n, p); }
};

/// The distance into it, exact, with the root of a chord on the side in front.
class HalfSpace final : public ScalarField {
public:
    explicit HalfSpace(const Plane& plane) : plane_(plane) {}
    std::unique_ptr<FieldSampler> make_sampler() const override {
        return std::make_unique<Sampler>(plane_);
    }
    Box bounds() const override { return {Vec3(-1.0), Vec3(1.0)}; }
    double feature_size_m() const noexcept override { return 0.05; }
    double patch_cosine() const noexcept override { return 0.9; }
    double typical_slope(double) const override { return 1.0; }

private:
    class Sampler final : public FieldSampler {
    public:
        explicit Sampler(const Plane& plane) : plane_(plane) {}
        FieldSample sample(const Vec3& p) noexcept override {
            FieldSample s;
            s.valid = true;
            s.value = plane_.depth(p);
            s.slope = s.gradient = -plane_.n;
            return s;
        }
        double value(const Vec3& p) noexcept override { return plane_.depth(p); }
        std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                         double level) noexcept override {
            const double begin = plane_.depth(from) - level, end = plane_.depth(to) - level;
            if (begin >= 0.0) return 0.0;
            if (end < 0.0) return std::nullopt;
            // On the side below the level: back by roundings of the chord, doubled each time.
            double t = begin / (begin - end);
            for (double back = 1e-16; t > 0.0 && plane_.depth(from + t * (to - from)) >= level;
                 back *= 2.0)
                t = std::max(0.0, t - back);
            return t;
        }

    private:
        Plane plane_;
    };
    Plane plane_;
};

} // namespace palpate::test
