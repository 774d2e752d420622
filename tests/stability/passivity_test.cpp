// SPDX-License-Identifier: Apache-2.0
// What the loop may do to a hand: with the probe held its spring never gains energy, and round a
// closed loop the hand gets no more work than one force per frame must give away (numerics 5, case
// 16).
//
// Let E_n = k/2 |x_n - a_n|^2. The force k (x_n - a_n) is held while the hand moves on by da, so
// the work on it is W_n = E_n - k/2 |x_n - a_(n+1)|^2 + k/2 |da|^2: an identity. Where the proxy's
// own movement in the frame gains at most g, W_n <= E_n - E_(n+1) + k/2 |da|^2 + g, and the sum
// over a path is bounded by what E loses, by k/2 sum |da|^2 and by the gains. Without a level to
// return to there are none. Returning to a level from c metres behind it needs at most |f| c + k/2
// c^2.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/felt_cavity.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::Felt;
using test::felt_cavity;
using test::kCavity;

double energy(const Vec3& proxy, const Vec3& probe) {
    return 0.5 * ContactLoop::kStiffness * squared_length(proxy - probe);
}

/// How far behind the level a proxy is, m; none where nothing remembers a level.
double behind(Felt felt, const Vec3& proxy) {
    const bool anchored = felt == Felt::volume || felt == Felt::guarded;
    return anchored ? std::max(0.0, glm::length(proxy) - kCavity) : 0.0;
}

/// Most that a frame may add to the energy of a spring of that length by returning to the level.
double most_gain(double length, double behind_m) {
    return ContactLoop::kStiffness * (length * behind_m + 0.5 * behind_m * behind_m);
}

class Passivity : public testing::TestWithParam<test::MethodAndFelt> {
protected:
    SteppingMethod method() const { return std::get<0>(GetParam()); }
    Felt felt() const { return std::get<1>(GetParam()); }
    std::unique_ptr<ContactLoop> loop() const {
        return felt_cavity(felt(), test::stepping_of(method()));
    }
};
INSTANTIATE_TEST_SUITE_P(Every, Passivity,
                         testing::Combine(testing::ValuesIn(test::kEveryMethod),
                                          testing::Values(Felt::volume, Felt::guarded,
                                                          Felt::memoryless, Felt::follow)),
                         test::name_of_case);

/// Rounding of energies: 1e-12 of them, and of positions of 50 mm under forces of 25 N.
double rounding(double e) { return 1e-12 * e + 1e-15; }

TEST_P(Passivity, AHeldProbesSpringNeverGains) {
    const auto loop = this->loop();
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    loop->start({0.0, 0.0, kCavity - 1e-9});
    for (int place = 0; place < 200; ++place) {
        const double x = normal(random), y = normal(random), z = normal(random);
        const Vec3 probe = 0.053 * glm::normalize(Vec3{x, y, z});
        double before = energy(loop->proxy(), probe);
        for (int frame = 0; frame < 20; ++frame) {
            const double gain =
                most_gain(glm::length(loop->proxy() - probe), behind(felt(), loop->proxy()));
            loop->move(probe);
            const double after = energy(loop->proxy(), probe);
            ASSERT_LE(after, before + gain + rounding(before)) << place << ", frame " << frame;
            before = after;
        }
    }
}

class HeldOnBodies : public testing::TestWithParam<SteppingMethod> {};
INSTANTIATE_TEST_SUITE_P(Every, HeldOnBodies, testing::ValuesIn(test::kEveryMethod),
                         [](const testing::TestParamInfo<SteppingMethod>& of) {
                             return test::name_of(of.param);
                         });

/// Most that a frame's proxy moves away from probes held `reach` from the origin, beyond what it
/// was behind the level at the frame's start, m.
double worst_rise(const std::shared_ptr<const ScalarField>& field, SteppingMethod method,
                  double reach) {
    const auto loop = test::loop_of(test::stepping_of(method), test::one_surface(field));
    const auto sampler = field->make_sampler();
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
        const double x = normal(random), y = normal(random), z = normal(random);
        return glm::normalize(Vec3{x, y, z});
    };
    Vec3 start{0.0};
    while (sampler->value(start) > -1e-3)
        start = 0.06 * direction();
    loop->start(start);
    double worst = 0.0;
    for (int place = 0; place < 100; ++place) {
        const Vec3 probe = reach * direction();
        double before = glm::length(loop->proxy() - probe);
        for (int frame = 0; frame < 40; ++frame) {
            const FieldSample here = sampler->sample(loop->proxy());
            const double slope = glm::length(here.slope);
            const double behind_m = here.value > 0.0 ? here.value / slope : 0.0;
            loop->move(probe);
            const double after = glm::length(loop->proxy() - probe);
            worst = std::max(worst, after - before - behind_m);
            before = after;
        }
    }
    return worst;
}

// Rounding of 50 mm, as it adds up over the sub-steps of a frame.
TEST_P(HeldOnBodies, TheSpringGainsNothingButTheWayBackToTheLevel) {
    const std::shared_ptr<const ScalarField> bumpy = make_bumpy_cavity(kCavity, 1e-3, 15e-3);
    EXPECT_LE(worst_rise(bumpy, GetParam(), 0.053), 1e-15);
    const std::shared_ptr<const ScalarField> ball = make_solid_sphere(kCavity);
    EXPECT_LE(worst_rise(ball, GetParam(), 0.04), 1e-15);
    const std::shared_ptr<const ScalarField> notch = make_wedge(300.0);
    EXPECT_LE(worst_rise(notch, GetParam(), 0.03), 1e-15);
}

// On voxels the proxy comes to rest where central differences point at the probe, which is not
// quite where the level is nearest: 0.04 rad off, 2.5 mm deep, the lag is 0.04^2 / 2 of that
// longer.
TEST_P(HeldOnBodies, OnVoxelsItGainsMicrometres) {
    const auto formula = make_bumpy_cavity(0.02, 1e-3, 15e-3)->make_sampler();
    const auto field =
        test::voxels_of([&](const Vec3& p) { return formula->value(p); }, 0.024, 1e-3);
    EXPECT_LE(worst_rise(field, GetParam(), 0.0225), 2e-6);
}

struct Work {
    double on_hand_j = 0.0;
    double of_steps_j = 0.0; ///< k/2 sum |da|^2
    double of_levels_j = 0.0;
    double lost_j = 0.0; ///< E_0 - E_1
};

/// Twice round a loop that goes in and out of contact, sideways, and deep.
Work round_trip(ContactLoop& loop, Felt felt, int frames) {
    const auto probe = [&](int frame) {
        const double angle = 2.0 * std::numbers::pi * frame / frames;
        const double r = kCavity + 1e-3 + 3e-3 * std::sin(3.0 * angle);
        const double swing = 0.3 * std::cos(angle);
        return r * Vec3{std::cos(swing), std::sin(swing), 0.2 * std::sin(2.0 * angle)};
    };
    loop.start((kCavity - 1e-9) * glm::normalize(probe(0)));
    loop.move(probe(0));
    Work work;
    work.lost_j = energy(loop.proxy(), probe(0));
    for (int i = 1; i <= 2 * frames; ++i) {
        const Vec3 a = probe(i % frames), moved = a - probe((i - 1) % frames);
        const Vec3 x = loop.proxy();
        work.on_hand_j += ContactLoop::kStiffness * glm::dot(x - (a - moved), moved);
        work.of_steps_j += 0.5 * ContactLoop::kStiffness * squared_length(moved);
        work.of_levels_j += most_gain(glm::length(x - a), behind(felt, x));
        loop.move(a);
    }
    work.lost_j -= energy(loop.proxy(), probe(0));
    return work;
}

TEST_P(Passivity, AClosedLoopGivesTheHandNoMoreThanItsStepsAndTheLevel) {
    for (const int frames : {150, 1500, 15000}) { // the sixth part of a second, and slower
        const auto loop = this->loop();
        const Work work = round_trip(*loop, felt(), frames);
        const double bound = work.lost_j + work.of_steps_j + work.of_levels_j;
        EXPECT_LE(work.on_hand_j, bound + frames * rounding(0.01)) << frames;
        // The bound is worth something: what the level may give is a small part of what went round.
        if (method() == SteppingMethod::adaptive) {
            EXPECT_LE(work.of_levels_j, 1e-3 * work.of_steps_j) << frames;
        }
    }
}

/// A wall that pushes a hand that is on its way back, and no other: it gives energy away.
class Bouncing final : public Effect {
public:
    void begin(const FrameContext& frame) noexcept override {
        const double depth = glm::length(frame.probe) - kCavity;
        pushes_ = depth > 0.0 && depth < depth_;
        depth_ = depth;
    }
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
        if (pushes_) primitives.add_force(-0.5 * glm::normalize(proxy)); // N
    }
    QueryCount queries() const noexcept override { return {}; }

private:
    bool pushes_ = false;
    double depth_ = 0.0; // of the probe, m
};

// The control: the sums would tell.
TEST(PassivityControl, AWallThatPushesHarderOnTheWayOutGivesTheHandMore) {
    test::Effects effects;
    effects.push_back(std::make_unique<Bouncing>());
    const auto loop =
        test::loop_of(test::stepping_of(SteppingMethod::single), {}, std::move(effects));
    const Work work = round_trip(*loop, Felt::memoryless, 15000);
    EXPECT_GT(work.on_hand_j, work.lost_j + work.of_steps_j);
}

} // namespace
} // namespace palpate
