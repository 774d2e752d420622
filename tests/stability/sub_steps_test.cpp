// SPDX-License-Identifier: Apache-2.0
// Any number of sub-steps: a surface is held by one as by 4096, and the proxy is nearer to where it
// should be the more there are.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/stepping_methods.h"
#include "tests/support/sub_step_cases.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::Surfaces;

constexpr double kRadius = 0.05;
constexpr double kTolerance = 1e-7; // m: what adaptive may leave

/// 300 frames at 0.2 m/s along the inside of the sphere while pressing up to 5 mm deep; from the
/// surface itself, and from `start_m` in front of it.
std::vector<Vec3> pressed_along(double start_m) {
    std::vector<Vec3> path;
    for (int i = 0; i < 300; ++i) {
        const double angle = 0.3 + i * 0.2e-3 / kRadius;
        const double r = kRadius - start_m + std::min(start_m + 5e-3, i * 0.05e-3);
        path.push_back(r * glm::normalize(Vec3{std::cos(angle), std::sin(angle),
                                               0.3 * std::sin(2.0 * angle)}));
    }
    return path;
}

struct Held {
    int in_contact = 0;
    double lag_m = 0.0; ///< mean distance from the radial point, of the frames in contact
};

Held hold(const test::SubStepCase& of, const std::function<Surfaces()>& surfaces, double start_m) {
    ContactLoop loop(of.settings, surfaces(), {}, of.reading_us);
    Held held;
    const std::vector<Vec3> path = pressed_along(start_m);
    loop.start(path.front());
    for (const Vec3& probe : path) {
        const SubdivisionResult frame = loop.move(probe);
        EXPECT_EQ(frame.flags, 0u) << of.name;
        if (!frame.felt) continue;
        ++held.in_contact;
        held.lag_m += glm::length(loop.proxy() - kRadius * glm::normalize(probe));
    }
    if (held.in_contact > 0) held.lag_m /= held.in_contact;
    return held;
}

/// Frames in contact as of adaptive, within 1 %; the lag falls down to what the geometry leaves,
/// which adaptive shows.
void expect_held_by_any(const std::function<Surfaces()>& surfaces, double start_m) {
    const Held best = hold(test::adaptive_steps(), surfaces, start_m);
    EXPECT_GT(best.in_contact, 150);
    Held last;
    last.lag_m = 1.0;
    for (const test::SubStepCase& of : test::any_number_of_sub_steps()) {
        SCOPED_TRACE(of.name);
        const Held held = hold(of, surfaces, start_m);
        EXPECT_NEAR(held.in_contact, best.in_contact, std::max(1.0, 0.01 * best.in_contact));
        if (of.settings.method == SteppingMethod::fixed) {
            EXPECT_LE(held.lag_m, std::max(last.lag_m, best.lag_m + kTolerance));
            last = held;
        }
        const bool many =
            of.settings.method == SteppingMethod::paper || of.settings.sub_steps >= 1024;
        if (many) {
            EXPECT_LE(held.lag_m, best.lag_m + kTolerance);
        }
    }
}

/// The sphere's mesh of 327 680 facets, facing inwards.
const TriangleMesh& fine_mesh() {
    static const TriangleMesh mesh = test::reversed(test::icosphere(kRadius, 7));
    return mesh;
}

Surfaces direct_contact(const TriangleMesh& mesh, std::shared_ptr<const ScalarField> field) {
    Surfaces surfaces;
    surfaces.push_back(std::make_unique<DirectContact>(
        std::make_shared<const SurfaceScene>(std::make_shared<const TriangleMesh>(mesh)),
        std::move(field), LevelSettings{}));
    return surfaces;
}

// From the surface itself the proxy begins behind the facets, which are chords of the sphere.
TEST(SubSteps, DirectHoldsASphereFromTheSurfaceOnByAnyNumber) {
    const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
    expect_held_by_any([&] { return direct_contact(fine_mesh(), field); }, 0.0);
    expect_held_by_any([&] { return direct_contact(fine_mesh(), field); }, 4e-3);
}

TEST(SubSteps, DirectHoldsVoxelsByAnyNumber) {
    const auto field =
        test::voxels_of([](const Vec3& p) { return glm::length(p) - kRadius; }, 0.056, 1e-3);
    expect_held_by_any([&] { return direct_contact(fine_mesh(), field); }, 4e-3);
}

// Facets of 1.6 mm chord error are farther in front of the level than a step of half a voxel: what
// has passed one is still behind it.
TEST(SubSteps, DirectFindsALevelFarBehindItsFacets) {
    const auto field =
        test::voxels_of([](const Vec3& p) { return glm::length(p) - kRadius; }, 0.056, 1e-3);
    const TriangleMesh coarse = test::reversed(test::icosphere(kRadius, 3));
    expect_held_by_any([&] { return direct_contact(coarse, field); }, 4e-3);
}

TEST(SubSteps, MeshHoldsASphereByAnyNumber) {
    const auto mesh = test::certified(fine_mesh());
    expect_held_by_any([&] { return test::one_mesh(mesh); }, 4e-3);
}

/// What strokes over bumps in voxels came to.
struct Strokes {
    int in_contact = 0, stalled = 0;
};

/// Strokes of 0.2 m/s, 0.5 to 4.6 mm deep, over bumps of 8 mm in voxels of 1 mm: their trilinear
/// and central differences disagree by 20 degrees.
Strokes stroke_bumps(const SteppingSettings& settings, double outwards) {
    constexpr double kBall = 0.02;
    const auto formula = make_bumpy_cavity(kBall, 1e-3, 8e-3)->make_sampler();
    const auto field = test::voxels_of([&](const Vec3& p) { return outwards * formula->value(p); },
                                       kBall + 6e-3, 1e-3);
    ContactLoop loop(settings, test::one_surface(field));
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
        const double x = normal(random), y = normal(random), z = normal(random);
        return glm::normalize(Vec3{x, y, z});
    };
    Strokes strokes;
    for (int stroke = 0; stroke < 40; ++stroke) {
        const Vec3 u = direction();
        const Vec3 v = glm::normalize(glm::cross(u, direction()));
        const double deep = (0.5 + 0.45 * (7 * stroke % 10)) * 1e-3;
        for (int i = 0; i < 250; ++i) {
            const double angle = i * 0.2e-3 / kBall;
            const double depth = -2.5e-3 + std::min(deep + 2.5e-3, i * 0.1e-3);
            const Vec3 probe =
                (kBall + outwards * depth) * (std::cos(angle) * u + std::sin(angle) * v);
            if (i == 0) loop.start(probe);
            const SubdivisionResult frame = loop.move(probe);
            strokes.in_contact += frame.felt != 0;
            strokes.stalled += (frame.flags & kStalled) != 0;
        }
    }
    return strokes;
}

// At the edge of the certificate every chord along the planes rises above it, and the energy bank
// may not pay for the whole way back to the level: as much of it as is paid for frees the proxy.
TEST(SubSteps, AtTheEdgeOfTheCertificateTheProxyGoesOn) {
    for (const double outwards : {1.0, -1.0})
        for (const int number : {8, 46, 256}) {
            SCOPED_TRACE(std::to_string(number) + (outwards > 0.0 ? " in a cavity" : " on a ball"));
            SteppingSettings settings;
            settings.method = SteppingMethod::fixed;
            settings.sub_steps = number;
            const Strokes strokes = stroke_bumps(settings, outwards);
            EXPECT_GT(strokes.in_contact, 8000);
            EXPECT_LE(strokes.stalled, 2);
        }
}

} // namespace
} // namespace palpate
