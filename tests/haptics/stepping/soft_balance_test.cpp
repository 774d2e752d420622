// SPDX-License-Identifier: Apache-2.0
// Soft and hard planes in any number: where a frame ends, all forces balance; and no plane that the
// solver is told, nor any force, takes a front or a tip through a surface (docs/palpation.md).
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/half_space.h"
#include "tests/support/soft_layers.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::HalfSpace;
using test::Plane;
using test::precise_layers;
using test::soft;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kTolerance_m = 1e-10;

double tissue_of(double stiffness_n_per_m) { return 1.0 / (1.0 / stiffness_n_per_m - 1.0 / kK); }

Vec3 any(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const double x = unit(random), y = unit(random), z = unit(random);
    return {x, y, z};
}

/// How far a force is from one that these planes can push with, N: the least over up to three of
/// them at a time, as many as it takes (Caratheodory).
double beyond_pushes(const Vec3& force, const std::vector<Vec3>& normals) {
    double least = glm::length(force);
    const std::size_t count = normals.size();
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t j = i; j < count; ++j)
            for (std::size_t l = j; l < count; ++l) {
                // Gram-Schmidt keeps it exact where planes are nearly one.
                Vec3 rest = force;
                const Vec3 &a = normals[i], &b = normals[j], &c = normals[l];
                Vec3 sum{0.0};
                if (i == j) {
                    sum = std::max(0.0, glm::dot(force, a)) * a;
                } else {
                    const Mat3 of =
                        j == l ? Mat3(a, b, glm::normalize(glm::cross(a, b))) : Mat3(a, b, c);
                    if (std::abs(glm::determinant(of)) < 1e-9) continue;
                    const Vec3 share = glm::inverse(of) * force;
                    if (share.x < 0.0 || share.y < 0.0 || (j != l && share.z < 0.0)) continue;
                    sum = share.x * a + share.y * b + (j != l ? share.z * c : Vec3{0.0});
                }
                rest -= sum;
                least = std::min(least, glm::length(rest));
            }
    return least;
}

// The equation of a balance, whatever found it:
//   k (a - x) + sum K_i d_i n_i + sum lambda_j n_j = 0,   lambda_j >= 0 where n_j.x = c_j
TEST(SoftBalance, OfRandomPlanesAllForcesAreInBalance) {
    std::mt19937 random(17);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    int pressed = 0, held = 0;
    double worst = 0.0;
    for (int trial = 0; trial < 1500; ++trial) {
        const std::size_t count = 2 + random() % 6;
        const bool alike = trial % 4 == 0; // normals within 1e-4
        std::vector<Plane> planes;
        std::vector<double> tissue; // 0: hard
        std::vector<SurfaceFinish> finish;
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        for (std::size_t i = 0; i < count; ++i) {
            Vec3 n = Vec3{0, 0, 1.2} + any(random);
            if (alike) n = Vec3{0, 0, 1} + 1e-4 * any(random);
            planes.push_back({glm::normalize(n), 4e-3 * (unit(random) - 0.5)});
            const double stiffness = 20.0 * std::pow(22.0, unit(random)); // to 440 N/m
            const bool is_soft = i == 0 || unit(random) < 0.6;
            tissue.push_back(is_soft ? tissue_of(stiffness) : 0.0);
            finish.push_back(is_soft ? soft(stiffness) : SurfaceFinish{});
            surfaces.push_back(std::make_unique<VolumeContact>(
                std::make_shared<HalfSpace>(planes.back()), LevelSettings{}));
        }
        ContactLoop loop(precise_layers(), std::move(surfaces), {}, 0.0, finish);
        loop.start({0, 0, 60e-3});
        const Vec3 probe = 8e-3 * any(random) - Vec3{0, 0, 6e-3};
        SubdivisionResult last;
        for (int i = 0; i < 12; ++i)
            last = loop.move(probe);
        const Vec3 x = loop.proxy();
        Vec3 rest = kK * (probe - x);
        double stiffness = kK;
        std::vector<Vec3> hold;
        for (std::size_t i = 0; i < count; ++i) {
            const double d = planes[i].depth(x);
            if (tissue[i] > 0.0) {
                rest += tissue[i] * std::max(0.0, d) * planes[i].n;
                stiffness += tissue[i];
                pressed += d > 1e-6 ? 1 : 0;
            } else {
                EXPECT_LE(d, 1e-8) << trial;
                if (std::abs(d) < 1e-8) hold.push_back(planes[i].n);
            }
        }
        held += hold.empty() ? 0 : 1;
        const double off = beyond_pushes(-rest, hold) / (stiffness * kTolerance_m);
        worst = std::max(worst, off);
        // Each force is as exact as its own plane's place, a step of the tolerance.
        EXPECT_LE(off, 2.0) << trial << ": " << count << " planes, flags " << last.flags;
    }
    EXPECT_GT(pressed, 1000);
    EXPECT_GT(held, 300);
    RecordProperty("worst_of_the_tolerance", std::to_string(worst));
}

// Three soft planes in one place, which no solver of rigid planes could tell apart.
TEST(SoftBalance, LayersInOnePlaceShareTheForceByTheirStiffness) {
    const double stiffness[3] = {50.0, 120.0, 300.0};
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    for (int i = 0; i < 3; ++i)
        surfaces.push_back(std::make_unique<VolumeContact>(
            std::shared_ptr<const ScalarField>(make_slab(20e-3)), LevelSettings{}));
    ContactLoop loop(precise_layers(), std::move(surfaces), {}, 0.0,
                     {soft(stiffness[0]), soft(stiffness[1]), soft(stiffness[2])});
    loop.start({0, 0, 11e-3});
    for (int i = 0; i <= 60; ++i)
        loop.move({1e-4 * i, 0, 10e-3 - 1e-4 * i});
    const double d = 10e-3 - loop.proxy().z;
    EXPECT_GT(d, 0.5e-3);
    TouchList touches;
    loop.subdivision().find_touches(touches);
    ASSERT_EQ(touches.size(), 3u);
    for (const Touch& touch : touches)
        EXPECT_NEAR(touch.force.z, tissue_of(stiffness[touch.surface]) * d, 1e-6);
}

TEST(SoftBalance, OnMeshesTheEliminatedTipIsTheSolvedOneInMostFrames) {
    /// Does nothing, and does not say that it only pushes: the tip is then solved.
    class Idle final : public Effect {
    public:
        void begin(const FrameContext&) noexcept override {}
        void gather(const Vec3&, PrimitiveSet&) noexcept override {}
        QueryCount queries() const noexcept override { return {}; }
    };
    const auto mesh = [] {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        surfaces.push_back(test::ball(test::Kind::mesh, 30e-3,
                                      std::numeric_limits<double>::infinity(), Yielding::holds, 4));
        return surfaces;
    };
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<Idle>());
    ContactLoop eliminated(precise_layers(), mesh(), {}, 0.0, {soft(150.0)});
    ContactLoop solved(precise_layers(), mesh(), std::move(effects), 0.0, {soft(150.0)});
    std::mt19937 random(23);
    Vec3 probe{31e-3, 0, 0};
    eliminated.start(probe);
    solved.start(probe);
    std::vector<double> apart_n;
    for (int i = 0; i < 1500; ++i) {
        probe += 3e-4 * any(random);
        probe *= (27e-3 + 1e-3 * std::sin(0.01 * i)) / glm::length(probe);
        eliminated.move(probe);
        solved.move(probe);
        apart_n.push_back(kK * glm::length(eliminated.proxy() - solved.proxy()));
    }
    std::sort(apart_n.begin(), apart_n.end());
    EXPECT_LE(apart_n[apart_n.size() / 2], 2.0 * kK * kTolerance_m);
    RecordProperty("p99_n", std::to_string(apart_n[apart_n.size() * 99 / 100]));
}

// ---- misled ------------------------------------------------------------------------------------

/// A ball whose planes nobody is told: what the solver answers has nothing to do with it. With
/// `certifies` false it does not look at chords either.
class Untold final : public SurfaceContact {
public:
    Untold(double radius_m, bool certifies)
        : inner_(std::shared_ptr<const ScalarField>(make_solid_sphere(radius_m)), LevelSettings{}),
          certifies_(certifies) {}
    bool restart(const Vec3& proxy) noexcept override { return inner_.restart(proxy); }
    void set_gain(const Gain& gain) noexcept override { inner_.set_gain(gain); }
    void offer(const Vec3&, ContactSet&, NearestPlane*) noexcept override {}
    void keep_active(const ProxySolution&, std::size_t) noexcept override {}
    Chord carry(const Vec3& from, const Vec3& to) noexcept override {
        return certifies_ ? inner_.carry(from, to) : Chord{};
    }
    double trust_m() const noexcept override { return inner_.trust_m(); }
    void commit(const Vec3& proxy, bool yielded, bool felt) noexcept override {
        inner_.commit(proxy, yielded, felt);
    }
    SurfaceState state() const noexcept override { return inner_.state(); }
    QueryCount queries() const noexcept override { return inner_.queries(); }
    std::any save_state() const override { return inner_.save_state(); }
    void restore_state(const std::any& state) override { inner_.restore_state(state); }

private:
    VolumeContact inner_;
    bool certifies_;
};

/// Pushes the tip anywhere.
class Noise final : public Effect {
public:
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force(std::pow(10.0, 3.0 * any(random_).x) * any(random_));
    }
    QueryCount queries() const noexcept override { return {}; }

private:
    std::mt19937 random_{29};
};

/// How deep the tip came into bone and a front into skin, of balls of 50 and 60 mm, m.
struct Deepest {
    double bone_m = -1.0, front_m = -1.0;
};

Deepest misled(bool certifies) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<Untold>(50e-3, certifies));
    surfaces.push_back(std::make_unique<Untold>(60e-3, certifies));
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<Noise>());
    ContactLoop loop({}, std::move(surfaces), std::move(effects), 0.0, {{}, soft(100.0)});
    std::mt19937 random(31);
    Deepest deepest;
    for (int i = 0; i < 3000; ++i) {
        if (i % 20 == 0) loop.start({0, 0, 65e-3});
        Vec3 probe = loop.proxy() + std::pow(20.0, any(random).x) * 20e-3 * any(random);
        if (glm::length(probe) > 0.08) probe *= 0.08 / glm::length(probe);
        loop.move(probe);
        const auto path = loop.subdivision().path();
        for (std::size_t c = 1; c < path.size(); ++c)
            for (int s = 0; s <= 20; ++s)
                deepest.bone_m =
                    std::max(deepest.bone_m,
                             50e-3 - glm::length(path[c - 1] + s / 20.0 * (path[c] - path[c - 1])));
        deepest.front_m = std::max(
            deepest.front_m, 60e-3 - glm::length(loop.subdivision().place_on(1, loop.proxy())));
    }
    return deepest;
}

TEST(SoftBalance, ASolverThatKnowsOfNoPlaneTakesNeitherTipNorFrontThroughASurface) {
    constexpr double kCertificate = 25e-6; // m: of a distance field
    const Deepest held = misled(true);
    EXPECT_LE(held.bone_m, kCertificate * (1 + 1e-9));
    EXPECT_LE(held.front_m, kCertificate * (1 + 1e-9));
    EXPECT_GT(held.bone_m, -1e-9) << "it is pressed onto bone";
    EXPECT_GT(held.front_m, -1e-9);
    // The control: without the certificates both go through.
    const Deepest passed = misled(false);
    EXPECT_GT(passed.bone_m, 1e-3);
    EXPECT_GT(passed.front_m, 1e-3);
}

} // namespace
} // namespace palpate
