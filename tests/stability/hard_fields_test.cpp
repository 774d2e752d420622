// SPDX-License-Identifier: Apache-2.0
// Hard cases of data, each with every method: flat, saddled, damaged, cut off, cornered, in steps
// (numerics 5).
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/filters/label_filters.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/host_fields.h"
#include "tests/support/made_labels.h"
#include "tests/support/stepping_methods.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::memoryless;
using test::one_surface;
using test::stepping_of;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

class HardFields : public testing::TestWithParam<SteppingMethod> {
protected:
    std::unique_ptr<ContactLoop> felt(test::Surfaces surfaces) const {
        return test::loop_of(stepping_of(GetParam()), std::move(surfaces));
    }
    std::unique_ptr<ContactLoop> felt(test::Effects effects) const {
        return test::loop_of(stepping_of(GetParam()), {}, std::move(effects));
    }
};
INSTANTIATE_TEST_SUITE_P(Every, HardFields, testing::ValuesIn(test::kEveryMethod),
                         [](const testing::TestParamInfo<SteppingMethod>& of) {
                             return test::name_of(of.param);
                         });

/// Deepest value over all chords of the last frame, U.
double deepest(const ScalarField& field, std::span<const Vec3> path) {
    const auto sampler = field.make_sampler();
    double deep = -kInfinite;
    for (std::size_t i = 1; i < path.size(); ++i)
        for (int k = 0; k <= 20; ++k)
            deep =
                std::max(deep, sampler->value(path[i - 1] + (k / 20.0) * (path[i] - path[i - 1])));
    return deep;
}

/// Moves the probe in a straight line, `step` per frame, and gives every frame to `see(probe)`.
template <class See>
void go(ContactLoop& loop, const Vec3& from, const Vec3& to, double step, const See& see) {
    const int frames = std::max(1, static_cast<int>(std::lround(glm::length(to - from) / step)));
    for (int i = 1; i <= frames; ++i) {
        const Vec3 probe = from + (static_cast<double>(i) / frames) * (to - from);
        loop.move(probe);
        see(probe);
    }
}

// ------------------------------------------------------------------ without a gradient (row 1)

/// A wall below z = 0: 100 above its level from 0.25 mm down, 100 below it from 0.25 mm up, and
/// nothing but that: within a voxel of 0.5 mm the field is flat.
std::shared_ptr<const ScalarField> two_plateaus() {
    return test::voxels_of([](const Vec3& p) { return std::clamp(-p.z / 0.25e-3, -1.0, 1.0); },
                           0.01, 0.5e-3);
}

TEST_P(HardFields, WhereDataAreFlatNothingIsFelt) {
    const auto field = two_plateaus();
    const auto expect_free = [](ContactLoop& loop, double z) {
        std::mt19937_64 random(1);
        std::uniform_real_distribution<double> beside(-0.003, 0.003);
        loop.start({0, 0, z});
        for (int i = 0; i < 300; ++i) {
            const double x = beside(random), y = beside(random), dz = beside(random);
            const Vec3 probe{x, y, z + 0.5 * dz};
            const SubdivisionResult result = loop.move(probe);
            ASSERT_EQ(loop.proxy(), probe) << i;
            ASSERT_EQ(result.contacts, 0u) << i;
        }
    };
    expect_free(*felt(one_surface(field)), 0.005);
    expect_free(*felt(memoryless(field, test::hard_everywhere())), 0.005);
    // Inside a surface that a trial began in nothing is felt either; nor has a plateau a direction.
    expect_free(*felt(one_surface(field)), -0.005);
    expect_free(*felt(memoryless(field, test::hard_everywhere())), -0.005);
}

// A surface that yields is pressed into its plateau, where it has no normal: it is let go, and its
// level forgotten by the time that the hand comes back.
TEST_P(HardFields, APlateauBehindAYieldingSurfaceIsForgotten) {
    LevelSettings level;
    level.strength_n = 1.0; // 2 mm
    const auto loop = felt(one_surface(two_plateaus(), level));
    loop->start({0.001, 0.0003, 0.004});
    for (int time = 0; time < 2; ++time) {
        const Vec3 above{0.001, 0.0003, 0.004}, below{0.001, 0.0003, -0.006};
        go(*loop, above, {0.001, 0.0003, -0.0015}, 1e-4, [](const Vec3&) {});
        EXPECT_NEAR(loop->proxy().z, 0.0, 1e-9) << "pressed with 0.75 N it holds, time " << time;
        go(*loop, {0.001, 0.0003, -0.0015}, below, 1e-4, [](const Vec3&) {});
        EXPECT_LT(loop->proxy().z, -0.25e-3) << "in the plateau";
        go(*loop, below, above, 1e-4, [&](const Vec3&) { ASSERT_TRUE(is_finite(loop->proxy())); });
        EXPECT_LE(glm::length(loop->proxy() - above), 1e-12) << "out with the hand";
    }
}

// ------------------------------------------------------------------ a saddle (row 2)

// (x^2 - z^2) / 5 mm at its level 0: two wedges of free space, above and below, that touch in a
// line where the gradient vanishes. Which of them the proxy ends in is not ours to say; but no
// chord is deeper than the certificate, the spring gains no more than the way back to the level,
// and a hand held anywhere near comes to rest.
TEST_P(HardFields, OnASaddleTheProxyComesToRest) {
    const auto field = test::voxels_of(
        [](const Vec3& p) { return (p.x * p.x - p.z * p.z) / 0.005; }, 0.01, 0.5e-3);
    for (const double beside : {0.0, 1e-6, -0.1e-3, 0.4e-3}) {
        SCOPED_TRACE(beside);
        auto surfaces = one_surface(field);
        const double tau = static_cast<const VolumeContact&>(*surfaces[0]).scale().certificate;
        const auto anchored = felt(std::move(surfaces));
        const auto paper_mode = felt(memoryless(field, test::hard_everywhere()));
        for (ContactLoop* loop : {anchored.get(), paper_mode.get()}) {
            const Vec3 above{beside, 0.0002, 0.004};
            loop->start(above);
            Vec3 last = above;
            go(*loop, above, {beside, 0.0002, -0.0005}, 0.2e-3, [&](const Vec3& probe) {
                ASSERT_TRUE(is_finite(loop->proxy()));
                if (loop == anchored.get()) {
                    ASSERT_LE(deepest(*field, loop->subdivision().path()), tau * (1.0 + 1e-9));
                }
                last = probe;
            });
            for (int i = 0; i < 200; ++i)
                loop->move(last);
            const Vec3 held = loop->proxy();
            for (int i = 0; i < 100; ++i) {
                loop->move(last);
                // The tolerance of `adaptive`, which is what anyone can feel a hundredth of.
                ASSERT_LE(glm::length(loop->proxy() - held), 1e-7) << i;
            }
        }
    }
}

// ------------------------------------------------------------------ no numbers (row 3)

TEST_P(HardFields, VoxelsThatAreNoNumbersAreAHoleAndNothingElse) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    int bad = 0;
    // A plate of 4 mm with a hole of 6 x 6 mm in the middle.
    const auto field = test::voxels_of(
        [&](const Vec3& p) {
            const bool hole = std::abs(p.x) < 0.003 && std::abs(p.y) < 0.003;
            if (!hole) return 0.002 - std::abs(p.z);
            return ++bad % 3 == 0 ? nan : bad % 3 == 1 ? kInfinite : -kInfinite;
        },
        0.01, 0.5e-3);
    EXPECT_EQ(static_cast<const GridField&>(*field).replaced_voxels(),
              static_cast<std::size_t>(bad));
    const auto anchored = felt(one_surface(field));
    const auto paper_mode = felt(memoryless(field, test::hard_everywhere()));
    for (ContactLoop* loop : {anchored.get(), paper_mode.get()}) {
        const Vec3 above{0.0001, 0.0002, 0.005}, below{0.0001, 0.0002, -0.005};
        if (loop == anchored.get()) {
            loop->start(above);
            go(*loop, above, below, 0.2e-3, [](const Vec3&) {});
            EXPECT_EQ(loop->proxy(), below) << "free where there are no data";
        }
        std::mt19937_64 random(3);
        std::uniform_real_distribution<double> at(-0.006, 0.006);
        loop->start(above);
        for (int i = 0; i < 1000; ++i) {
            const double x = at(random), y = at(random), z = at(random);
            const SubdivisionResult result = loop->move({x, y, z});
            ASSERT_TRUE(is_finite(loop->proxy())) << i;
            ASSERT_TRUE(std::isfinite(result.residual_m)) << i;
        }
    }
}

// ------------------------------------------------------------------ steps of labels (row 4)

/// A ball of 8 mm in voxels of 1 mm, as a label is prepared: smoothed, its volume kept.
struct LabelledBall {
    static constexpr double kRadius = 8e-3, kVoxel = 1e-3;
    std::shared_ptr<const ScalarField> field;
    LevelSettings level;
    Vec3 center{0.0};

    LabelledBall() {
        AffineTransform frame;
        frame.linear = kVoxel * Mat3(1.0);
        center = kVoxel * Vec3{11.3, 12.1, 11.6};
        const LabelVolume labels = test::made_labels({24, 24, 24}, frame, 1, [&](const Vec3& i) {
            return glm::length(frame.point(i) - center) < kRadius ? 1 : 0;
        });
        const std::vector<std::size_t> chosen{0};
        const VoxelVolume occupancy = label_occupancy(labels, chosen, 7);
        const VoxelVolume smoothed = smooth_against_neighbours(labels, chosen, occupancy, 1.0);
        double volume_m3 = 0.0;
        for (const float v : occupancy.values)
            volume_m3 += v * kVoxel * kVoxel * kVoxel;
        level.level = level_keeping_volume(smoothed, volume_m3);
        field = std::make_shared<GridField>(smoothed, 0.0F);
    }
};

// Within a quarter of a voxel of the true ball, and no jerk of more than half a voxel times the
// stiffness. The shares of `fixed` and `paper` follow normals that differ from the level's, come
// off it by more than LevelSettings::free_m, and then fall back onto it towards the probe instead
// of along it: what they are late by they catch up in one frame, up to a voxel. The one step of
// `single` is as long as the proxy is late, and where its chord is blocked early the proxy stays:
// for dozens of frames, in which its force grows with the hand's way. It says so.
TEST_P(HardFields, ALabelsStepsAreNotFelt) {
    const LabelledBall ball;
    const auto loop = felt(one_surface(ball.field, ball.level));
    const auto probe = [&](int i) {
        const double angle = 0.2e-3 / 6e-3 * i;
        return ball.center +
               6e-3 * Vec3{std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle)};
    };
    loop->start(ball.center + 2.0 * (probe(0) - ball.center));
    for (int i = 0; i < 50; ++i)
        loop->move(probe(0));
    Vec3 force = loop->proxy() - probe(0);
    int stalled = 0;
    double squares = 0.0, jerk = 0.0; // of the force over the stiffness
    constexpr int kFrames = 600;      // three times round
    for (int i = 1; i <= kFrames; ++i) {
        const Vec3 before = loop->proxy();
        const SubdivisionResult result = loop->move(probe(i));
        if (loop->proxy() == before) {
            ASSERT_TRUE(result.flags & kStalled) << i;
            ++stalled;
        }
        const double off = glm::length(loop->proxy() - ball.center) - LabelledBall::kRadius;
        squares += off * off;
        const Vec3 now = loop->proxy() - probe(i);
        jerk = std::max(jerk, glm::length(now - force));
        force = now;
    }
    EXPECT_LE(std::sqrt(squares / kFrames), 0.25 * LabelledBall::kVoxel);
    if (GetParam() == SteppingMethod::single) {
        EXPECT_GT(stalled, 0);
        return;
    }
    EXPECT_LE(jerk, (GetParam() == SteppingMethod::adaptive ? 0.5 : 1.0) * LabelledBall::kVoxel);
    EXPECT_EQ(stalled, 0);
}

// ------------------------------------------------------------------ a wall of one voxel (row 5)

/// One layer of voxels across z in air of the value 0; its level 100 is 0.8 mm thick.
std::shared_ptr<const ScalarField> one_layer() {
    return test::voxels_of([](const Vec3& p) { return std::abs(p.z) < 0.5e-3 ? 500.0 : 0.0; }, 0.01,
                           1e-3);
}
constexpr double kHalfWall = 0.8e-3; // m: 1 - 100 / 500 of a voxel to either side

test::Surfaces wall(bool guarded, double strength_n) {
    LevelSettings level;
    level.level = 100.0;
    level.strength_n = strength_n;
    if (!guarded) return one_surface(one_layer(), level);
    test::Surfaces surfaces;
    const auto mesh = test::certified(
        test::box_mesh({-0.0095, -0.0095, -kHalfWall}, {0.0095, 0.0095, kHalfWall}));
    surfaces.push_back(std::make_unique<GuardedContact>(one_layer(), level, mesh, 1e-3));
    return surfaces;
}

// At 2 m/s, 2 mm per frame, a stroke lands anywhere in the wall or has jumped it.
TEST_P(HardFields, AWallOfOneVoxelIsNotPassedAt2MetresPerSecond) {
    const int cap =
        GetParam() == SteppingMethod::single ? 1 : SteppingSettings{}.evaluation_cap + 2;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> share;
    for (const bool guarded : {false, true}) {
        const auto loop = felt(wall(guarded, kInfinite));
        for (int stroke = 0; stroke < 50; ++stroke) {
            const double x = 0.004 * (share(random) - 0.5);
            const double z = 0.006 + 0.002 * share(random);
            loop->start({x, 0.0, z});
            for (int i = 1; i <= 9; ++i) {
                const SubdivisionResult result = loop->move({x, 0.0002 * i, z - 0.002 * i});
                ASSERT_GE(result.evaluations, 1u);
                ASSERT_LE(result.evaluations, static_cast<std::uint32_t>(cap));
            }
            ASSERT_NEAR(loop->proxy().z, kHalfWall, 26e-6) << "guarded " << guarded;
        }
    }
}

// 1 N at 500 N/m is 2 mm: up to that depth it holds, and beyond it yields.
TEST_P(HardFields, AWallOfOneVoxelIsPassedByWhoPressesHarderThanItsStrength) {
    for (const bool guarded : {false, true}) {
        const auto loop = felt(wall(guarded, 1.0));
        const Vec3 above{0.001, 0.0, 0.005};
        loop->start(above);
        go(*loop, above, {0.001, 0.0, kHalfWall - 1.9e-3}, 1e-4, [](const Vec3&) {});
        EXPECT_NEAR(loop->proxy().z, kHalfWall, 1e-9) << "guarded " << guarded;
        go(*loop, {0.001, 0.0, kHalfWall - 1.9e-3}, {0.001, 0.0, -0.008}, 1e-4, [](const Vec3&) {});
        EXPECT_LT(loop->proxy().z, -kHalfWall) << "guarded " << guarded;
    }
}

// What remembers nothing and has no certificate looks at the field where its sub-steps land.
// Central differences see a layer from two voxels to either side: 2 mm a frame land in them, 5 mm
// with one evaluation do not always; an eighth of that does.
TEST_P(HardFields, AMemorylessWallOfOneVoxelIsJumpedByOneEvaluation) {
    const auto loop = felt(memoryless(one_layer(), test::hard_everywhere()));
    const auto passed = [&](double step) {
        int count = 0;
        for (int stroke = 0; stroke < 50; ++stroke) {
            const double z = 0.007 + step * (stroke + 0.5) / 50.0;
            const Vec3 above{0.001, 0.0, z};
            loop->start(above);
            go(*loop, above, above - Vec3{0, 0, 4.0 * 0.005}, step, [](const Vec3&) {});
            count += loop->proxy().z < 0.0;
        }
        return count;
    };
    const bool one = GetParam() == SteppingMethod::single || GetParam() == SteppingMethod::adaptive;
    EXPECT_EQ(passed(0.002), 0);
    if (one) {
        EXPECT_GT(passed(0.005), 10);
    } else {
        EXPECT_EQ(passed(0.005), 0);
    }
}

// A program's own field may have a curvature that is no number, or none to speak of. A step that
// follows it leads nowhere, and is not made; the planes' own step is. The sphere is felt all the
// same.
TEST_P(HardFields, ACurvatureThatIsNoNumberLeadsNowhere) {
    constexpr double kRadius = 0.02;
    for (const double factor : {std::numeric_limits<double>::quiet_NaN(), kInfinite, 1e308}) {
        SCOPED_TRACE(factor);
        test::HostBall::Spoil spoil;
        spoil.turn_factor = factor;
        const auto loop = felt(one_surface(std::make_shared<const test::HostBall>(kRadius, spoil)));
        const Vec3 begin{0, 0, 1.1 * kRadius}, end{0.25 * kRadius, 0, 0.9 * kRadius};
        loop->start(begin);
        go(*loop, begin, end, 0.2e-3, [&](const Vec3&) {
            ASSERT_TRUE(is_finite(loop->proxy()));
            ASSERT_GE(glm::length(loop->proxy()), kRadius - 25e-6 - 1e-12);
        });
        for (int i = 0; i < 50; ++i)
            ASSERT_TRUE(is_finite(loop->move(end).proxy));
        EXPECT_NEAR(glm::length(loop->proxy()), kRadius, 25e-6 + 1e-12);
    }
}

// ------------------------------------------------------------------ corners (row 6)

/// A hand that is pushed down into an edge along y while it sways across it: the deepest end of a
/// frame behind either face, m.
double deepest_end(ContactLoop& loop, const ScalarField& field) {
    const auto sampler = field.make_sampler();
    loop.start({0, 0, 0.02});
    double deep = -1.0;
    for (int i = 0; i <= 400; ++i) {
        loop.move({0.004 * std::sin(0.05 * i), 0.0002 * i, 0.02 - 0.0001 * i});
        deep = std::max(deep, sampler->value(loop.proxy()));
    }
    return deep;
}

// Up to three planes make a corner: to rounding where every plane is met in full. A share of a step
// may end before the second face has been met, within the certificate. One memoryless plane is no
// corner: hundreds of micrometres behind the other face (numerics 3.5).
TEST_P(HardFields, ConcaveCornersOfEveryAngleHold) {
    double worst_memoryless = 0.0;
    for (const double opening : {10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 175.0}) {
        SCOPED_TRACE(opening);
        const std::shared_ptr<const ScalarField> field = make_wedge(360.0 - opening);
        const double deep = deepest_end(*felt(one_surface(field)), *field);
        EXPECT_LE(deep, GetParam() == SteppingMethod::adaptive ? 1e-12 : 25e-6 + 1e-12);
        worst_memoryless =
            std::max(worst_memoryless,
                     deepest_end(*felt(memoryless(field, test::hard_from_zero())), *field));
    }
    EXPECT_GT(worst_memoryless, 50e-6);
}

// Over a convex edge and away: what has been left is not felt. In front of both faces, with nothing
// between proxy and probe, the proxy is the probe. A single evaluation has the face's plane still,
// which it was on when the frame began: it is a frame late.
TEST_P(HardFields, ConvexEdgesLeaveNoGhostForce) {
    for (const double angle : {10.0, 60.0, 90.0, 150.0, 175.0}) {
        SCOPED_TRACE(angle);
        const std::shared_ptr<const ScalarField> field = make_wedge(angle);
        const auto sampler = field->make_sampler();
        const auto loop = felt(one_surface(field));
        const double half = 0.5 * angle * std::numbers::pi / 180.0;
        const Vec3 face{std::sin(half), 0.0, -std::cos(half)}; // from the edge down the face
        const Vec3 out{std::cos(half), 0.0, std::sin(half)};
        const Vec3 begin = 0.01 * face - 0.5e-3 * out, end = -0.01 * face - 0.5e-3 * out;
        loop->start(0.01 * face + 0.5e-3 * out);
        int free = 0;
        bool was_clear = false;
        Vec3 before = loop->proxy();
        go(*loop, begin, end, 0.2e-3, [&](const Vec3& probe) {
            ASSERT_LE(sampler->value(loop->proxy()), 25e-6 + 1e-12);
            const bool in_front = sampler->value(probe) < -1e-5;
            const bool clear = in_front && !sampler->first_root(before, probe, 0.0);
            if (clear && (was_clear || GetParam() != SteppingMethod::single)) {
                ASSERT_EQ(loop->proxy(), probe);
                ++free;
            }
            was_clear = clear;
            before = loop->proxy();
        });
        EXPECT_GT(free, 10) << "it went over the edge";
    }
}

// ------------------------------------------------------------------ the end of the data (row 14)

// A block that the scan cuts is closed there: a hand that presses 1 mm into its face and goes on
// beyond the last voxel is let go over an edge within one voxel. In no frame does the force grow by
// more than the hand's movement and the way back to the level add, and beyond there is nothing.
TEST_P(HardFields, BeyondTheLastVoxelTheHandIsFree) {
    constexpr double kStep = 1e-4, kVoxel = 0.5e-3, kHalf = 0.01;
    const auto field = test::voxels_of([](const Vec3& p) { return -p.z; }, kHalf, kVoxel);
    const Vec3 begin{0.0, 0.0003, -0.001}, end{0.015, 0.0003, -0.001};
    const auto sampler = field->make_sampler();
    const auto anchored = felt(one_surface(field));
    const auto paper_mode = felt(memoryless(field, test::hard_everywhere()));
    for (ContactLoop* loop : {anchored.get(), paper_mode.get()}) {
        loop->start({0.0, 0.0003, loop == anchored.get() ? 0.001 : 0.0});
        loop->move(begin);
        double before = glm::length(loop->proxy() - begin), behind = 0.0;
        EXPECT_NEAR(before, 0.001, 1e-6) << "pressed";
        go(*loop, begin, end, kStep, [&](const Vec3& probe) {
            const double lag = glm::length(loop->proxy() - probe);
            ASSERT_LE(lag, before + kStep + behind + 1e-15) << probe.x;
            before = lag;
            const double value = sampler->value(loop->proxy());
            behind = std::max(0.0, value); // a slope of 1 and more
            if (probe.x > kHalf + kVoxel + 1e-3) {
                ASSERT_EQ(lag, 0.0) << probe.x;
            }
        });
    }
}

} // namespace
} // namespace palpate
