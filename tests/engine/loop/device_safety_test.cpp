// SPDX-License-Identifier: Apache-2.0
// What a device declares, and what the loop makes of it.
#include <palpate/engine/loop/device_safety.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/device_placement.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/hand/safety_chain.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

constexpr double kPeriod = 1e-3;

DeviceProperties motors(double damping = 0.0) {
    DeviceProperties device;
    device.name = "a device";
    device.force_n = 8.0;
    device.damping_n_s_per_m = damping;
    return device;
}

TEST(SafeCoupling, IsWhatTheDevicesDampingPaysFor) {
    const SafeCoupling safe = safe_coupling({1000.0, 0.0}, 1000.0, motors(0.3));
    EXPECT_DOUBLE_EQ(safe.coupling.stiffness, 600.0) << "2 b / T";
    EXPECT_NE(safe.warning.find("from 1000 N/m"), std::string::npos) << safe.warning;
    EXPECT_NE(safe.warning.find("to 600 N/m"), std::string::npos) << safe.warning;
    EXPECT_NE(safe.warning.find("the damping of a device, 0.3 N s/m"), std::string::npos)
        << safe.warning;
    EXPECT_EQ(safe.warning.find('\n'), std::string::npos);
    EXPECT_DOUBLE_EQ(safe_coupling({1e5, 0.0}, 4000.0, motors(0.3)).coupling.stiffness, 2400.0)
        << "faster, stiffer";

    DeviceProperties soft = motors();
    soft.stiffness_n_per_m = 200.0;
    const std::string made_for = safe_coupling({1000.0, 0.0}, 1000.0, soft).warning;
    EXPECT_NE(made_for.find("a device is made for no more"), std::string::npos) << made_for;
}

TEST(SafeCoupling, DampingIsPaidForFirst) {
    const SafeCoupling both = safe_coupling({1000.0, 0.05}, 1000.0, motors(0.3));
    EXPECT_DOUBLE_EQ(both.coupling.stiffness, 500.0);
    EXPECT_DOUBLE_EQ(both.coupling.damping, 0.05);
    const SafeCoupling damped = safe_coupling({10.0, 5.0}, 1000.0, motors(0.3));
    EXPECT_DOUBLE_EQ(damped.coupling.damping, 0.15) << "half of it at most";
    EXPECT_DOUBLE_EQ(damped.coupling.stiffness, 10.0);
    EXPECT_NE(damped.warning, "");
}

TEST(SafeCoupling, IsLeftAloneWhereNothingIsDeclaredOrEnoughIs) {
    for (const DeviceProperties& device : {DeviceProperties{}, motors(), motors(0.6)}) {
        const SafeCoupling safe = safe_coupling({1000.0, 0.05}, 1000.0, device);
        EXPECT_EQ(safe.coupling.stiffness, 1000.0);
        EXPECT_EQ(safe.coupling.damping, 0.05);
        EXPECT_EQ(safe.warning, "");
    }
    DeviceProperties path; // declares everything but takes no force
    path.damping_n_s_per_m = 1e-3;
    path.stiffness_n_per_m = 1.0;
    EXPECT_EQ(safe_coupling({1000.0, 0.0}, 1000.0, path).coupling.stiffness, 1000.0);
}

TEST(SafeCoupling, IsNoStifferThanTheDeviceIsMadeFor) {
    DeviceProperties device = motors();
    device.stiffness_n_per_m = 400.0;
    const SafeCoupling safe = safe_coupling({1000.0, 0.0}, 1000.0, device);
    EXPECT_EQ(safe.coupling.stiffness, 400.0);
    EXPECT_NE(safe.warning, "");
}

// 1000 N/m is what the device is made for, and stays; the damping is lowered for another reason.
TEST(SafeCoupling, ADampingThatIsLoweredIsNotSaidToBeTheStiffness) {
    DeviceProperties device = motors(2.0);
    device.stiffness_n_per_m = 1000.0;
    const SafeCoupling safe = safe_coupling({1000.0, 5.0}, 1000.0, device);
    EXPECT_EQ(safe.coupling.stiffness, 1000.0);
    EXPECT_EQ(safe.coupling.damping, 1.0);
    EXPECT_EQ(safe.warning.find("is made for no more"), std::string::npos) << safe.warning;
    EXPECT_NE(safe.warning.find("the damping of a device, 2 N s/m"), std::string::npos)
        << safe.warning;
}

TEST(SafetySettings, TakeTheSmallerForce) {
    const LimitsDescription limits{5.0, 1500.0};
    DeviceProperties weak = motors(0.3);
    weak.force_n = 3.0;
    const SafetySettings plain = safety_settings(limits, 500.0, 250.0, weak);
    EXPECT_EQ(plain.feedback, ForceFeedback::motors);
    EXPECT_EQ(plain.force_n, 3.0);
    EXPECT_EQ(plain.slew_n_per_s, 1500.0);
    EXPECT_EQ(plain.period_s, 2e-3);
    EXPECT_EQ(plain.passivity.stiffness_n_per_m, 250.0);
    EXPECT_EQ(plain.passivity.damping_n_s_per_m, 0.3);
    EXPECT_EQ(plain.passivity.active_w, 0.0);
    EXPECT_EQ(safety_settings({9.0, 1500.0}, 500.0, 250.0, motors()).force_n, 8.0);
    EXPECT_EQ(safety_settings(limits, 1000.0, 500.0, {}).feedback, ForceFeedback::none);
}

// What a hand feels and may get does not depend on how large the scene is to it: the force that is
// sent is the same, bit for bit where the scale is a power of two. Bank, faults, jumps and effects
// that push are all met.
TEST(SafetySettings, AHandIsAllowedTheSameAtEveryScale) {
    constexpr double kStiffness = 500.0; // N/m at the hand
    struct Sent {
        std::vector<Vec3> forces;
        std::vector<std::uint32_t> flags;
    };
    const auto sent_at = [](double scale) {
        DeviceProperties device = motors(0.03125);
        device.delay_s = 2.5e-3;
        const DeviceProperties placed =
            DevicePlacement({PatientSide::left, PatientSide::superior, Vec3{0.0}, scale})
                .to_scene(device);
        SafetyChain chain(safety_settings({}, 1000.0, kStiffness / scale, placed));
        std::mt19937_64 random(20261127);
        std::normal_distribution<double> number;
        Sent sent;
        Vec3 hand{0.0}, velocity{0.0};
        for (int frame = 0; frame < 20000; ++frame) {
            // Now and then what pushes is on, and the hand leaps.
            chain.expect(frame / 3000 % 2 == 1 ? 0.1 : 0.0, false);
            velocity =
                0.99 * velocity + 0.02 * Vec3{number(random), number(random), number(random)};
            if (frame % 4001 == 4000) velocity = Vec3{12.0, 0.0, 0.0};
            if (frame % 4001 == 0) velocity = Vec3{0.0};
            // Faster than any bound of energy can follow, along with the force.
            const double force_n = frame > 0 ? glm::length(sent.forces.back()) : 0.0;
            if (frame % 997 >= 994 && force_n > 1.0) velocity = 9.0 / force_n * sent.forces.back();
            if (frame % 997 == 0) velocity = Vec3{0.0};
            hand = 0.999 * hand + kPeriod * velocity;
            // None, so that the chain begins again after a fault; a spring; what gives energy.
            Vec3 wanted{0.0};
            if (frame % 500 >= 20)
                wanted = frame / 500 % 3 == 2 ? 50.0 * velocity : -kStiffness * hand;
            std::uint32_t flags = 0;
            sent.forces.push_back(chain.send(wanted, scale * hand, scale * velocity, flags));
            sent.flags.push_back(flags);
        }
        return sent;
    };
    const Sent plain = sent_at(1.0);
    std::uint32_t seen = 0;
    for (const std::uint32_t flags : plain.flags)
        seen |= flags;
    for (const FrameFlag flag : {kProbeJumped, kEnergyBounded, kEnergyExceeded, kSoftened})
        EXPECT_TRUE(seen & flag) << flag;
    for (const double scale : {1.0 / 64.0, 0.5, 8.0, 64.0}) {
        SCOPED_TRACE(scale);
        const Sent scaled = sent_at(scale);
        EXPECT_EQ(scaled.forces, plain.forces);
        EXPECT_EQ(scaled.flags, plain.flags);
    }
}

std::shared_ptr<const Scene> ball(const std::string& more = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
            more,
        "ball.toml"));
}

/// A loop on a device with motors, and the time of its frames.
class OnMotors : public testing::Test {
protected:
    FrameReport at(const Vec3& position, Freshness freshness = Freshness::fresh) {
        DeviceState state;
        state.time_s = kPeriod * frame_++;
        state.position = position;
        state.freshness = freshness;
        return loop_->frame(state);
    }
    void begin(const DeviceProperties& device, const std::string& more = "") {
        const auto scene = ball(more);
        loop_ = std::make_unique<HapticLoop>(scene, clock_, scene->description().loop, device);
        for (int i = 0; i < 300; ++i)
            at({0, 0, 0.06});
    }
    /// Slowly into the ball, 2 mm deep: a newton at 500 N/m.
    FrameReport press() {
        for (int i = 0; i <= 120; ++i)
            at({0, 0, 0.06 - 1e-4 * i});
        FrameReport report;
        for (int i = 0; i < 100; ++i)
            report = at({0, 0, 0.048});
        return report;
    }
    HapticLoop& loop() { return *loop_; }

private:
    test::ScriptedClock clock_;
    std::unique_ptr<HapticLoop> loop_;
    int frame_ = 0;
};

TEST_F(OnMotors, ItFeelsTheBall) {
    begin(motors());
    const FrameReport report = press();
    EXPECT_NEAR(report.force.z, 1.0, 1e-9);
    EXPECT_EQ(report.flags, 0u);
}

TEST_F(OnMotors, TheCouplingIsTheOneThatTheDeviceHolds) {
    begin(motors(0.1));
    EXPECT_DOUBLE_EQ(loop().coupling().stiffness, 200.0);
    EXPECT_NEAR(press().force.z, 0.4, 1e-9);
}

TEST_F(OnMotors, AStaleStateHoldsTheProxyAndTakesTheForceToZero) {
    begin(motors());
    const Vec3 held = press().proxy;
    FrameReport report;
    for (int i = 0; i < 3; ++i) {
        report = at({0, 0, 0.048}, Freshness::stale);
        EXPECT_TRUE(report.flags & kDeviceStale);
        EXPECT_EQ(report.proxy, held);
    }
    EXPECT_EQ(report.force, Vec3(0.0));
    for (int i = 0; i < 1000; ++i) {
        report = at({0, 0, 0.048});
        ASSERT_EQ(report.force, Vec3(0.0));
        ASSERT_EQ(report.flags, kWaitsForSmallForce);
    }
    for (int i = 0; i < 20; ++i)
        at({0, 0, 0.06});
    press();
    for (int i = 0; i < 300; ++i)
        report = at({0, 0, 0.048});
    EXPECT_NEAR(report.force.z, 1.0, 1e-9) << "out and in again, it is felt as before";
}

TEST_F(OnMotors, ReleaseGoesToZeroWithoutTheDevice) {
    begin(motors());
    EXPECT_NEAR(press().force.z, 1.0, 1e-9);
    int frames = 0;
    while (loop().release() != Vec3(0.0))
        ASSERT_LT(++frames, 4) << "fade_s is 4 ms";
    EXPECT_EQ(loop().release(), Vec3(0.0));
    EXPECT_TRUE(at({0, 0, 0.048}).flags & kWaitsForSmallForce);
}

TEST_F(OnMotors, WithoutAVelocityOfItsOwnOneIsEstimated) {
    begin(motors(), "[coupling]\nstiffness_n_per_m = 500\ndamping_n_s_per_m = 2\n");
    FrameReport report;
    for (int i = 0; i < 50; ++i)
        report = at({1e-5 * i, 0, 0.06}); // free: the proxy moves with the probe
    EXPECT_NEAR(report.force.x, 0.0, 1e-9);
    // Into the ball at 20 mm/s: the proxy stands, k_d v = 0.04 N beside the spring.
    for (int i = 0; i < 600; ++i)
        report = at({0, 0, 0.06 - 2e-5 * i});
    const double depth = 2e-5 * 599 - 0.01;
    EXPECT_NEAR(report.force.z, 500.0 * depth + 2.0 * 0.02, 1e-6);
}

TEST_F(OnMotors, AVelocityOfItsOwnIsTaken) {
    DeviceProperties device = motors();
    device.velocity_source = VelocitySource::device;
    begin(device, "[coupling]\ndamping_n_s_per_m = 2\n");
    DeviceState state;
    state.time_s = 1.0;
    state.position = {0, 0, 0.06};
    state.velocity = {0, 0, -0.1};
    EXPECT_NEAR(loop().frame(state).force.z, 0.2, 1e-12);
    state.velocity = {0, 0, std::numeric_limits<double>::quiet_NaN()};
    const FrameReport report = loop().frame(state);
    EXPECT_EQ(report.force, Vec3(0.0));
    EXPECT_TRUE(report.flags & kForceNotFinite);
}

/// Pushes along x, as an embedder's own effect.
class Push final : public Effect {
public:
    Push(double force_n, bool says_so) : force_n_(force_n), says_so_(says_so) {}
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force({force_n_, 0, 0});
    }
    double unasked_force_n() const noexcept override { return says_so_ ? std::abs(force_n_) : 0.0; }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override { return {}; }

private:
    double force_n_;
    bool says_so_;
};

std::vector<std::unique_ptr<Effect>> pushing(double force_n, bool says_so) {
    std::vector<std::unique_ptr<Effect>> own;
    own.push_back(std::make_unique<Push>(force_n, says_so));
    return own;
}

/// What a hand that holds still in the air feels after a second, N.
double felt_x(HapticLoop& loop) {
    DeviceState state;
    state.position = {0, 0, 0.1};
    FrameReport report;
    for (int i = 0; i < 1000; ++i) {
        state.time_s = kPeriod * i;
        report = loop.frame(state);
    }
    return report.force.x;
}

TEST(OnMotorsUnasked, APushOfTheEmbeddersOwnIsFeltAsTheScenesIs) {
    test::ScriptedClock clock;
    const auto push = [](const std::string& force) {
        return ball("[[effect]]\ntype = \"constant_force\"\nforce_n = " + force + "\n");
    };
    const LoopDescription loop;
    for (const double force_n : {0.1, 0.5, 3.0}) {
        HapticLoop own(ball(), clock, loop, motors(), pushing(force_n, true));
        HapticLoop scenes(push(fmt::format("[{}, 0, 0]", force_n)), clock, loop, motors());
        EXPECT_NEAR(felt_x(own), force_n, 1e-9);
        EXPECT_NEAR(felt_x(scenes), force_n, 1e-9);
    }
    HapticLoop silent(ball(), clock, loop, motors(), pushing(0.5, false));
    EXPECT_EQ(felt_x(silent), 0.0) << "what does not say so has to be approached";
}

TEST(OnMotorsUnasked, AGainIsTakenIntoAccount) {
    test::ScriptedClock clock;
    const LoopDescription loop;
    const auto scene =
        ball("[[effect]]\ntype = \"constant_force\"\nforce_n = [0.5, 0, 0]\n"
             "[[effect]]\ntype = \"gravity_compensation\"\nmass_kg = 0.05\ndown = [1, 0, 0]\n");
    HapticLoop twice(scene, clock, loop, motors(), pushing(0.3, true));
    for (std::size_t effect = 1; effect < 4; ++effect)
        ASSERT_TRUE(twice.set_gain(effect, 2.0));
    EXPECT_NEAR(felt_x(twice), 2.0 * (0.5 - 0.05 * 9.80665 + 0.3), 1e-9);
    HapticLoop off(ball(), clock, loop, motors(), pushing(3.0, true));
    ASSERT_TRUE(off.set_gain(1, 0.0));
    EXPECT_EQ(felt_x(off), 0.0);
}

// The bound on what a claim may do: no more is sent than before, it only comes without waiting.
TEST(OnMotorsUnasked, AClaimThatIsNoNumberIsNone) {
    class Claim final : public Effect {
    public:
        void begin(const FrameContext&) noexcept override {}
        void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
            primitives.add_force({0.5, 0, 0});
        }
        double unasked_force_n() const noexcept override {
            return std::numeric_limits<double>::quiet_NaN();
        }
        QueryCount queries() const noexcept override { return {}; }
    };
    test::ScriptedClock clock;
    std::vector<std::unique_ptr<Effect>> own;
    own.push_back(std::make_unique<Claim>());
    HapticLoop loop(ball(), clock, LoopDescription{}, motors(), std::move(own));
    EXPECT_EQ(felt_x(loop), 0.0);
}

/// Takes 40 of the places that an evaluation has for planes, lines and points.
class Fence final : public Effect {
public:
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet&) noexcept override {}
    std::size_t most_primitives() const noexcept override { return 40; }
    QueryCount queries() const noexcept override { return {}; }
};

TEST(LoopWarnings, AreAskedOfTheEffectsThemselves) {
    test::ScriptedClock clock;
    EXPECT_TRUE(HapticLoop(ball(), clock, pushing(5.0, true)).warnings().empty());
    const auto heavy = HapticLoop(ball(), clock, pushing(5.5, true)).warnings();
    ASSERT_EQ(heavy.size(), 1u);
    EXPECT_TRUE(heavy[0].starts_with("custom effect 1 alone is up to 5.5 N")) << heavy[0];
    std::vector<std::unique_ptr<Effect>> own;
    own.push_back(std::make_unique<Fence>());
    const auto full = HapticLoop(ball(), clock, std::move(own)).warnings();
    ASSERT_EQ(full.size(), 1u);
    EXPECT_NE(full[0].find("up to 43 planes, lines and points"), std::string::npos) << full[0];
}

TEST(LoopWarnings, GoByTheForceThatIsSent) {
    test::ScriptedClock clock;
    DeviceProperties weak = motors();
    weak.force_n = 2.0;
    const auto heavy =
        HapticLoop(ball(), clock, LoopDescription{}, weak, pushing(3.0, true)).warnings();
    ASSERT_EQ(heavy.size(), 1u);
    EXPECT_EQ(heavy[0], "custom effect 1 alone is up to 3 N, and the device's 2 N is all that is "
                        "sent: make it weaker");
    EXPECT_TRUE(
        HapticLoop(ball(), clock, LoopDescription{}, weak, pushing(1.9, true)).warnings().empty());
}

// A surface that yields holds the proxy with as many planes.
TEST(LoopWarnings, CountThePlanesOfASurfaceThatYields) {
    test::ScriptedClock clock;
    for (const char* strength : {"", "strength_n = 1.0\n"}) {
        std::vector<std::unique_ptr<Effect>> own;
        own.push_back(std::make_unique<Fence>());
        const std::string text =
            "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\n"
            "volume = \"v\"\ncontact = \"volume\"\n" +
            std::string(strength) + "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n";
        const auto scene = std::make_shared<const Scene>(parse_scene(text, "ball.toml"));
        const auto full = HapticLoop(scene, clock, std::move(own)).warnings();
        ASSERT_EQ(full.size(), 1u);
        EXPECT_NE(full[0].find("up to 43 planes"), std::string::npos) << full[0];
    }
}

// A scene refuses it at its own rate; a loop may have another.
TEST(VibrationInALoop, AToneThatItsRateDoesNotCarryIsRefused) {
    const auto scene =
        ball("[[effect]]\ntype = \"vibration\"\nsurface = \"s\"\nfrequency_hz = 300\n");
    test::ScriptedClock clock;
    LoopDescription loop;
    EXPECT_NO_THROW(HapticLoop(scene, clock, loop));
    loop.rate_hz = 601.0;
    EXPECT_NO_THROW(HapticLoop(scene, clock, loop));
    loop.rate_hz = 600.0;
    try {
        const HapticLoop slow(scene, clock, loop);
        ADD_FAILURE() << "300 Hz at 600 frames a second";
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(), "effect 2 (vibration): its tone of 300 Hz is not below half of "
                                   "the loop's rate_hz = 600; lower it, or raise the rate");
    }
}

TEST(OnPaths, NothingOfTheChainButItsLimitsActs) {
    test::ScriptedClock clock;
    HapticLoop loop(ball("[limits]\nslew_n_per_s = 1e6\n"), clock);
    DeviceState state;
    state.position = {0, 0, 0.06};
    loop.frame(state);
    state.position = {0, 0, 0.048};
    const FrameReport report = loop.frame(state); // a jump of 12 m/s, and no ramp
    EXPECT_NEAR(report.force.z, 1.0, 1e-9);
    EXPECT_EQ(report.flags, 0u);
}

} // namespace
} // namespace palpate
