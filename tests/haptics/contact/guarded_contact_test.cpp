// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/guarded_contact.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

using test::certified;
using test::ContactLoop;

constexpr double kLeash = 1e-3; // m
// An adaptive frame may leave the tolerance of 0.1 um of its way.
constexpr double kTolerance_n = ContactLoop::kStiffness * 1e-7;

Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    return glm::normalize(Vec3{x, y, z});
}

std::vector<std::unique_ptr<SurfaceContact>> guarded(std::shared_ptr<const ScalarField> field,
                                                     TriangleMesh mesh, LevelSettings level = {},
                                                     double leash_m = kLeash) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(std::move(field), level,
                                                        certified(std::move(mesh)), leash_m));
    return surfaces;
}

const GuardedContact& guarded_surface(ContactLoop& loop) {
    return static_cast<const GuardedContact&>(loop.surface(0));
}

/// A ball of 30 mm in voxels of 1 mm.
std::shared_ptr<const ScalarField> ball_in_voxels() {
    return test::voxels_of([](const Vec3& p) { return 0.03 - glm::length(p); }, 0.034, 1e-3);
}

// Where mesh and volume agree, the guard is not felt: the frames are the volume's, bit for bit.
TEST(GuardedContact, IsTheVolumeWhereTheMeshAgrees) {
    const auto field = ball_in_voxels();
    ContactLoop with_guard({}, guarded(field, test::icosphere(0.03, 5)));
    ContactLoop without({}, test::one_surface(field));
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> share;
    Vec3 probe{0, 0, 0.04};
    with_guard.start(probe);
    without.start(probe);
    for (int i = 0; i < 3000; ++i) {
        // 0.02 to 20 mm per frame, held to a shell where the way round the ball is the same for
        // both
        probe += 0.02e-3 * std::pow(1000.0, share(random)) * random_direction(random);
        probe = std::clamp(glm::length(probe), 0.024, 0.034) * glm::normalize(probe);
        with_guard.move(probe);
        without.move(probe);
        ASSERT_EQ(with_guard.proxy(), without.proxy()) << i;
        ASSERT_FALSE(guarded_surface(with_guard).guarded());
    }
}

/// A wall across z that leans by 0.3 rad about y, thinner than the voxels: sampled, it is a sieve.
/// Its mesh is a whole plate.
struct LeaningWall {
    static constexpr double kHalf = 0.15e-3; // m, of its thickness
    Vec3 normal{std::sin(0.3), 0.0, std::cos(0.3)};

    std::shared_ptr<const ScalarField> field() const {
        return test::voxels_of(
            [this](const Vec3& p) { return kHalf - std::abs(glm::dot(normal, p)); }, 0.02, 1e-3);
    }
    TriangleMesh mesh() const {
        const Vec3 u{std::cos(0.3), 0.0, -std::sin(0.3)};
        TriangleMesh box = test::box_mesh({-0.03, -0.03, -kHalf}, {0.03, 0.03, kHalf});
        for (Vec3& p : box.vertices)
            p = p.x * u + p.y * Vec3{0, 1, 0} + p.z * normal;
        return box;
    }
};

struct Crossings {
    int passed = 0, guarded = 0;
    double deepest_m = 0.0;
};

/// Strokes through the wall, of 0.05 to 200 mm per frame.
Crossings stroke_through(ContactLoop& loop, const LeaningWall& wall) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> beside(-0.008, 0.008), share;
    Crossings crossings;
    for (int stroke = 0; stroke < 300; ++stroke) {
        const double x = beside(random), y = beside(random);
        const Vec3 start = Vec3{x, y, 0.0} + 0.008 * wall.normal;
        const Vec3 end = Vec3{y, x, 0.0} - 0.008 * wall.normal;
        const double step = 0.05e-3 * std::pow(4000.0, share(random));
        const int frames = 1 + static_cast<int>(glm::length(end - start) / step);
        loop.start(start);
        for (int i = 0; i <= frames; ++i) {
            const SubdivisionResult result =
                loop.move(start + (static_cast<double>(i) / frames) * (end - start));
            crossings.guarded += result.guarded != 0;
        }
        const double behind = -glm::dot(wall.normal, loop.proxy());
        crossings.deepest_m = std::max(crossings.deepest_m, behind);
        crossings.passed += behind > kLeash + LeaningWall::kHalf;
    }
    return crossings;
}

TEST(GuardedContact, HoldsAWallThatTheVoxelsLetThrough) {
    const LeaningWall wall;
    ContactLoop loop({}, guarded(wall.field(), wall.mesh()));
    const Crossings crossings = stroke_through(loop, wall);
    EXPECT_EQ(crossings.passed, 0) << crossings.deepest_m;
    EXPECT_GT(crossings.guarded, 100) << "the wall must be one that needs the guard";
}

TEST(GuardedContact, ControlWithoutTheMeshTheWallIsASieve) {
    const LeaningWall wall;
    ContactLoop loop({}, test::one_surface(wall.field()));
    EXPECT_GT(stroke_through(loop, wall).passed, 100);
}

// On the leash too a held probe means a held proxy, and the way out is free.
TEST(GuardedContact, AHeldProbeOnTheLeashMovesNoBit) {
    const LeaningWall wall;
    ContactLoop loop({}, guarded(wall.field(), wall.mesh()));
    int held_by_the_guard = 0;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> beside(-0.008, 0.008);
    for (int place = 0; place < 40; ++place) {
        const double x = beside(random), y = beside(random);
        const Vec3 above = Vec3{x, y, 0.0} + 0.006 * wall.normal;
        const Vec3 probe = above - 0.010 * wall.normal;
        loop.start(above);
        for (int i = 0; i <= 60; ++i)
            loop.move(above + (std::min(i, 50) / 50.0) * (probe - above));
        if (guarded_surface(loop).guarded()) ++held_by_the_guard;
        const Vec3 held = loop.proxy();
        for (int i = 0; i < 300; ++i) {
            loop.move(probe);
            ASSERT_EQ(loop.proxy(), held) << "place " << place << ", frame " << i;
        }
        for (int i = 50; i >= 0; --i)
            loop.move(above + (i / 50.0) * (probe - above));
        ASSERT_LE(glm::length(loop.proxy() - above), 1e-12);
    }
    EXPECT_GT(held_by_the_guard, 10);
}

// Where the guard stands at a vertex, the leash holds the proxy on a ball about it, at an edge on a
// cylinder. Seen: with flat planes and a probe farther away than the leash is long, frames went to
// and fro between two of them up to their cap.
/// From the middle of a hollow cube towards and past its corners and edges, where a leash from one
/// of them holds the proxy: on a ball about it. The cube is turned by `turn`.
void expect_a_ball_about_each_corner(ContactLoop& loop, const Mat3& turn, double half_m) {
    for (const Vec3& direction :
         {Vec3{1, 1, 1}, Vec3{1, 0.9, 0.7}, Vec3{1, 0.8, 0.02}, Vec3{0.7, 1, -0.3}}) {
        loop.start(Vec3{0.0});
        for (int i = 1; i <= 200; ++i) {
            const Vec3 probe = (i / 200.0) * 0.015 * direction;
            const SubdivisionResult result = loop.move(turn * probe);
            const Vec3 proxy = glm::transpose(turn) * loop.proxy();
            const Vec3 foot = glm::clamp(probe, Vec3{-half_m}, Vec3{half_m});
            const double away = glm::length(probe - foot);
            if (away < kLeash) continue; // it may not have come to the leash yet
            ASSERT_FALSE(result.flags & kEvaluationCap) << i << " " << direction.y;
            // The energy bank may let it hang a little lower than the leash's plane.
            const double held = glm::length(proxy - foot);
            ASSERT_GE(held, 0.8 * kLeash - 1e-7);
            ASSERT_LE(held, kLeash + 1e-7);
            // What is left of the way is an adaptive frame's tolerance.
            const Vec3 exact = foot + (held / away) * (probe - foot);
            ASSERT_LE(glm::length(proxy - exact), 1e-7) << i << " " << direction.y;
        }
    }
}

TEST(GuardedContact, TheLeashFromACornerIsABall) {
    constexpr double kHalf = 0.01;
    TriangleMesh cavity = test::box_mesh(Vec3{-kHalf}, Vec3{kHalf});
    for (auto& triangle : cavity.triangles)
        std::swap(triangle[1], triangle[2]);
    // A field that holds nothing there: a ball far away.
    const auto field = test::voxels_of(
        [](const Vec3& p) { return 0.004 - glm::length(p - Vec3{0.03}); }, 0.04, 1e-3);
    ContactLoop still({}, guarded(field, cavity));
    expect_a_ball_about_each_corner(still, Mat3(1.0), kHalf);
    // Of a body that is turned, too.
    std::vector<std::unique_ptr<SurfaceContact>> moving;
    moving.push_back(std::make_unique<MovingContact>(std::move(guarded(field, cavity).front())));
    ContactLoop turned({}, std::move(moving));
    const Quaternion turn = glm::angleAxis(1.1, glm::normalize(Vec3{1.0, -2.0, 0.5}));
    turned.subdivision().surface(0).moving()->set_pose({Vec3{0.0}, turn});
    expect_a_ball_about_each_corner(turned, glm::mat3_cast(turn), kHalf);
}

/// Checks every sub-step in which the leash has a say.
class LeashListener final : public SubStepObserver {
public:
    void sub_step(const SubStep& step) noexcept override {
        ASSERT_EQ(step.leashes.size(), 1u);
        const SubStep::Leash* leash = &step.leashes.front();
        ASSERT_EQ(leash->length_m, kLeash);
        const double away_m = glm::length(step.from - leash->guard);
        if (leash->offered) {
            // Its plane stands across the way to the guard, at 0.8 of the leash from it; or below,
            // where the energy bank lets the planes back by and by.
            const PlanePrimitive& plane = step.contacts[step.contacts.size() - 1].plane;
            EXPECT_NEAR(glm::dot(plane.normal, leash->guard - step.from), away_m, kRounding_m);
            const double held_m = glm::dot(plane.normal, leash->guard - plane.anchor);
            if (loop->surface(0).is_rationed()) {
                EXPECT_GE(held_m, 0.8 * kLeash - kRounding_m);
            } else {
                EXPECT_NEAR(held_m, 0.8 * kLeash, kRounding_m);
                ++planes;
            }
        }
        if (step.stop.by != SubStep::Stop::By::leash || step.from == leash->guard)
            return; // else it flies along
        // Nothing that it stops ends farther than the leash from the guard, or than it was.
        EXPECT_LE(glm::length(step.to - leash->guard), std::max(away_m, kLeash) + kRounding_m);
        ++stops;
    }
    static constexpr double kRounding_m = 1e-15; // of places within 20 mm
    const Subdivision* loop = nullptr;
    int planes = 0, stops = 0;
};

TEST(GuardedContact, AnObserverSeesTheLeash) {
    const LeaningWall wall;
    ContactLoop loop({}, guarded(wall.field(), wall.mesh()));
    LeashListener listener;
    listener.loop = &loop.subdivision();
    loop.subdivision().observe(&listener);
    stroke_through(loop, wall);
    EXPECT_GT(listener.planes, 100);
    EXPECT_GT(listener.stops, 100);
}

// A hand that lifts off fast: the guard flies along, and the frame ends where the hand is.
TEST(GuardedContact, LeavesTheSurfaceInOneFrame) {
    ContactLoop loop({}, guarded(ball_in_voxels(), test::icosphere(0.03, 5)));
    std::mt19937_64 random(3);
    for (int i = 0; i < 200; ++i) {
        const Vec3 direction = random_direction(random);
        loop.start(0.033 * direction);
        for (double r = 0.033; r > 0.028; r -= 0.5e-3)
            loop.move(r * direction);
        const SubdivisionResult result = loop.move(0.4 * direction);
        ASSERT_EQ(loop.proxy(), 0.4 * direction);
        ASSERT_LE(result.evaluations, 3u);
    }
}

// A guard that yielded with its surface begins anew in front of the mesh, whichever of mesh and
// level is in front there.
TEST(GuardedContact, GuardsAgainAfterYielding) {
    LevelSettings level;
    level.strength_n = 0.5;
    ContactLoop loop({}, guarded(ball_in_voxels(), test::icosphere(0.03, 3), level));
    std::mt19937_64 random(9);
    for (int i = 0; i < 200; ++i) {
        const Vec3 direction = random_direction(random);
        loop.start(0.032 * direction);
        for (double r = 0.032; r > 0.025; r -= 2e-4)
            loop.move(r * direction);
        EXPECT_EQ(loop.surface(0).state(), SurfaceState::yielded);
        EXPECT_FALSE(guarded_surface(loop).guard());
        for (double r = 0.025; r < 0.0301; r += 1e-5)
            loop.move(r * direction);
        for (double r = 0.0301; r > 0.0298; r -= 1e-5) {
            loop.move(r * direction);
            ASSERT_TRUE(guarded_surface(loop).guard());
            ASSERT_FALSE(guarded_surface(loop).guarded());
            ASSERT_NE(loop.surface(0).state(), SurfaceState::yielded);
        }
    }
}

// From a contact of the volume alone: nothing moves, and the mesh holds from the next frame on.
TEST(GuardedContact, GoesOnFromTheVolume) {
    const auto field = ball_in_voxels();
    const Vec3 proxy{0, 0, 0.0305};
    VolumeContact volume(field, {});
    volume.restart(proxy);
    volume.commit(proxy, false, true);
    GuardedContact contact(field, {}, certified(test::icosphere(0.03, 3)), kLeash);
    contact.restart(proxy);
    ASSERT_TRUE(contact.go_on_from(volume));
    EXPECT_EQ(contact.state(), SurfaceState::in_contact);
    EXPECT_FALSE(contact.guard());
    contact.commit(proxy, false, true);
    ASSERT_TRUE(contact.guard());
    EXPECT_EQ(*contact.guard(), proxy);
    // Deep inside the mesh there is nothing to hold, until the proxy has come out.
    ASSERT_TRUE(contact.go_on_from(volume));
    contact.commit({0, 0, 0.02}, false, true);
    EXPECT_FALSE(contact.guard());
    contact.commit(proxy, false, true);
    EXPECT_TRUE(contact.guard());
    VolumeContact inside(field, {});
    inside.restart({0, 0, 0.02});
    ASSERT_TRUE(contact.go_on_from(inside));
    EXPECT_EQ(contact.state(), SurfaceState::inside) << "as it was";
}

// On a leash shorter than what the voxels' level is off the mesh, both hold the proxy in turn; each
// alone is as strong as the surface. With both at once 0.5 N gave 0.94.
TEST(GuardedContact, LeashAndLevelTogetherResistNoMoreThanTheStrength) {
    const LeaningWall wall;
    for (const double strength_n : {0.5, 2.0}) {
        LevelSettings level;
        level.strength_n = strength_n;
        ContactLoop loop({}, guarded(wall.field(), wall.mesh(), level, 0.3e-3));
        std::mt19937_64 random(3);
        std::uniform_real_distribution<double> beside(-0.008, 0.008), aslant(-3e-3, 3e-3);
        int held_by_the_guard = 0;
        for (int stroke = 0; stroke < 200; ++stroke) {
            const double x = beside(random), y = beside(random), dx = aslant(random);
            const Vec3 start = Vec3{x, y, 0.0} + 0.006 * wall.normal;
            const Vec3 end = Vec3{x + dx, y, 0.0} - 0.009 * wall.normal;
            loop.start(start);
            for (int i = 0; i <= 200; ++i) {
                const Vec3 probe = start + (i / 200.0) * (end - start);
                const SubdivisionResult result = loop.move(probe);
                held_by_the_guard += result.guarded != 0;
                if (result.flags & (kEvaluationCap | kStalled)) continue; // no balance
                ASSERT_LE(ContactLoop::kStiffness * glm::length(loop.proxy() - probe),
                          strength_n + kTolerance_n)
                    << strength_n << " " << stroke << " " << i;
            }
        }
        EXPECT_GT(held_by_the_guard, 100);
    }
}

TEST(GuardedContact, RefusesWhatItCannotUse) {
    const auto mesh = certified(test::icosphere(0.03, 3));
    EXPECT_THROW(GuardedContact(ball_in_voxels(), {}, nullptr, kLeash), std::invalid_argument);
    EXPECT_THROW(GuardedContact(ball_in_voxels(), {}, mesh, 0.0), std::invalid_argument);
    EXPECT_THROW(GuardedContact(ball_in_voxels(), {.level = 5.0}, mesh, kLeash),
                 std::invalid_argument);
}

} // namespace
} // namespace palpate
