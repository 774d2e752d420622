// SPDX-License-Identifier: Apache-2.0
// A surface that yields, under a hand that goes round while its depth pulsates, against the exact
// play operator; and what dropping the flag that says so would cost (numerics 3.2).
#include <algorithm>
#include <any>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/stepping_methods.h"

namespace palpate {
namespace {

using test::ContactLoop;

constexpr double kRadius = 0.05;                               // m
constexpr double kStrength = 0.5;                              // N
constexpr double kSlack = kStrength / ContactLoop::kStiffness; // s/k = 1 mm

/// A surface of which the loop's word that it yielded is lost.
class WithoutYieldFlag final : public SurfaceContact {
public:
    explicit WithoutYieldFlag(std::unique_ptr<SurfaceContact> contact)
        : contact_(std::move(contact)) {}
    bool restart(const Vec3& proxy) noexcept override { return contact_->restart(proxy); }
    void set_gain(const Gain& gain) noexcept override { contact_->set_gain(gain); }
    void offer(const Vec3& proxy, ContactSet& contacts, NearestPlane* nearest) noexcept override {
        contact_->offer(proxy, contacts, nearest);
    }
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept override {
        contact_->keep_active(solution, first);
    }
    Chord carry(const Vec3& from, const Vec3& to) noexcept override {
        return contact_->carry(from, to);
    }
    FieldSurface* of_field() noexcept override { return contact_->of_field(); }
    double trust_m() const noexcept override { return contact_->trust_m(); }
    void commit(const Vec3& proxy, bool, bool felt) noexcept override {
        contact_->commit(proxy, false, felt);
    }
    SurfaceState state() const noexcept override { return contact_->state(); }
    QueryCount queries() const noexcept override { return contact_->queries(); }
    std::any save_state() const override { return contact_->save_state(); }
    void restore_state(const std::any& state) override { contact_->restore_state(state); }

private:
    std::unique_ptr<SurfaceContact> contact_;
};

std::unique_ptr<SurfaceContact> soft_ball() {
    LevelSettings level;
    level.strength_n = kStrength;
    return std::make_unique<VolumeContact>(make_solid_sphere(kRadius), level);
}

struct PlayError {
    double rms_m = 0.0;
    double worst_m = 0.0;
};

/// Distance of the proxy's height from the play operator's over three seconds at 0.2 m/s: the depth
/// goes from 0.2 to 3.2 mm and back every 0.7 s, so it yields and holds by turns.
PlayError play_error(const SteppingSettings& settings, std::unique_ptr<SurfaceContact> contact) {
    test::Surfaces surfaces;
    surfaces.push_back(std::move(contact));
    const auto loop = test::loop_of(settings, std::move(surfaces));
    const auto at = [](double r, double angle) {
        return r * Vec3{std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle)};
    };
    loop->start(at(kRadius + 1e-3, 0.0));
    PlayError error;
    double held = kRadius, angle = 0.0, squares = 0.0;
    constexpr int kFrames = 3000;
    for (int i = 0; i < kFrames; ++i) {
        const double r = kRadius - 1.7e-3 + 1.5e-3 * std::cos(8.976e-3 * i);
        angle += 0.2e-3 / r;
        loop->move(at(r, angle));
        held = std::max(std::min(held, r + kSlack), r);
        const double off = std::abs(glm::length(loop->proxy()) - held);
        squares += off * off;
        error.worst_m = std::max(error.worst_m, off);
    }
    error.rms_m = std::sqrt(squares / kFrames);
    return error;
}

class Play : public testing::TestWithParam<SteppingMethod> {};
INSTANTIATE_TEST_SUITE_P(Every, Play, testing::ValuesIn(test::kEveryMethod),
                         [](const testing::TestParamInfo<SteppingMethod>& of) {
                             return test::name_of(of.param);
                         });

// The goal is 0.01 um. A single evaluation meets the level by the tangent plane: off by the way of
// a frame, h^2 / 2r = 0.42 um, and at the turn by as much again where it stops to yield too early.
// Eight shares are off by an eighth of the way, squared: 0.0065 um, and twice that.
TEST_P(Play, ASofterBallIsTheExactOperator) {
    const PlayError error = play_error(test::stepping_of(GetParam()), soft_ball());
    switch (GetParam()) {
    case SteppingMethod::single:
        EXPECT_LE(error.rms_m, 0.84e-6);
        break;
    case SteppingMethod::fixed:
    case SteppingMethod::paper:
        EXPECT_LE(error.rms_m, 0.013e-6);
        break;
    case SteppingMethod::adaptive:
        EXPECT_LE(error.worst_m, 0.01e-6);
        break;
    }
}

// The control: it would hold at the level where it first was, by a good part of s/k
// (numerics 3.2).
TEST_P(Play, WithoutTheFlagItIsOffByATenthOfAMillimetre) {
    const auto contact = [] { return std::make_unique<WithoutYieldFlag>(soft_ball()); };
    EXPECT_GT(play_error(test::stepping_of(GetParam()), contact()).rms_m, 100e-6);
}

} // namespace
} // namespace palpate
