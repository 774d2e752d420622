// SPDX-License-Identifier: Apache-2.0
// Spheres and bumps sampled on voxels, felt with `adaptive`: as near to the true surface as their
// interpolation is, and no stepping can be nearer (numerics 3.3).
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_field.h>

#include "tests/support/contact_loop.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::ContactLoop;

/// A true surface, free inside, and the probe's way behind it.
struct Truth {
    std::shared_ptr<const ScalarField> field;
    double radius_m;
    double amplitude_m; ///< of its bumps
};

Truth sphere() { return {make_sphere_cavity(0.02), 0.02, 0.0}; }
Truth bumpy() { return {make_bumpy_cavity(0.02, 1e-3, 15e-3), 0.02, 1e-3}; }

/// Its formula at the nodes of a grid that has no symmetry in common with it.
std::shared_ptr<const ScalarField> voxels(const Truth& truth, double spacing_m) {
    const double half = truth.radius_m + truth.amplitude_m + 5.0 * spacing_m;
    const int n = 2 * static_cast<int>(half / spacing_m) + 2;
    AffineTransform frame;
    frame.linear = spacing_m * Mat3(1.0);
    frame.offset = Vec3(-0.5 * (n - 1) * spacing_m) + spacing_m * Vec3{0.31, 0.17, -0.23};
    const auto formula = truth.field->make_sampler();
    return std::make_shared<GridField>(
        test::sampled({n, n, n}, frame, [&](const Vec3& p) { return formula->value(p); }),
        static_cast<float>(-truth.radius_m));
}

/// Twice round at 0.2 mm per frame, 2 to 3.5 mm behind the middle of the wall.
std::vector<Vec3> way(const Truth& truth) {
    std::vector<Vec3> probes;
    for (int i = 0; i < 1500; ++i) {
        const double angle = 0.2e-3 / 0.023 * i;
        const double r = truth.radius_m + 2.75e-3 + 0.75e-3 * std::sin(0.7 * angle);
        probes.push_back(r * Vec3{std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle)});
    }
    return probes;
}

/// The point of a field's level 0 whose gradient points at the probe, near `x`: Newton's step onto
/// the level and half of the way along it, four hundred times. Slow, and nothing like the loop.
Vec3 foot(FieldSampler& sampler, const Vec3& probe, Vec3 x) {
    for (int i = 0; i < 400; ++i) {
        const FieldSample here = sampler.sample(x);
        const Vec3 n = here.gradient / glm::length(here.gradient);
        const Vec3 along = probe - x - glm::dot(probe - x, n) * n;
        x += 0.4 * along - here.value / squared_length(here.slope) * here.slope;
    }
    return x;
}

/// How far the sampled level is from a true point of the surface, along the true normal, m: by
/// halving.
double off_along(const Vec3& normal, const Vec3& point, FieldSampler& sampled) {
    double low = -0.2e-3, high = 0.2e-3;
    EXPECT_LT(sampled.value(point + low * normal), 0.0);
    EXPECT_GT(sampled.value(point + high * normal), 0.0);
    for (int i = 0; i < 50; ++i) {
        const double middle = 0.5 * (low + high);
        (sampled.value(point + middle * normal) < 0.0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

struct Errors {
    double level = 0.0;    ///< to the true surface, rms, m
    double position = 0.0; ///< to the true surface's point that is nearest to the probe, rms, m
};

struct Comparison {
    Errors floor; ///< level: of the interpolation; position: of its slow twin's foot
    Errors loop;  ///< of `adaptive`
    double mean_evaluations = 0.0; ///< per frame; 4 is the goal for formulas (numerics 3.6)
};

Comparison compare(const Truth& truth, double spacing_m) {
    const auto field = voxels(truth, spacing_m);
    const auto formula = truth.field->make_sampler(), sampled = field->make_sampler();
    ContactLoop loop({}, test::one_surface(field));
    const std::vector<Vec3> probes = way(truth);
    loop.start((truth.radius_m - 2e-3) * glm::normalize(probes[0]));
    for (int i = 0; i < 20; ++i)
        loop.move(probes[0]);

    Comparison c;
    Vec3 true_foot = loop.proxy(), sampled_foot = loop.proxy();
    const auto level_of = [&](const Vec3& x) {
        const FieldSample s = formula->sample(x);
        return s.value / glm::length(s.slope); // second order in micrometres over millimetres
    };
    for (const Vec3& probe : probes) {
        c.mean_evaluations += loop.move(probe).evaluations / static_cast<double>(probes.size());
        true_foot = foot(*formula, probe, true_foot);
        sampled_foot = foot(*sampled, probe, sampled_foot);
        const FieldSample there = formula->sample(true_foot);
        const double off = off_along(there.slope / glm::length(there.slope), true_foot, *sampled);
        c.floor.level += off * off;
        c.floor.position += squared_length(sampled_foot - true_foot);
        c.loop.level += level_of(loop.proxy()) * level_of(loop.proxy());
        c.loop.position += squared_length(loop.proxy() - true_foot);
    }
    for (double* sum : {&c.floor.level, &c.floor.position, &c.loop.level, &c.loop.position})
        *sum = std::sqrt(*sum / static_cast<double>(probes.size()));
    return c;
}

class Reconstruction : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Spacing, Reconstruction, testing::Values(0.5e-3, 1e-3),
                         [](const testing::TestParamInfo<double>& of) {
                             return of.param < 0.7e-3 ? "HalfAMillimetre" : "OneMillimetre";
                         });

// A sphere's normals survive sampling, so that level and position are both within a tenth of what
// its interpolation is off by. That is t (1 - t) h^2 / 2 times the second derivative along each
// axis: h^2 / 6 R in the mean, with its scatter 1.04 times that.
TEST_P(Reconstruction, ASphereIsFeltAsWellAsItsVoxelsTell) {
    const Comparison c = compare(sphere(), GetParam());
    const double expected = GetParam() * GetParam() / (6.0 * 0.02);
    EXPECT_NEAR(c.floor.level, expected, 0.1 * expected) << "the floor itself";
    EXPECT_LE(c.loop.level, 1.1 * c.floor.level);
    EXPECT_LE(c.loop.position, 1.1 * c.floor.level);
    EXPECT_LE(c.mean_evaluations, 4.0);
}

// On bumps central differences turn the normals as well, which moves the foot of a probe along the
// surface by more than the level is off: the floor of the position is where they vanish along it.
TEST_P(Reconstruction, BumpsAreFeltAsWellAsTheirVoxelsTell) {
    const Comparison c = compare(bumpy(), GetParam());
    EXPECT_LE(c.loop.level, 1.1 * c.floor.level);
    EXPECT_LE(c.loop.position, 1.1 * c.floor.position);
    EXPECT_LE(c.mean_evaluations, 4.0);
}

} // namespace
} // namespace palpate
