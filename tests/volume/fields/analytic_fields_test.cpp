// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/analytic_fields.h>

#include <cfenv>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/fields/shared_samples.h>

#include <tests/support/dense_reference.h>

namespace palpate {
namespace {

using test::random_direction;
using test::random_point;

struct Named {
    std::string name;
    std::unique_ptr<ScalarField> field;
    std::function<double(const Vec3&)> formula; // the value, written down again
    bool flat = false;
};

double wedge_formula(const Vec3& p, double angle_deg) {
    const double half = 0.5 * angle_deg * std::numbers::pi / 180.0;
    const double right = -std::cos(half) * p.x - std::sin(half) * p.z; // into the face at x > 0
    const double left = std::cos(half) * p.x - std::sin(half) * p.z;
    return angle_deg < 180.0 ? std::min(right, left) : std::max(right, left);
}

std::vector<Named> all_fields() {
    const auto length = [](const Vec3& p) { return std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z); };
    const auto bumpy = [length](const Vec3& p) {
        const Vec3 u = p / length(p);
        const double w = 2.0 * std::numbers::pi * 0.05 / 0.015;
        return length(p) -
               (0.05 + 0.001 * std::sin(w * u.x) * std::sin(w * u.y) * std::sin(w * u.z));
    };
    const auto torus = [](const Vec3& p) {
        const double out = std::sqrt(p.x * p.x + p.y * p.y) - 0.03;
        return 0.01 - std::sqrt(out * out + p.z * p.z);
    };
    std::vector<Named> all;
    all.push_back({"sphere_cavity", make_sphere_cavity(0.05),
                   [=](const Vec3& p) { return length(p) - 0.05; }});
    all.push_back(
        {"solid_sphere", make_solid_sphere(0.05), [=](const Vec3& p) { return 0.05 - length(p); }});
    all.push_back({"bumpy_cavity", make_bumpy_cavity(0.05, 0.001, 0.015), bumpy});
    all.push_back({"torus", make_torus(0.03, 0.01), torus});
    all.push_back(
        {"slab", make_slab(0.01), [](const Vec3& p) { return 0.005 - std::abs(p.z); }, true});
    for (const double angle : {10.0, 90.0, 175.0, 185.0, 300.0})
        all.push_back({"wedge " + std::to_string(angle), make_wedge(angle),
                       [angle](const Vec3& p) { return wedge_formula(p, angle); }, true});
    return all;
}

TEST(AnalyticFields, ValuesAreTheirFormulas) {
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name + ", seed 1");
        std::mt19937_64 random(1);
        const auto sampler = f.field->make_sampler();
        for (int n = 0; n < 2000; ++n) {
            const Vec3 p = random_point(random, f.field->bounds());
            // lengths of 0.1 m, some twenty roundings; the bumps' phases of 20 rad add 1e-3 m * 20
            // * 1e-16
            ASSERT_NEAR(sampler->value(p), f.formula(p), 1e-15);
            const FieldSample s = sampler->sample(p);
            ASSERT_EQ(s.value, sampler->value(p));
            ASSERT_TRUE(s.valid);
            ASSERT_EQ(s.slope, s.gradient);
        }
    }
}

TEST(AnalyticFields, WedgeLiesBelowItsEdge) {
    // Half the angle to either side of -z, at 10 degrees inside and outside of each face.
    for (const double angle : {40.0, 90.0, 200.0, 320.0}) {
        const auto sampler = make_wedge(angle)->make_sampler();
        EXPECT_GT(sampler->value({0.0, 0.3, -0.01}), 0.0);
        EXPECT_LT(sampler->value({0.0, -0.3, 0.01}), 0.0);
        for (const double side : {-1.0, 1.0})
            for (const double off : {-10.0, 10.0}) {
                const double a = (0.5 * angle + off) * std::numbers::pi / 180.0;
                const double value =
                    sampler->value({side * 0.01 * std::sin(a), 0.0, -0.01 * std::cos(a)});
                EXPECT_EQ(value > 0.0, off < 0.0) << angle << " " << side << " " << off;
                // the near face is 0.01 sin(10 deg) away
                EXPECT_NEAR(std::abs(value), 0.01 * std::sin(10.0 * std::numbers::pi / 180.0),
                            1e-15);
            }
    }
}

TEST(AnalyticFields, GradientAndHessianAreDerivatives) {
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name + ", seed 2");
        std::mt19937_64 random(2);
        const auto sampler = f.field->make_sampler();
        for (int n = 0; n < 2000; ++n) {
            const Vec3 p = random_point(random, f.field->bounds());
            const double axial = std::hypot(p.x, p.y);
            // 2 mm from what has no derivative: axes, centres, kinks
            if (axial < 0.002 || std::hypot(axial - 0.03, p.z) < 0.002 || std::abs(p.x) < 0.002 ||
                std::abs(p.z) < 0.002 || glm::length(p) < 0.02)
                continue;
            const FieldSample s = sampler->sample(p);
            const double h = 1e-5; // m
            for (int a = 0; a < 3; ++a) {
                Vec3 step(0.0);
                step[a] = h;
                const FieldSample above = sampler->sample(p + step);
                const FieldSample below = sampler->sample(p - step);
                // Truncation h^2/6 f''': the bumps' at 20 mm from the origin, amplitude (w/r)^3
                // = 1.1e6 per m^2, times the few terms of the chain rule; rounding 1e-17 / h.
                ASSERT_NEAR((above.value - below.value) / (2.0 * h), s.slope[a], 1e-4);
                const Vec3 by_a = (above.slope - below.slope) / (2.0 * h);
                // h^2/6 f'''' = 1.7e-11 * amplitude (w/r)^4 = 1.2e9 per m^3, again times a few
                ASSERT_LT(glm::length(by_a - s.hessian[a]), 0.1) << p.x << " " << p.y << " " << p.z;
            }
        }
    }
}

TEST(AnalyticFields, SphereDerivativesConvergeToRounding) {
    // The bound above is loose for the sake of the bumps: spheres and torus are smoother.
    for (const auto& field :
         {make_sphere_cavity(0.05).release(), make_torus(0.03, 0.01).release()}) {
        const std::unique_ptr<ScalarField> owned(field);
        const auto sampler = owned->make_sampler();
        const Vec3 p(0.031, 0.012, 0.007), v = glm::normalize(Vec3(1.0, -2.0, 0.5));
        const double h = 1e-6;
        const Vec3 by_v =
            (sampler->sample(p + h * v).slope - sampler->sample(p - h * v).slope) / (2.0 * h);
        // h^2 / distance^3 = 1e-12 / 1e-6 per m, rounding 1e-16 / h
        EXPECT_LT(glm::length(by_v - sampler->sample(p).hessian * v), 1e-5);
    }
}

TEST(AnalyticFields, NothingIsNotANumber) {
    const std::vector<Vec3> points{Vec3(0.0),           {0.03, 0.0, 0.0},       {0.0, 0.0, 0.05},
                                   {1e-14, 0.0, 0.0},   {1e-300, 0.0, 0.0},     {0.0, 1e-320, 0.0},
                                   {1e150, 1e150, 0.0}, {-1e300, 1e300, 1e300}, {0.0, 0.0, 1e300}};
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name);
        const auto sampler = f.field->make_sampler();
        for (const Vec3& p : points) {
            const FieldSample s = sampler->sample(p);
            EXPECT_TRUE(std::isfinite(s.value));
            EXPECT_TRUE(is_finite(s.slope) && is_finite(s.hessian[0]) && is_finite(s.hessian[1]) &&
                        is_finite(s.hessian[2]))
                << p.x << " " << p.y << " " << p.z;
            EXPECT_TRUE(s.valid);
            for (const Vec3& q : points) {
                const auto t = sampler->first_root(p, q, 0.0);
                EXPECT_TRUE(!t || (*t >= 0.0 && *t <= 1.0));
            }
        }
    }
}

TEST(AnalyticFields, SingularPointsHaveNoGradientButAValue) {
    const auto cavity = make_sphere_cavity(0.05)->make_sampler();
    EXPECT_EQ(cavity->sample(Vec3(0.0)).slope, Vec3(0.0));
    EXPECT_EQ(cavity->sample(Vec3(0.0)).value, -0.05);
    const auto ring = make_torus(0.03, 0.01)->make_sampler();
    EXPECT_EQ(ring->sample({0.03, 0.0, 0.0}).slope, Vec3(0.0));
    EXPECT_EQ(ring->sample({0.03, 0.0, 0.0}).value, 0.01);
    EXPECT_EQ(ring->sample({0.0, 0.0, 0.02}).slope, Vec3(0.0));
}

/// Segments of all sizes through the field's bounds; half of them near the surface.
struct Segment {
    Vec3 from, to;
};
Segment random_segment(std::mt19937_64& random, const ScalarField& field, FieldSampler& sampler) {
    Vec3 middle = random_point(random, field.bounds());
    if (random() % 2 == 0)
        for (int n = 0; n < 3; ++n) {
            const FieldSample s = sampler.sample(middle);
            middle -= 0.95 * s.value * s.slope / std::max(squared_length(s.slope), 0.1);
        }
    const double length =
        std::pow(10.0, -5.0 + 4.3 * std::uniform_real_distribution<double>()(random));
    const Vec3 half = 0.5 * length * random_direction(random);
    return {middle - half, middle + half};
}

TEST(AnalyticFields, FirstRootIsFirstAgainstDenseSampling) {
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name + ", seed 3");
        std::mt19937_64 random(3);
        const auto sampler = f.field->make_sampler();
        const auto value = [&](const Vec3& p) { return sampler->value(p); };
        const double rounding = 1e-15; // m: coordinates of 0.2 m, ten roundings
        int found = 0;
        std::feclearexcept(FE_ALL_EXCEPT);
        for (int n = 0; n < 20'000; ++n) {
            const Segment s = random_segment(random, *f.field, *sampler);
            const double level = 1e-3 * std::uniform_real_distribution<double>(-1.0, 1.0)(random);
            const std::optional<double> t = sampler->first_root(s.from, s.to, level);
            ASSERT_LT(t && *t == 0.0
                          ? level - 1.0
                          : test::highest_sampled(value, s.from, s.to, t.value_or(1.0), 300),
                      level + rounding)
                << "case " << n;
            if (!t) continue;
            ASSERT_TRUE(*t >= 0.0 && *t <= 1.0);
            if (value(s.from) >= level) {
                ASSERT_EQ(*t, 0.0);
                continue;
            }
            ++found;
            const Vec3 root = s.from + *t * (s.to - s.from);
            ASSERT_LT(value(root), level);
            // 1e-15 of the length, up to 0.2 m, on a slope near 1; the torus' quartic cancels 1/(1
            // - r/R) fold
            ASSERT_NEAR(value(root), level, 1e-14) << "case " << n;
        }
        EXPECT_GT(found, 1000);
        EXPECT_FALSE(std::fetestexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)); // loops trap them
    }
}

TEST(AnalyticFields, TouchesAreHitJustInsideAndMissedJustOutside) {
    const auto sphere = make_solid_sphere(0.05)->make_sampler();
    const auto ring = make_torus(0.03, 0.01)->make_sampler();
    const auto slab = make_slab(0.01)->make_sampler();
    const double off = 1e-12; // m: a ten thousandth of an atom, well above rounding
    for (const double side : {-off, off}) {
        const bool hit = side < 0.0;
        EXPECT_EQ(
            sphere->first_root({-0.1, 0.0, 0.05 + side}, {0.1, 0.0, 0.05 + side}, 0.0).has_value(),
            hit);
        EXPECT_EQ(ring->first_root({-0.03, -0.1, 0.01 + side}, {-0.03, 0.1, 0.01 + side}, 0.0)
                      .has_value(),
                  hit);
        EXPECT_EQ(
            ring->first_root({0.04 + side, -0.1, 0.0}, {0.04 + side, 0.1, 0.0}, 0.0).has_value(),
            hit);
        EXPECT_EQ(slab->first_root({0.0, 0.0, 0.1}, {0.0, 0.0, 0.005 + side}, 0.0).has_value(),
                  hit);
    }
}

TEST(AnalyticFields, SegmentsThatLeaveTheSurfaceAreFree) {
    // A proxy that rests just below the level moves away: nothing must hold it, whichever side
    // rounding took.
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name + ", seed 4");
        std::mt19937_64 random(4);
        const auto sampler = f.field->make_sampler();
        int tried = 0;
        for (int n = 0; n < 2000; ++n) {
            const Segment s = random_segment(random, *f.field, *sampler);
            const std::optional<double> t = sampler->first_root(s.from, s.to, 0.0);
            if (!t || *t == 0.0) continue;
            const Vec3 root = s.from + *t * (s.to - s.from);
            const Vec3 away = root - 1e-4 * sampler->sample(root).slope;
            if (sampler->value(away) > -1e-6) continue; // across a narrow notch into its other face
            ++tried;
            ASSERT_FALSE(sampler->first_root(root, away, 1e-15).has_value()) << n;
        }
        EXPECT_GT(tried, 200);
    }
}

TEST(AnalyticFields, DegenerateSegments) {
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name + ", seed 5");
        std::mt19937_64 random(5);
        const auto sampler = f.field->make_sampler();
        for (int n = 0; n < 200; ++n) {
            const Vec3 p = random_point(random, f.field->bounds());
            const std::optional<double> t = sampler->first_root(p, p, 0.0);
            ASSERT_EQ(t.has_value(), f.formula(p) >= 0.0);
            ASSERT_EQ(t.value_or(0.0), 0.0);
        }
        const double nan = std::nan("");
        EXPECT_EQ(sampler->first_root({nan, 0.0, 0.0}, Vec3(0.0), 0.0), std::optional<double>(0.0));
    }
}

TEST(AnalyticFields, BumpyProvesLongStrokesWithinItsEvaluations) {
    // At the cap first_root returns the start of what is not proven: no root is there. Strokes of
    // up to 100 mm must not get there.
    SCOPED_TRACE("seed 6");
    std::mt19937_64 random(6);
    const auto sampler = make_bumpy_cavity(0.05, 0.001, 0.015)->make_sampler();
    for (int n = 0; n < 20'000; ++n) {
        const Vec3 from = 0.0485 * random_direction(random);
        const Vec3 to = from + 0.1 * std::uniform_real_distribution<double>()(random) *
                                   random_direction(random);
        const std::optional<double> t = sampler->first_root(from, to, 0.0);
        if (t && *t > 0.0) {
            ASSERT_NEAR(sampler->value(from + *t * (to - from)), 0.0, 1e-14);
        }
    }
}

TEST(AnalyticFields, TellTheirScale) {
    EXPECT_EQ(make_sphere_cavity(0.05)->feature_size_m(), 0.05);
    EXPECT_EQ(make_torus(0.03, 0.01)->feature_size_m(), 0.01);
    EXPECT_NEAR(make_bumpy_cavity(0.05, 0.001, 0.015)->feature_size_m(), 0.0057, 1e-4); // 5.7 mm
    EXPECT_EQ(make_bumpy_cavity(0.05, 1e-6, 0.5)->feature_size_m(), 0.05);
    EXPECT_EQ(make_slab(0.01)->patch_cosine(), make_wedge(90.0)->patch_cosine());
    EXPECT_LT(make_torus(0.03, 0.01)->patch_cosine(), make_slab(0.01)->patch_cosine());
}

TEST(AnalyticFields, ReliefIsNoHigherThanWhatItStandsOn) {
    EXPECT_EQ(make_solid_sphere(0.05)->relief_limit_m(), 0.05);
    EXPECT_EQ(make_torus(0.03, 0.01)->relief_limit_m(), 0.01);
    EXPECT_EQ(make_slab(0.02)->relief_limit_m(), 0.01);
    // Faces without an end, felt within a hand's reach.
    EXPECT_EQ(make_wedge(90.0)->relief_limit_m(), 0.1);
    EXPECT_EQ(make_slab(2.0)->relief_limit_m(), 0.1);
    EXPECT_EQ(share_samples(make_slab(0.02))->relief_limit_m(), 0.01);
}

TEST(AnalyticFields, TypicalSlopeIsThatOfADistanceOrNothing) {
    for (const Named& f : all_fields()) {
        SCOPED_TRACE(f.name);
        // the bumps' slope is sqrt(1 + (amplitude/r)^2 |g|^2) with |g| <= w: at most sqrt(1 +
        // 0.42^2) = 1.085
        EXPECT_GE(f.field->typical_slope(0.0), 1.0);
        EXPECT_LE(f.field->typical_slope(0.0), 1.085);
    }
    EXPECT_EQ(make_solid_sphere(0.05)->typical_slope(0.06), 0.0);
    EXPECT_EQ(make_sphere_cavity(0.05)->typical_slope(-0.06), 0.0);
    EXPECT_EQ(make_torus(0.03, 0.01)->typical_slope(0.02), 0.0);
    EXPECT_EQ(make_slab(0.01)->typical_slope(0.006), 0.0);
    EXPECT_EQ(make_bumpy_cavity(0.05, 0.001, 0.015)->typical_slope(-0.06), 0.0);
}

TEST(AnalyticFields, BoundsHoldTheSurface) {
    for (const Named& f : all_fields()) {
        if (f.flat) continue; // without end
        const bool cavity = f.name.find("cavity") != std::string::npos;
        const auto sampler = f.field->make_sampler();
        EXPECT_EQ(f.field->bounds_at(0.0).upper, f.field->bounds().upper);
        // Also a level far off the surface that the formula is named after, on both sides.
        for (const double level : {0.0, -0.02, 0.02}) {
            SCOPED_TRACE(f.name + ", seed 7, level " + std::to_string(level));
            std::mt19937_64 random(7);
            const Box box = f.field->bounds_at(level);
            for (int n = 0; n < 3000; ++n) {
                Vec3 p = random_point(random, box);
                const int axis = static_cast<int>(random() % 3);
                p[axis] = (random() % 2 == 0 ? box.lower : box.upper)[axis];
                ASSERT_EQ(sampler->value(p) > level, cavity);
            }
        }
    }
}

// Of faces without an end the part that a hand reaches.
TEST(AnalyticFields, BoundsOfFlatFacesHoldAPartOfThem) {
    for (const double level : {0.0, -0.3, 0.004}) {
        SCOPED_TRACE(level);
        const Box slab = make_slab(0.01)->bounds_at(level);
        EXPECT_LT(slab.lower.z, -(0.005 - level));
        EXPECT_GT(slab.upper.z, 0.005 - level);
        for (const double angle : {10.0, 90.0, 175.0, 300.0}) {
            const auto wedge = make_wedge(angle);
            const double half = 0.5 * angle * std::numbers::pi / 180.0;
            // The foot of the origin on the right face; if that is beyond the edge, the edge.
            Vec3 foot = -level * Vec3{std::cos(half), 0.0, std::sin(half)};
            if (foot.x < 0.0) foot = {0.0, 0.0, -level / std::sin(half)};
            EXPECT_NEAR(wedge->make_sampler()->value(foot), level, 1e-13) << angle;
            const Box box = wedge->bounds_at(level);
            EXPECT_EQ(glm::clamp(foot, box.lower, box.upper), foot) << angle;
        }
    }
}

TEST(AnalyticFields, RefuseBadParameters) {
    const double infinite = std::numeric_limits<double>::infinity();
    for (const double bad : {0.0, -1.0, infinite, std::nan("")}) {
        EXPECT_THROW(make_sphere_cavity(bad), std::invalid_argument);
        EXPECT_THROW(make_solid_sphere(bad), std::invalid_argument);
        EXPECT_THROW(make_slab(bad), std::invalid_argument);
        EXPECT_THROW(make_torus(bad, 0.01), std::invalid_argument);
        EXPECT_THROW(make_torus(0.03, bad), std::invalid_argument);
        EXPECT_THROW(make_bumpy_cavity(bad, 0.001, 0.01), std::invalid_argument);
        EXPECT_THROW(make_bumpy_cavity(0.05, bad, 0.01), std::invalid_argument);
        EXPECT_THROW(make_bumpy_cavity(0.05, 0.001, bad), std::invalid_argument);
        EXPECT_THROW(make_wedge(bad), std::invalid_argument);
    }
    EXPECT_THROW(make_wedge(180.0), std::invalid_argument);
    EXPECT_THROW(make_wedge(360.0), std::invalid_argument);
    EXPECT_THROW(make_torus(0.03, 0.03), std::invalid_argument);
    EXPECT_THROW(make_bumpy_cavity(0.05, 0.05, 0.01), std::invalid_argument);
}

TEST(AnalyticFields, SamplersCountTheirQueries) {
    const auto sampler = make_slab(0.01)->make_sampler();
    sampler->sample(Vec3(0.0));
    sampler->value(Vec3(0.0));
    sampler->first_root(Vec3(0.0), Vec3(1.0), 0.0);
    EXPECT_EQ(sampler->samples(), 2U);
    EXPECT_EQ(sampler->roots(), 1U);
}

} // namespace
} // namespace palpate
