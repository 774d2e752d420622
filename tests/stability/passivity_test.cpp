// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/passivity_control.h>
// What the loop may do to a hand: with the probe held its spring never gains energy, and round a
#include <palpate/haptics/hand/passivity_control.h>
// closed loop the hand gets no more work than one force per frame must give away (numerics 5, case
#include <palpate/haptics/hand/passivity_control.h>
// 16).
#include <palpate/haptics/hand/passivity_control.h>
//
#include <palpate/haptics/hand/passivity_control.h>
// Let E_n = k/2 |x_n - a_n|^2. The force k (x_n - a_n) is held while the hand moves on by da, so
#include <palpate/haptics/hand/passivity_control.h>
// the work on it is W_n = E_n - k/2 |x_n - a_(n+1)|^2 + k/2 |da|^2: an identity. Where the proxy's
#include <palpate/haptics/hand/passivity_control.h>
// own movement in the frame gains at most g, W_n <= E_n - E_(n+1) + k/2 |da|^2 + g, and the sum
#include <palpate/haptics/hand/passivity_control.h>
// over a path is bounded by what E loses, by k/2 sum |da|^2 and by the gains. Without a level to
#include <palpate/haptics/hand/passivity_control.h>
// return to there are none. Returning to a level from c metres behind it needs at most |f| c + k/2
#include <palpate/haptics/hand/passivity_control.h>
// c^2.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <palpate/haptics/hand/passivity_control.h>
#include <random>

#include <gtest/gtest.h>
#include <palpate/haptics/hand/passivity_control.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/felt_cavity.h"
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
namespace palpate {
#include <palpate/haptics/hand/passivity_control.h>
namespace {
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
using test::ContactLoop;
#include <palpate/haptics/hand/passivity_control.h>
using test::Felt;
#include <palpate/haptics/hand/passivity_control.h>
using test::felt_cavity;
#include <palpate/haptics/hand/passivity_control.h>
using test::kCavity;
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
double energy(const Vec3& proxy, const Vec3& probe) {
#include <palpate/haptics/hand/passivity_control.h>
    return 0.5 * ContactLoop::kStiffness * squared_length(proxy - probe);
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
/// How far behind the level a proxy is, m; none where nothing remembers a level.
#include <palpate/haptics/hand/passivity_control.h>
double behind(Felt felt, const Vec3& proxy) {
#include <palpate/haptics/hand/passivity_control.h>
    const bool anchored = felt == Felt::volume || felt == Felt::guarded;
#include <palpate/haptics/hand/passivity_control.h>
    return anchored ? std::max(0.0, glm::length(proxy) - kCavity) : 0.0;
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
/// Most that a frame may add to the energy of a spring of that length by returning to the level.
#include <palpate/haptics/hand/passivity_control.h>
double most_gain(double length, double behind_m) {
#include <palpate/haptics/hand/passivity_control.h>
    return ContactLoop::kStiffness * (length * behind_m + 0.5 * behind_m * behind_m);
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
class Passivity : public testing::TestWithParam<test::MethodAndFelt> {
#include <palpate/haptics/hand/passivity_control.h>
protected:
#include <palpate/haptics/hand/passivity_control.h>
    SteppingMethod method() const { return std::get<0>(GetParam()); }
#include <palpate/haptics/hand/passivity_control.h>
    Felt felt() const { return std::get<1>(GetParam()); }
#include <palpate/haptics/hand/passivity_control.h>
    std::unique_ptr<ContactLoop> loop() const {
#include <palpate/haptics/hand/passivity_control.h>
        return felt_cavity(felt(), test::stepping(method()));
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
};
#include <palpate/haptics/hand/passivity_control.h>
INSTANTIATE_TEST_SUITE_P(Every, Passivity,
#include <palpate/haptics/hand/passivity_control.h>
                         testing::Combine(testing::ValuesIn(test::kEveryMethod),
#include <palpate/haptics/hand/passivity_control.h>
                                          testing::Values(Felt::volume, Felt::guarded,
#include <palpate/haptics/hand/passivity_control.h>
                                                          Felt::memoryless, Felt::follow)),
#include <palpate/haptics/hand/passivity_control.h>
                         test::name_of_case);
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
/// Rounding of energies: 1e-12 of them, and of positions of 50 mm under forces of 25 N.
#include <palpate/haptics/hand/passivity_control.h>
double rounding(double e) { return 1e-12 * e + 1e-15; }
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
TEST_P(Passivity, AHeldProbesSpringNeverGains) {
#include <palpate/haptics/hand/passivity_control.h>
    const auto loop = this->loop();
#include <palpate/haptics/hand/passivity_control.h>
    std::mt19937_64 random(9);
#include <palpate/haptics/hand/passivity_control.h>
    std::normal_distribution<double> normal;
#include <palpate/haptics/hand/passivity_control.h>
    loop->start({0.0, 0.0, kCavity - 1e-9});
#include <palpate/haptics/hand/passivity_control.h>
    for (int place = 0; place < 200; ++place) {
#include <palpate/haptics/hand/passivity_control.h>
        const double x = normal(random), y = normal(random), z = normal(random);
#include <palpate/haptics/hand/passivity_control.h>
        const Vec3 probe = 0.053 * glm::normalize(Vec3{x, y, z});
#include <palpate/haptics/hand/passivity_control.h>
        double before = energy(loop->proxy(), probe);
#include <palpate/haptics/hand/passivity_control.h>
        for (int frame = 0; frame < 20; ++frame) {
#include <palpate/haptics/hand/passivity_control.h>
            const double gain =
#include <palpate/haptics/hand/passivity_control.h>
                most_gain(glm::length(loop->proxy() - probe), behind(felt(), loop->proxy()));
#include <palpate/haptics/hand/passivity_control.h>
            loop->move(probe);
#include <palpate/haptics/hand/passivity_control.h>
            const double after = energy(loop->proxy(), probe);
#include <palpate/haptics/hand/passivity_control.h>
            ASSERT_LE(after, before + gain + rounding(before)) << place << ", frame " << frame;
#include <palpate/haptics/hand/passivity_control.h>
            before = after;
#include <palpate/haptics/hand/passivity_control.h>
        }
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
class HeldOnBodies : public testing::TestWithParam<SteppingMethod> {};
#include <palpate/haptics/hand/passivity_control.h>
INSTANTIATE_TEST_SUITE_P(Every, HeldOnBodies, testing::ValuesIn(test::kEveryMethod),
#include <palpate/haptics/hand/passivity_control.h>
                         [](const testing::TestParamInfo<SteppingMethod>& of) {
#include <palpate/haptics/hand/passivity_control.h>
                             return test::name_of(of.param);
#include <palpate/haptics/hand/passivity_control.h>
                         });
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
/// Most that a frame's proxy moves away from probes held `reach` from the origin, beyond what it
#include <palpate/haptics/hand/passivity_control.h>
/// was behind the level at the frame's start, m.
#include <palpate/haptics/hand/passivity_control.h>
double worst_rise(const std::shared_ptr<const ScalarField>& field, SteppingMethod method,
#include <palpate/haptics/hand/passivity_control.h>
                  double reach) {
#include <palpate/haptics/hand/passivity_control.h>
    const auto loop = test::loop_of(test::stepping(method), test::one_surface(field));
#include <palpate/haptics/hand/passivity_control.h>
    const auto sampler = field->make_sampler();
#include <palpate/haptics/hand/passivity_control.h>
    std::mt19937_64 random(9);
#include <palpate/haptics/hand/passivity_control.h>
    std::normal_distribution<double> normal;
#include <palpate/haptics/hand/passivity_control.h>
    const auto direction = [&] {
#include <palpate/haptics/hand/passivity_control.h>
        const double x = normal(random), y = normal(random), z = normal(random);
#include <palpate/haptics/hand/passivity_control.h>
        return glm::normalize(Vec3{x, y, z});
#include <palpate/haptics/hand/passivity_control.h>
    };
#include <palpate/haptics/hand/passivity_control.h>
    Vec3 start{0.0};
#include <palpate/haptics/hand/passivity_control.h>
    while (sampler->value(start) > -1e-3)
#include <palpate/haptics/hand/passivity_control.h>
        start = 0.06 * direction();
#include <palpate/haptics/hand/passivity_control.h>
    loop->start(start);
#include <palpate/haptics/hand/passivity_control.h>
    double worst = 0.0;
#include <palpate/haptics/hand/passivity_control.h>
    for (int place = 0; place < 100; ++place) {
#include <palpate/haptics/hand/passivity_control.h>
        const Vec3 probe = reach * direction();
#include <palpate/haptics/hand/passivity_control.h>
        double before = glm::length(loop->proxy() - probe);
#include <palpate/haptics/hand/passivity_control.h>
        for (int frame = 0; frame < 40; ++frame) {
#include <palpate/haptics/hand/passivity_control.h>
            const FieldSample here = sampler->sample(loop->proxy());
#include <palpate/haptics/hand/passivity_control.h>
            const double slope = glm::length(here.slope);
#include <palpate/haptics/hand/passivity_control.h>
            const double behind_m = here.value > 0.0 ? here.value / slope : 0.0;
#include <palpate/haptics/hand/passivity_control.h>
            loop->move(probe);
#include <palpate/haptics/hand/passivity_control.h>
            const double after = glm::length(loop->proxy() - probe);
#include <palpate/haptics/hand/passivity_control.h>
            worst = std::max(worst, after - before - behind_m);
#include <palpate/haptics/hand/passivity_control.h>
            before = after;
#include <palpate/haptics/hand/passivity_control.h>
        }
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
    return worst;
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
// Rounding of 50 mm, as it adds up over the sub-steps of a frame.
#include <palpate/haptics/hand/passivity_control.h>
TEST_P(HeldOnBodies, TheSpringGainsNothingButTheWayBackToTheLevel) {
#include <palpate/haptics/hand/passivity_control.h>
    const std::shared_ptr<const ScalarField> bumpy = make_bumpy_cavity(kCavity, 1e-3, 15e-3);
#include <palpate/haptics/hand/passivity_control.h>
    EXPECT_LE(worst_rise(bumpy, GetParam(), 0.053), 1e-15);
#include <palpate/haptics/hand/passivity_control.h>
    const std::shared_ptr<const ScalarField> ball = make_solid_sphere(kCavity);
#include <palpate/haptics/hand/passivity_control.h>
    EXPECT_LE(worst_rise(ball, GetParam(), 0.04), 1e-15);
#include <palpate/haptics/hand/passivity_control.h>
    const std::shared_ptr<const ScalarField> notch = make_wedge(300.0);
#include <palpate/haptics/hand/passivity_control.h>
    EXPECT_LE(worst_rise(notch, GetParam(), 0.03), 1e-15);
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
// On voxels the proxy comes to rest where central differences point at the probe, which is not
#include <palpate/haptics/hand/passivity_control.h>
// quite where the level is nearest: 0.04 rad off, 2.5 mm deep, the lag is 0.04^2 / 2 of that
#include <palpate/haptics/hand/passivity_control.h>
// longer.
#include <palpate/haptics/hand/passivity_control.h>
TEST_P(HeldOnBodies, OnVoxelsItGainsMicrometres) {
#include <palpate/haptics/hand/passivity_control.h>
    const auto formula = make_bumpy_cavity(0.02, 1e-3, 15e-3)->make_sampler();
#include <palpate/haptics/hand/passivity_control.h>
    const auto field =
#include <palpate/haptics/hand/passivity_control.h>
        test::voxels_of([&](const Vec3& p) { return formula->value(p); }, 0.024, 1e-3);
#include <palpate/haptics/hand/passivity_control.h>
    EXPECT_LE(worst_rise(field, GetParam(), 0.0225), 2e-6);
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
struct Work {
#include <palpate/haptics/hand/passivity_control.h>
    double on_hand_j = 0.0;
#include <palpate/haptics/hand/passivity_control.h>
    double of_steps_j = 0.0; ///< k/2 sum |da|^2
#include <palpate/haptics/hand/passivity_control.h>
    double of_levels_j = 0.0;
#include <palpate/haptics/hand/passivity_control.h>
    double lost_j = 0.0; ///< E_0 - E_1
#include <palpate/haptics/hand/passivity_control.h>
};
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
/// Twice round a loop that goes in and out of contact, sideways, and deep.
#include <palpate/haptics/hand/passivity_control.h>
Work round_trip(ContactLoop& loop, Felt felt, int frames) {
#include <palpate/haptics/hand/passivity_control.h>
    const auto probe = [&](int frame) {
#include <palpate/haptics/hand/passivity_control.h>
        const double angle = 2.0 * std::numbers::pi * frame / frames;
#include <palpate/haptics/hand/passivity_control.h>
        const double r = kCavity + 1e-3 + 3e-3 * std::sin(3.0 * angle);
#include <palpate/haptics/hand/passivity_control.h>
        const double swing = 0.3 * std::cos(angle);
#include <palpate/haptics/hand/passivity_control.h>
        return r * Vec3{std::cos(swing), std::sin(swing), 0.2 * std::sin(2.0 * angle)};
#include <palpate/haptics/hand/passivity_control.h>
    };
#include <palpate/haptics/hand/passivity_control.h>
    loop.start((kCavity - 1e-9) * glm::normalize(probe(0)));
#include <palpate/haptics/hand/passivity_control.h>
    loop.move(probe(0));
#include <palpate/haptics/hand/passivity_control.h>
    Work work;
#include <palpate/haptics/hand/passivity_control.h>
    work.lost_j = energy(loop.proxy(), probe(0));
#include <palpate/haptics/hand/passivity_control.h>
    for (int i = 1; i <= 2 * frames; ++i) {
#include <palpate/haptics/hand/passivity_control.h>
        const Vec3 a = probe(i % frames), moved = a - probe((i - 1) % frames);
#include <palpate/haptics/hand/passivity_control.h>
        const Vec3 x = loop.proxy();
#include <palpate/haptics/hand/passivity_control.h>
        work.on_hand_j += ContactLoop::kStiffness * glm::dot(x - (a - moved), moved);
#include <palpate/haptics/hand/passivity_control.h>
        work.of_steps_j += 0.5 * ContactLoop::kStiffness * squared_length(moved);
#include <palpate/haptics/hand/passivity_control.h>
        work.of_levels_j += most_gain(glm::length(x - a), behind(felt, x));
#include <palpate/haptics/hand/passivity_control.h>
        loop.move(a);
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
    work.lost_j -= energy(loop.proxy(), probe(0));
#include <palpate/haptics/hand/passivity_control.h>
    return work;
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
TEST_P(Passivity, AClosedLoopGivesTheHandNoMoreThanItsStepsAndTheLevel) {
#include <palpate/haptics/hand/passivity_control.h>
    for (const int frames : {150, 1500, 15000}) { // the sixth part of a second, and slower
#include <palpate/haptics/hand/passivity_control.h>
        const auto loop = this->loop();
#include <palpate/haptics/hand/passivity_control.h>
        const Work work = round_trip(*loop, felt(), frames);
#include <palpate/haptics/hand/passivity_control.h>
        const double bound = work.lost_j + work.of_steps_j + work.of_levels_j;
#include <palpate/haptics/hand/passivity_control.h>
        EXPECT_LE(work.on_hand_j, bound + frames * rounding(0.01)) << frames;
#include <palpate/haptics/hand/passivity_control.h>
        // The bound is worth something: what the level may give is a small part of what went round.
#include <palpate/haptics/hand/passivity_control.h>
        if (method() == SteppingMethod::adaptive) {
#include <palpate/haptics/hand/passivity_control.h>
            EXPECT_LE(work.of_levels_j, 1e-3 * work.of_steps_j) << frames;
#include <palpate/haptics/hand/passivity_control.h>
        }
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
/// A wall that pushes a hand that is on its way back, and no other: it gives energy away.
#include <palpate/haptics/hand/passivity_control.h>
class Bouncing final : public Effect {
#include <palpate/haptics/hand/passivity_control.h>
public:
#include <palpate/haptics/hand/passivity_control.h>
    void begin(const FrameContext& frame) noexcept override {
#include <palpate/haptics/hand/passivity_control.h>
        const double depth = glm::length(frame.probe) - kCavity;
#include <palpate/haptics/hand/passivity_control.h>
        pushes_ = depth > 0.0 && depth < depth_;
#include <palpate/haptics/hand/passivity_control.h>
        depth_ = depth;
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
#include <palpate/haptics/hand/passivity_control.h>
        if (pushes_) primitives.add_force(-0.5 * glm::normalize(proxy)); // N
#include <palpate/haptics/hand/passivity_control.h>
    }
#include <palpate/haptics/hand/passivity_control.h>
    QueryCount queries() const noexcept override { return {}; }
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
private:
#include <palpate/haptics/hand/passivity_control.h>
    bool pushes_ = false;
#include <palpate/haptics/hand/passivity_control.h>
    double depth_ = 0.0; // of the probe, m
#include <palpate/haptics/hand/passivity_control.h>
};
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
// The control: the sums would tell.
#include <palpate/haptics/hand/passivity_control.h>
TEST(PassivityControl, AWallThatPushesHarderOnTheWayOutGivesTheHandMore) {
#include <palpate/haptics/hand/passivity_control.h>
    test::Effects effects;
#include <palpate/haptics/hand/passivity_control.h>
    effects.push_back(std::make_unique<Bouncing>());
#include <palpate/haptics/hand/passivity_control.h>
    const auto loop = test::loop_of(test::stepping(SteppingMethod::single), {}, std::move(effects));
#include <palpate/haptics/hand/passivity_control.h>
    const Work work = round_trip(*loop, Felt::memoryless, 15000);
#include <palpate/haptics/hand/passivity_control.h>
    EXPECT_GT(work.on_hand_j, work.lost_j + work.of_steps_j);
#include <palpate/haptics/hand/passivity_control.h>
}
#include <palpate/haptics/hand/passivity_control.h>

#include <palpate/haptics/hand/passivity_control.h>
} // namespace
#include <palpate/haptics/hand/passivity_control.h>
} // namespace palpate
#include <palpate/haptics/hand/passivity_control.h>
