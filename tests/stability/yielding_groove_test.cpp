// SPDX-License-Identifier: Apache-2.0
// A groove in what yields: both walls are one surface, and hold with its strength together. The
// force of max(0, depth) times the strength s is s times a mean of the walls' normals: at most s,
// and s sin(o/2) where a groove of opening o is pressed straight.
//
// Seen: with one plane for an evaluation the walls took turns, the one that was left out blocked
// the way, and the coupling was stretched to five times the strength in jumps of as much. Behind a
// groove of a mesh nothing was felt any more.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/stability/random/wedge_table.h"
#include "tests/support/contact_loop.h"
#include "tests/support/stepping_methods.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::Kind;

constexpr double kStrength_n = 1.0;
constexpr double kOpenings_deg[] = {30.0, 60.0, 90.0, 120.0, 150.0};
constexpr std::uint32_t kUnfinished = kEvaluationCap | kStalled;

std::string method_name(const testing::TestParamInfo<SteppingMethod>& of) {
    return test::name_of(of.param);
}

class YieldingGrooveOfAFormula : public testing::TestWithParam<SteppingMethod> {};
INSTANTIATE_TEST_SUITE_P(Every, YieldingGrooveOfAFormula, testing::ValuesIn(test::kEveryMethod),
                         method_name);

std::unique_ptr<ContactLoop> groove(double opening_deg, SteppingMethod method) {
    LevelSettings level;
    level.strength_n = kStrength_n;
    return test::loop_of(test::stepping_of(method),
                         test::one_surface(make_wedge(360.0 - opening_deg), level));
}

Vec3 force_n(const ContactLoop& loop, const Vec3& probe) {
    return ContactLoop::kStiffness * (loop.proxy() - probe);
}

// Multipliers are within 1e-12 of the strength, places of some centimetres within rounding.
TEST_P(YieldingGrooveOfAFormula, PressedStraightHoldsWithItsClosedForm) {
    for (const double opening_deg : kOpenings_deg) {
        const double holds_n = kStrength_n * std::sin(opening_deg * std::numbers::pi / 360.0);
        const auto loop = groove(opening_deg, GetParam());
        loop->start({0, 0, 0.005});
        for (int i = 0; i <= 400; ++i) {
            const double z = 0.005 - 0.0001 * i;
            const SubdivisionResult frame = loop->move({0, 0, z});
            if (i < 70) continue; // the edge is a tie: one evaluation a frame takes some
            ASSERT_EQ(frame.flags, 0u) << opening_deg << " degrees, frame " << i;
            const Vec3 force = force_n(*loop, {0, 0, z});
            ASSERT_NEAR(force.z, std::min(-ContactLoop::kStiffness * z, holds_n), 1e-9)
                << opening_deg << " degrees, frame " << i;
            ASSERT_NEAR(force.x, 0.0, 1e-9) << opening_deg << " degrees, frame " << i;
        }
    }
}

// Pressed 4 cm down while the hand sways. A minimiser moves no farther than what draws it, so that
// the force changes by no more than twice what the probe's way stretches the coupling by.
TEST_P(YieldingGrooveOfAFormula, HoldsWithNoMoreThanItsStrengthAndDoesNotJump) {
    for (const double opening_deg : kOpenings_deg) {
        const auto loop = groove(opening_deg, GetParam());
        Vec3 probe{0, 0, 0.02}, before{0.0};
        loop->start(probe);
        for (int i = 0; i <= 600; ++i) {
            const Vec3 last = probe;
            probe = {1e-3 * std::sin(0.05 * i), 0.0, 0.02 - 0.0001 * i};
            const SubdivisionResult frame = loop->move(probe);
            const Vec3 force = force_n(*loop, probe);
            ASSERT_EQ(frame.flags, 0u) << opening_deg << " degrees, frame " << i;
            ASSERT_LE(glm::length(force), kStrength_n * (1.0 + 1e-9))
                << opening_deg << " degrees, frame " << i;
            ASSERT_LE(glm::length(force - before),
                      2.0 * ContactLoop::kStiffness * glm::length(probe - last) + 1e-9)
                << opening_deg << " degrees, frame " << i;
            before = force;
        }
        EXPECT_GT(glm::length(before), 0.25 * kStrength_n) << opening_deg << " degrees";
    }
}

using Case = std::tuple<Kind, SteppingMethod>;
class YieldingGroove : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Every, YieldingGroove,
                         testing::Combine(testing::Values(Kind::volume, Kind::mesh, Kind::guarded),
                                          testing::ValuesIn(test::kEveryMethod)),
                         [](const testing::TestParamInfo<Case>& of) {
                             return test::name_of(std::get<0>(of.param)) +
                                    test::name_of(std::get<1>(of.param));
                         });

// Of data and of facets, 6 mm deep, and then held. A frame that is not at its end says so, and
// one that meets a wall with its last movement has not felt it yet (RandomPressing). One evaluation
// a frame may have the wall that it met last, and stay before the other: there alone the force is
// half as much again.
TEST_P(YieldingGroove, HoldsWithNoMoreThanItsStrengthAndIsNotLost) {
    const auto [kind, method] = GetParam();
    const bool one_wall = method == SteppingMethod::single && kind != Kind::mesh;
    for (const double opening_deg : kOpenings_deg) {
        SCOPED_TRACE(testing::Message() << opening_deg << " degrees");
        const auto loop = test::loop_of(test::stepping_of(method),
                                        stability::wedge_surfaces(stability::WedgeShape::groove,
                                                                  opening_deg, kind, kStrength_n));
        loop->start({0, 0.0003, 0.004});
        int above = 0, unfinished = 0;
        double most_n = 0.0, now_n = 0.0;
        for (int i = 0; i <= 400; ++i) {
            const int step = std::min(i, 100);
            const Vec3 probe{0.5e-3 * std::sin(0.05 * step), 0.0003, 0.004 - 0.0001 * step};
            const SubdivisionResult frame = loop->move(probe);
            now_n = glm::length(force_n(*loop, probe));
            if (frame.flags & kUnfinished) {
                ++unfinished;
                continue;
            }
            most_n = std::max(most_n, now_n);
            above += now_n > kStrength_n * (1.0 + 1e-6);
        }
        EXPECT_LE(most_n, (one_wall ? 1.5 : 1.1) * kStrength_n);
        if (!one_wall) {
            EXPECT_LE(above, method == SteppingMethod::adaptive ? 0 : 2);
        }
        EXPECT_LE(unfinished, 60); // of the 100 in which the probe moves
        EXPECT_GT(now_n, 0.25 * kStrength_n);
    }
}

} // namespace
} // namespace palpate
