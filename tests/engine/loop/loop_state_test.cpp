// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/loop_state.h>

#include <any>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/effects/curve_guide.h>

#include "tests/support/one_of_each.h"
#include "tests/support/phantom.h"
#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

constexpr double kClockStep_us = 7.0;

std::shared_ptr<const Scene> ball(const std::string& more = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 28\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
            more,
        "ball.toml"));
}

DeviceState at(const Vec3& place, std::uint32_t trial = 0) {
    DeviceState state;
    state.position = place;
    state.trial = trial;
    return state;
}

/// A hand that dips into a ball of 28 mm.
DeviceState hand(int frame) {
    DeviceState state = at(test::dipping(frame));
    state.time_s = frame / 1000.0;
    return state;
}

std::vector<FrameReport> frames(HapticLoop& loop, int first, int last) {
    std::vector<FrameReport> reports;
    for (int i = first; i < last; ++i)
        reports.push_back(loop.frame(hand(i)));
    return reports;
}

/// What differs first in two runs; empty: nothing.
std::string difference(const std::vector<FrameReport>& a, const std::vector<FrameReport>& b) {
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const std::string names = test::difference(a[i], b[i]); !names.empty())
            return "frame " + std::to_string(i) + ": " + names;
    return {};
}

/// What `act` is refused with; empty where it is not.
template <class Act>
std::string refusal(const Act& act) {
    try {
        act();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return {};
}

bool says(const std::string& text, const std::string& words) {
    return text.find(words) != std::string::npos;
}

TEST(LoopState, FramesAfterARestoreAreThoseAfterTheSave) {
    const auto scene = test::one_of_each_scene();
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::paper,
                                        SteppingMethod::fixed, SteppingMethod::single}) {
        SCOPED_TRACE(static_cast<int>(method));
        LoopDescription description;
        description.method = method;
        description.budget_us = 30.0 * kClockStep_us; // method paper: 30 sub-steps
        test::ScriptedClock clock(kClockStep_us);
        HapticLoop loop(scene, clock, description, test::fibres());
        HapticLoop another(scene, clock, description, test::fibres());
        std::mt19937_64 random(3);
        for (int i = 0; i < 900; ++i) {
            test::switch_at_random(loop, i, random);
            const FrameReport report = loop.frame(hand(i));
            if (i % 300 != 170) continue; // 20 frames after gains were set: they are on their way
            ASSERT_TRUE(report.flags & kLiveGain);
            const LoopState state = loop.save();
            const auto first = frames(loop, i + 1, i + 60);
            loop.restore(state);
            EXPECT_EQ(difference(frames(loop, i + 1, i + 60), first), "");
            another.restore(state);
            EXPECT_EQ(difference(frames(another, i + 1, i + 60), first), "");
            loop.restore(state);
        }
    }
}

TEST(LoopState, OfABakedVolumeIsTheSameWhateverCellItsSamplersHave) {
    const auto scene = test::phantom_scene("volume", "adaptive");
    test::ScriptedClock clock(kClockStep_us);
    HapticLoop loop(scene, clock), another(scene, clock);
    const auto way = [](HapticLoop& by, int first) {
        std::vector<FrameReport> reports;
        for (int i = first; i < first + 300; ++i)
            reports.push_back(by.frame(at(1.2 * test::dipping(i))));
        return reports;
    };
    way(loop, 0);
    const LoopState state = loop.save();
    const auto first = way(loop, 300);
    loop.restore(state);
    EXPECT_EQ(difference(way(loop, 300), first), "");
    another.restore(state);
    EXPECT_EQ(difference(way(another, 300), first), "");
}

TEST(LoopState, IsAValueThatOutlivesItsLoop) {
    test::ScriptedClock clock(kClockStep_us);
    std::vector<LoopState> states;
    std::vector<FrameReport> first;
    auto scene = ball("[[effect]]\ntype = \"vibration\"\n");
    const auto other = std::make_unique<HapticLoop>(scene, clock);
    {
        HapticLoop loop(scene, clock);
        frames(loop, 0, 100);
        states.push_back(loop.save());
        first = frames(loop, 100, 200);
    }
    scene.reset();
    const LoopState copy = states[0];
    states.clear();
    for (int twice = 0; twice < 2; ++twice) {
        other->restore(copy);
        EXPECT_EQ(difference(frames(*other, 100, 200), first), "") << "restoring changes no state";
    }
}

TEST(LoopState, OfALoopThatHasNotBegunBeginsATrial) {
    test::ScriptedClock clock(kClockStep_us);
    HapticLoop loop(ball(), clock);
    const LoopState state = loop.save();
    const auto first = frames(loop, 0, 50);
    loop.restore(state);
    EXPECT_EQ(difference(frames(loop, 0, 50), first), "");
}

TEST(LoopState, HasTheGainsAndWhereTheyGo) {
    test::ScriptedClock clock(kClockStep_us);
    HapticLoop loop(ball("[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, 1]\n"), clock);
    loop.frame(at({0, 0, 0.05}));
    ASSERT_TRUE(loop.set_gain(1, 0.5));
    loop.frame(at({0, 0, 0.05}));
    const LoopState on_its_way = loop.save();
    ASSERT_TRUE(loop.set_gain(1, 1.0));
    for (int i = 0; i < 100; ++i)
        loop.frame(at({0, 0, 0.05}));
    loop.restore(on_its_way);
    FrameReport report;
    for (int i = 0; i < 100; ++i)
        report = loop.frame(at({0, 0, 0.05}));
    EXPECT_NEAR(report.force.z, 0.5, 1e-12) << "where it went when it was saved";
}

TEST(LoopState, WithMotorsHasTheSafetyChainAndTheVelocity) {
    DeviceProperties device;
    device.force_n = 4.0;
    device.damping_n_s_per_m = 0.5;
    device.delay_s = 0.6e-3;
    device.position_step_m = 30e-6;
    test::ScriptedClock clock(kClockStep_us);
    const auto scene = ball("[coupling]\ndamping_n_s_per_m = 0.2\n");
    HapticLoop loop(scene, clock, scene->description().loop, device);
    HapticLoop another(scene, clock, scene->description().loop, device);
    frames(loop, 0, 60); // waiting, ramping in
    for (int i = 60; i < 2000; i += 97) {
        if (i % 2 == 0) loop.release(); // a fault: the force fades, and everything begins anew
        const LoopState state = loop.save();
        const auto first = frames(loop, i, i + 97);
        another.restore(state);
        EXPECT_EQ(difference(frames(another, i, i + 97), first), "");
    }
}

/// A wave that is as old as its frames are many, and remembers where it was felt.
class Wave : public Effect {
public:
    void restart(const Vec3& proxy) noexcept override { now_ = {0, proxy}; }
    void begin(const FrameContext& frame) noexcept override {
        now_.place = 0.9 * now_.place + 0.1 * frame.start;
        force_ = 0.3 * std::sin(0.1 * ++now_.age) * Vec3{0, 0, 1} + 10.0 * now_.place;
    }
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force(force_);
    }
    QueryCount queries() const noexcept override { return {}; }

    struct State {
        int age = 0; // frames
        Vec3 place{0.0};
    };
    State now_;

private:
    Vec3 force_{0.0};
};

/// The same as it should be.
class SavedWave final : public Wave {
public:
    std::any save_state() const override { return now_; }
    void restore_state(const std::any& state) override {
        now_ = std::any_cast<const State&>(state);
    }
};

template <class Own>
std::vector<std::unique_ptr<Effect>> own_effect() {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<Own>());
    return effects;
}

/// What differs where a loop with an effect of the embedder's is restored, into itself or another.
template <class Own>
std::string difference_with_own_effect(bool into_itself) {
    test::ScriptedClock clock(kClockStep_us);
    const auto scene = ball();
    HapticLoop loop(scene, clock, own_effect<Own>());
    frames(loop, 0, 100);
    const LoopState state = loop.save();
    const auto first = frames(loop, 100, 200);
    HapticLoop another(scene, clock, own_effect<Own>());
    HapticLoop& again = into_itself ? loop : another;
    again.restore(state);
    return difference(frames(again, 100, 200), first);
}

TEST(LoopState, HasThatOfAnEmbeddersEffect) {
    EXPECT_EQ(difference_with_own_effect<SavedWave>(true), "");
    EXPECT_EQ(difference_with_own_effect<SavedWave>(false), "");
}

// What Effect::save_state() says of it, and that the comparison would see it.
TEST(LoopState, HasNothingOfAnEffectThatKeepsItsStateToItself) {
    EXPECT_NE(difference_with_own_effect<Wave>(true), "");
    EXPECT_NE(difference_with_own_effect<Wave>(false), "");
}

TEST(LoopState, OfAnotherSceneOrLoopIsRefusedAndChangesNothing) {
    test::ScriptedClock clock(kClockStep_us);
    const auto scene = ball();
    HapticLoop loop(scene, clock, own_effect<SavedWave>());
    frames(loop, 0, 100);
    const LoopState before = loop.save();
    const auto first = frames(loop, 100, 150);
    loop.restore(before);
    const auto expect_refused = [&](const HapticLoop& other, const std::string& words) {
        const std::string why = refusal([&] { loop.restore(other.save()); });
        EXPECT_TRUE(says(why, "restore: ")) << why;
        EXPECT_TRUE(says(why, words)) << why;
    };
    const auto with = [&](auto change) {
        LoopDescription description;
        change(description);
        return std::make_unique<HapticLoop>(scene, clock, description, own_effect<SavedWave>());
    };
    expect_refused(HapticLoop(ball(), clock, own_effect<SavedWave>()), "another scene");
    expect_refused(*with([](LoopDescription& d) { d.method = SteppingMethod::paper; }), "method");
    expect_refused(*with([](LoopDescription& d) { d.rate_hz = 500.0; }),
                   "rate_hz is 500 in the state and 1000 in the loop");
    expect_refused(*with([](LoopDescription& d) { d.budget_us = 100.0; }), "budget_us");
    expect_refused(*with([](LoopDescription& d) { d.sub_steps = 3; }), "sub_steps");
    expect_refused(*with([](LoopDescription& d) { d.tolerance_um = 1.0; }), "tolerance_um");
    expect_refused(*with([](LoopDescription& d) { d.evaluation_cap = 9; }), "evaluation_cap");
    DeviceProperties motors;
    motors.force_n = 3.0;
    motors.damping_n_s_per_m = 10.0; // the scene's coupling can be held
    expect_refused(HapticLoop(scene, clock, {}, motors, own_effect<SavedWave>()), "device");
    expect_refused(HapticLoop(scene, clock), "effects: the state has 0, the loop 1");
    expect_refused(HapticLoop(scene, clock, own_effect<Wave>()), "effect 1: ");
    EXPECT_EQ(difference(frames(loop, 100, 150), first), "");
}

TEST(LoopState, ThatWasMovedElsewhereIsRefused) {
    test::ScriptedClock clock(kClockStep_us);
    HapticLoop loop(ball(), clock);
    LoopState state = loop.save();
    const LoopState moved = std::move(state);
    EXPECT_TRUE(says(refusal([&] { loop.restore(state); }), "moved")); // NOLINT
    EXPECT_EQ(refusal([&] { loop.restore(moved); }), "");
}

// Of ours, but made in code: a place on a curve of ten pieces is none on one of two.
TEST(LoopState, OfAGuideAlongAnotherCurveIsRefused) {
    const auto guide = [](int points) {
        std::vector<Vec3> curve;
        for (int i = 0; i < points; ++i)
            curve.push_back({0.03 * i / (points - 1), 0.05, 0.0});
        std::vector<std::unique_ptr<Effect>> effects;
        effects.push_back(
            std::make_unique<CurveGuide>(Polyline(curve, PolylineEnds::open), GuideSettings{0.5}));
        return effects;
    };
    test::ScriptedClock clock(kClockStep_us);
    const auto scene = ball();
    HapticLoop loop(scene, clock, guide(11)), shorter(scene, clock, guide(3));
    loop.frame(at({0.029, 0.05, 0.0}));
    loop.frame(at({0.029, 0.05, 0.0}));
    EXPECT_TRUE(says(refusal([&] { shorter.restore(loop.save()); }), "another curve"));
}

} // namespace
} // namespace palpate
