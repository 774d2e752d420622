// SPDX-License-Identifier: Apache-2.0
// Soft surfaces over others, as others see them: what is touched, what a state is, and what is
// refused (docs/palpation.md).
#include <palpate/haptics/stepping/subdivision.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/soft_layers.h"

namespace palpate {
namespace {

using test::ball;
using test::ContactLoop;
using test::force;
using test::Kind;
using test::precise_layers;
using test::soft;
using test::Surfaces;
using test::surfaces;

constexpr double kK = ContactLoop::kStiffness;

TEST(SoftLayers, TouchesBalanceTheCoupling) {
    ContactLoop loop(precise_layers(), surfaces(ball(50e-3), ball(60e-3)), {}, 0.0,
                     {{}, soft(100.0)});
    loop.start({61e-3, 0, 0});
    TouchList touches;
    int both = 0;
    for (int i = 0; i < 300; ++i) {
        const double angle = 2e-3 * i;
        const Vec3 probe =
            (60e-3 - 8e-3 - 8e-3 * std::sin(0.05 * i)) * Vec3{std::cos(angle), std::sin(angle), 0};
        const SubdivisionResult result = loop.move(probe);
        loop.subdivision().find_touches(touches);
        Vec3 sum{0.0};
        for (const Touch& touch : touches)
            sum += touch.force;
        both += result.felt == 3 ? 1 : 0;
        EXPECT_LE(glm::length(sum - force(loop, probe)), 1e-6) << i;
        EXPECT_NEAR(glm::length(loop.subdivision().place_on(1, loop.proxy())), 60e-3, 1e-9);
    }
    EXPECT_GT(both, 50);
}

TEST(SoftLayers, StatesAreValues) {
    const auto make = [] {
        return std::make_unique<ContactLoop>(SteppingSettings{}, surfaces(ball(50e-3), ball(60e-3)),
                                             std::vector<std::unique_ptr<Effect>>{}, 0.0,
                                             std::vector<SurfaceFinish>{{}, soft(100.0, 8.0)});
    };
    const auto one = make(), other = make();
    const auto place = [](int i) {
        return (56e-3 + 8e-3 * std::cos(0.02 * i)) *
               Vec3{std::cos(1e-3 * i), std::sin(1e-3 * i), 0.1};
    };
    one->start(place(0));
    other->start(place(0));
    for (int i = 0; i < 200; ++i)
        one->move(place(i));
    const Subdivision::State state = one->subdivision().save_state();
    Vec3 start = one->proxy();
    std::vector<Vec3> first;
    for (int i = 200; i < 600; ++i) {
        one->move(place(i));
        first.push_back(one->proxy());
    }
    other->subdivision().restore_state(state);
    TouchList touches;
    for (int i = 200; i < 600; ++i) {
        start = other->subdivision().advance({place(i), start, kK, 1e-3}).proxy;
        ASSERT_EQ(start, first[static_cast<std::size_t>(i - 200)]) << i;
        if (i > 200) continue;
        other->subdivision().find_touches(touches);
        ASSERT_FALSE(touches.empty());
        for (const Touch& touch : touches)
            EXPECT_EQ(touch.phase, Touch::Phase::goes_on) << touch.surface;
    }
}

TEST(SoftLayers, WhatWouldActOnTheFrontIsRefused) {
    test::ScriptedClock clock(0.0);
    const auto skin = ball(60e-3), bone = ball(50e-3);
    const auto why = [&](const SurfaceFinish& finish, SteppingMethod method) -> std::string {
        SteppingSettings settings;
        settings.method = method;
        try {
            Subdivision(settings, {bone.get(), skin.get()}, {}, clock, {{}, finish});
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(why(soft(100.0), SteppingMethod::adaptive), "");
    EXPECT_NE(why(soft(100.0), SteppingMethod::fixed).find("method"), std::string::npos);
    SurfaceFinish finish = soft(100.0);
    finish.friction = {0.3, 0.3};
    EXPECT_NE(why(finish, SteppingMethod::adaptive).find("it cannot rub"), std::string::npos);
    finish = soft(100.0);
    finish.strength_n = 2.0;
    EXPECT_NE(why(finish, SteppingMethod::adaptive).find("it cannot yield"), std::string::npos);
    finish = soft(100.0);
    finish.magnet = {0.5, 1e-3};
    EXPECT_NE(why(finish, SteppingMethod::adaptive).find("it cannot draw"), std::string::npos);
}

TEST(SoftLayers, ATouchThatEndsIsWhereTheTipWas) {
    ContactLoop loop(precise_layers(), surfaces(ball(50e-3), ball(60e-3)), {}, 0.0,
                     {{}, soft(100.0)});
    TouchList touches;
    const auto expect_end = [&](const Vec3& tip) {
        loop.subdivision().find_touches(touches);
        ASSERT_EQ(touches.size(), 1u);
        EXPECT_EQ(touches[0].surface, 1u);
        EXPECT_EQ(touches[0].phase, Touch::Phase::ended);
        EXPECT_EQ(touches[0].point, tip);
        EXPECT_NEAR(touches[0].normal.x, 1.0, 1e-12);
        EXPECT_EQ(touches[0].force, Vec3{0.0});
    };
    loop.start({61e-3, 0, 0});
    loop.move({57e-3, 0, 0});
    loop.move({57e-3, 0, 0});
    Vec3 tip = loop.proxy();
    loop.move({70e-3, 10e-3, 0}); // out, in one frame
    expect_end(tip);
    // A new trial elsewhere ends what the last one touched, once.
    loop.move({61e-3, 0, 0});
    loop.move({57e-3, 0, 0});
    tip = loop.proxy();
    loop.start({0, 70e-3, 0});
    loop.move({0, 70e-3, 0});
    expect_end(tip);
    loop.move({0, 70e-3, 0});
    loop.subdivision().find_touches(touches);
    EXPECT_TRUE(touches.empty());
}

// There is room for what each of them is told, and for all planes.
TEST(SoftLayers, AsManyAsThereMayBeAreTouched) {
    constexpr std::size_t kMost = Subdivision::kMostLayers;
    const auto layers = [](std::size_t count) {
        Surfaces all;
        for (std::size_t i = 0; i < count; ++i)
            all.push_back(ball(60e-3 - 1e-5 * static_cast<double>(i)));
        return all;
    };
    ContactLoop loop({}, layers(kMost), {}, 0.0, std::vector<SurfaceFinish>(kMost, soft(1.0)));
    loop.start({61e-3, 0, 0});
    for (const double x : {55e-3, 70e-3}) { // all of them push, and all of them end
        loop.move({x, 0, 0});
        TouchList touches;
        loop.subdivision().find_touches(touches);
        EXPECT_EQ(touches.size(), kMost);
    }
    try {
        ContactLoop more({}, layers(kMost + 1), {}, 0.0,
                         std::vector<SurfaceFinish>(kMost + 1, soft(1.0)));
        FAIL() << "there is no room for their touches";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("more than 32 surfaces are soft"),
                  std::string::npos);
    }
}

TEST(SoftLayers, AStateOfAnotherContactIsRefusedAndChangesNothing) {
    constexpr double kHard = std::numeric_limits<double>::infinity();
    const auto make = [](std::unique_ptr<SurfaceContact> skin) {
        LevelSettings weak;
        weak.strength_n = 0.5;
        auto bone = std::make_unique<VolumeContact>(
            std::shared_ptr<const ScalarField>(make_solid_sphere(50e-3)), weak);
        auto loop = std::make_unique<ContactLoop>(SteppingSettings{},
                                                  surfaces(std::move(bone), std::move(skin)),
                                                  std::vector<std::unique_ptr<Effect>>{}, 0.0,
                                                  std::vector<SurfaceFinish>{{}, soft(100.0)});
        loop->start({61e-3, 0, 0});
        return loop;
    };
    const auto mesh = [] { return test::ball(Kind::mesh, 60e-3, kHard, Yielding::holds, 4); };
    const auto other = make(ball(60e-3)), one = make(mesh()), twin = make(mesh());
    other->subdivision().gain(0, SurfacePart::strength).set(0.1); // its bone is to be weak
    for (const double x : {58e-3, 55e-3}) {
        other->move({x, 0, 0});
        one->move({x, 1e-3, 0});
        twin->move({x, 1e-3, 0});
    }
    EXPECT_THROW(one->subdivision().restore_state(other->subdivision().save_state()),
                 std::invalid_argument);
    for (int i = 0; i < 100; ++i) {
        const Vec3 probe{55e-3 - 1e-4 * i, 1e-3, 1e-5 * i};
        EXPECT_EQ(one->move(probe).proxy, twin->move(probe).proxy) << i;
    }
}

} // namespace
} // namespace palpate
