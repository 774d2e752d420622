// SPDX-License-Identifier: Apache-2.0
// What is touched, as C sees it, is what the C++ interface says, entry by entry.
#include <palpate/palpate_c.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/baking/touched_label.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/truth/surface_distance.h>

#include "tests/c/c_data.h"
#include "tests/support/made_labels.h"
#include "tests/support/memory_scenes.h"

namespace palpate {
namespace {

using test::sized;
using testing::HasSubstr;

/// Two plates that meet in a groove, and a ball beside them that yields.
const std::string kGroove = "[volume.w]\nanalytic = \"wedge\"\nangle_deg = 270\n"
                            "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 8\n"
                            "[surface.groove]\nvolume = \"w\"\n"
                            "[surface.soft]\nvolume = \"v\"\nstrength_n = 0.3\n"
                            "[[effect]]\ntype = \"surface\"\nsurface = [\"groove\", \"soft\"]\n"
                            "[[effect]]\ntype = \"friction\"\nsurface = \"groove\"\n"
                            "static = 0.4\ndynamic = 0.3\n";

/// Into the groove and the ball, and out again.
palpate_probe probe_at(int i) {
    auto probe = sized<palpate_probe>();
    probe.time_s = 1e-3 * i;
    const double angle = 7e-3 * i;
    probe.position_m[0] = 0.004 * std::sin(angle);
    probe.position_m[1] = 0.003 * std::sin(0.7 * angle);
    probe.position_m[2] = 0.006 + 0.009 * std::cos(2.3 * angle);
    return probe;
}

struct Both {
    test::ScenePtr scene = test::parsed(kGroove);
    test::LoopPtr loop = test::made(scene);
    std::shared_ptr<const Scene> same_scene =
        std::make_shared<const Scene>(parse_scene(kGroove, "ball.toml"));
    SteadyClock clock;
    HapticLoop same{same_scene, clock};

    void frame(int i) {
        const palpate_probe probe = probe_at(i);
        DeviceState state;
        state.time_s = probe.time_s;
        state.position = test::vec(probe.position_m);
        test::frame_of(loop.get(), probe);
        same.frame(state);
    }
};

/// What a hand touches in one frame more.
std::vector<palpate_touch> touches_of(const test::LoopPtr& loop, const DeviceState& hand) {
    test::frame_of(loop.get(), test::probe_of(hand));
    std::vector<palpate_touch> touches(PALPATE_MOST_TOUCHES);
    touches[0].size = sizeof touches[0];
    std::size_t count = 0;
    EXPECT_EQ(palpate_loop_touches(loop.get(), touches.data(), touches.size(), &count), PALPATE_OK);
    touches.resize(count);
    return touches;
}

TEST(TouchInC, TouchesAndStatesAreThoseOfTheCppInterface) {
    Both both;
    std::array<int, 3> phases{};
    std::array<int, 6> standings{};
    for (int i = 0; i < 3000; ++i) {
        both.frame(i);
        std::array<palpate_touch, PALPATE_MOST_TOUCHES> touches{};
        touches[0].size = sizeof touches[0];
        size_t count = 99;
        ASSERT_EQ(palpate_loop_touches(both.loop.get(), touches.data(), touches.size(), &count),
                  PALPATE_OK);
        const std::span<const Touch> expected = both.same.touches();
        ASSERT_EQ(count, expected.size());
        for (size_t t = 0; t < count; ++t) {
            ASSERT_EQ(touches[t].size, sizeof touches[t]);
            ASSERT_EQ(touches[t].surface, expected[t].surface);
            ASSERT_EQ(touches[t].phase, static_cast<int>(expected[t].phase));
            ASSERT_EQ(test::vec(touches[t].point_m), expected[t].point);
            ASSERT_EQ(test::vec(touches[t].normal), expected[t].normal);
            ASSERT_EQ(test::vec(touches[t].force_n), expected[t].force);
            ++phases.at(static_cast<size_t>(touches[t].phase));
        }
        std::array<palpate_surface_state, 2> states{};
        states[0].size = sizeof states[0];
        ASSERT_EQ(palpate_loop_surface_states(both.loop.get(), states.data(), 2, &count),
                  PALPATE_OK);
        const std::span<const SurfaceStatus> statuses = both.same.surface_states();
        ASSERT_EQ(count, 2u);
        ASSERT_EQ(statuses.size(), 2u);
        for (size_t s = 0; s < count; ++s) {
            ASSERT_EQ(states[s].standing, static_cast<int>(statuses[s].standing));
            ASSERT_EQ(states[s].is_guarded != 0, statuses[s].guarded);
            ASSERT_EQ(std::bit_cast<std::uint64_t>(states[s].depth_m),
                      std::bit_cast<std::uint64_t>(statuses[s].depth_m));
            ++standings.at(static_cast<size_t>(states[s].standing));
        }
    }
    for (const int seen : phases)
        EXPECT_GT(seen, 2) << "else too little was compared";
    EXPECT_GT(standings[PALPATE_OUT], 100);
    EXPECT_GT(standings[PALPATE_TOUCHED], 100);
    EXPECT_GT(standings[PALPATE_YIELDING], 10);
}

TEST(TouchInC, AShortArrayGetsTheFirstAndTheNumberOfAll) {
    Both both;
    for (int i = 0; i < 3000; ++i) {
        both.frame(i);
        size_t all = 0;
        ASSERT_EQ(palpate_loop_touches(both.loop.get(), nullptr, 0, &all), PALPATE_OK);
        if (all < 2) continue;
        std::array<palpate_touch, 2> touches{};
        touches[0].size = sizeof touches[0];
        touches[1].surface = 12345;
        size_t count = 0;
        ASSERT_EQ(palpate_loop_touches(both.loop.get(), touches.data(), 1, &count), PALPATE_OK);
        EXPECT_EQ(count, all);
        EXPECT_EQ(test::vec(touches[0].point_m), both.same.touches()[0].point);
        EXPECT_EQ(touches[1].surface, 12345u);
        return;
    }
    FAIL() << "no frame had two touches";
}

TEST(TouchInC, AnArrayOfALaterVersionKeepsItsOwnStride) {
    struct Later {
        palpate_touch touch;
        double more;
    };
    Both both;
    int compared = 0;
    for (int i = 0; i < 1000; ++i) {
        both.frame(i);
        std::array<Later, 4> later{};
        later[0].touch.size = sizeof(Later);
        for (Later& entry : later)
            entry.more = 42.0;
        size_t count = 0;
        ASSERT_EQ(palpate_loop_touches(both.loop.get(), &later[0].touch, later.size(), &count),
                  PALPATE_OK);
        for (size_t t = 0; t < count; ++t, ++compared) {
            ASSERT_EQ(later[t].touch.size, sizeof(Later));
            ASSERT_EQ(test::vec(later[t].touch.point_m), both.same.touches()[t].point);
            ASSERT_EQ(later[t].more, 42.0);
        }
    }
    EXPECT_GT(compared, 100);
}

TEST(TouchInC, BadCallsAreRefusedAndWriteNothing) {
    Both both;
    both.frame(0);
    size_t count = 7;
    auto touch = sized<palpate_touch>();
    auto state = sized<palpate_surface_state>();
    EXPECT_EQ(palpate_loop_touches(nullptr, &touch, 1, &count), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_touches(both.loop.get(), nullptr, 1, &count), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_touches(both.loop.get(), &touch, 1, nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_surface_states(nullptr, &state, 1, &count), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_surface_states(both.loop.get(), nullptr, 1, &count), PALPATE_BAD_CALL);
    for (const size_t size : {size_t{0}, sizeof touch - 1, sizeof touch + 1, size_t{1} << 20,
                              std::numeric_limits<size_t>::max()}) {
        touch.size = size;
        EXPECT_EQ(palpate_loop_touches(both.loop.get(), &touch, 1, &count), PALPATE_BAD_CALL)
            << size;
    }
    state.size = 8;
    EXPECT_EQ(palpate_loop_surface_states(both.loop.get(), &state, 1, &count), PALPATE_BAD_CALL);
    EXPECT_EQ(count, 7u);
}

TEST(TouchInC, LabelsOfContactsAreThoseOfTheCppInterface) {
    LabelVolume halves =
        test::made_labels({24, 24, 24}, {Mat3(1e-3), Vec3(-11.5e-3)}, 2, [](const Vec3& index) {
            if (glm::length(index - 11.5) > 9.0) return 0;
            return index.z < 14.0 ? 1 : 2;
        });
    const std::vector<std::int32_t> values(halves.layers[0].begin(), halves.layers[0].end());
    const palpate_labels given = test::in_c(halves, values);
    const test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_labels(data.get(), "ct", &given, nullptr), PALPATE_OK);
    const test::ScenePtr scene =
        test::parsed("[volume.ct]\n[surface.ball]\nvolume = \"ct\"\nlabel = [1, 2]\n"
                     "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n",
                     data);
    const test::LoopPtr loop = test::made(scene);
    palpate_label_probe* made = nullptr;
    palpate_error error = test::no_error();
    ASSERT_EQ(palpate_label_probe_make(scene.get(), &made, &error), PALPATE_OK) << error.message;
    const test::LabelProbePtr probe(made);
    const LabelProbe expected({halves});
    std::array<int, 3> seen{}; // nothing, 1, 2
    for (const DeviceState& hand : test::around_ball()) {
        for (const palpate_touch& given : touches_of(loop, hand)) {
            Touch touch;
            touch.point = test::vec(given.point_m);
            touch.normal = test::vec(given.normal);
            const std::string_view name = touched_label(expected, touch);
            const char* found = palpate_touched_label(probe.get(), &given);
            ASSERT_EQ(found == nullptr ? "" : std::string(found), name);
            ++seen.at(name.empty() ? 0 : static_cast<size_t>(name[0] - '0'));
        }
    }
    EXPECT_GT(seen[1], 20);
    EXPECT_GT(seen[2], 20);

    // A touch is with a label of its own surface, of whichever it is.
    const test::ScenePtr two = test::parsed(
        "[volume.ct]\n[surface.a]\nvolume = \"ct\"\nlabel = 1\n[surface.b]\nvolume = \"ct\"\n"
        "label = 2\n[[effect]]\ntype = \"surface\"\nsurface = \"a\"\n[[effect]]\ntype = "
        "\"surface\"\nsurface = \"b\"\n",
        data);
    const test::LoopPtr of_two = test::made(two);
    ASSERT_EQ(palpate_label_probe_make(two.get(), &made, &error), PALPATE_OK) << error.message;
    const test::LabelProbePtr by_surface(made);
    std::array<int, 2> named{};
    for (const DeviceState& hand : test::around_ball())
        for (const palpate_touch& touch : touches_of(of_two, hand))
            if (palpate_touched_label(by_surface.get(), &touch) != nullptr)
                ++named.at(touch.surface);
    EXPECT_GT(named[0], 20);
    EXPECT_GT(named[1], 20);

    const double nowhere[3] = {1.0, std::nan(""), 0.0};
    EXPECT_EQ(palpate_label_at(probe.get(), nowhere), nullptr);
    EXPECT_EQ(palpate_label_at(nullptr, nowhere), nullptr);
    EXPECT_EQ(palpate_label_at(probe.get(), nullptr), nullptr);
    auto touch = sized<palpate_touch>();
    EXPECT_EQ(palpate_touched_label(nullptr, &touch), nullptr);
    EXPECT_EQ(palpate_touched_label(probe.get(), nullptr), nullptr);
    touch.size = 4;
    EXPECT_EQ(palpate_touched_label(probe.get(), &touch), nullptr);
    EXPECT_EQ(palpate_label_probe_make(nullptr, &made, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_label_probe_make(scene.get(), nullptr, &error), PALPATE_BAD_CALL);
    palpate_label_probe_free(nullptr);
}

TEST(TouchInC, DistancesAreThoseOfTheCppInterface) {
    const Both both;
    palpate_distance* made = nullptr;
    palpate_error error = test::no_error();
    ASSERT_EQ(palpate_distance_make(both.scene.get(), "soft", &made, &error), PALPATE_OK)
        << error.message;
    const test::DistancePtr distance(made);
    const SurfaceDistance expected(both.same_scene, "soft");
    for (int i = 0; i < 50; ++i) {
        const double point[3] = {0.02 * std::sin(i), 0.02 * std::cos(2.0 * i), 0.003 + 1e-4 * i};
        auto nearest = sized<palpate_nearest>();
        ASSERT_EQ(palpate_distance_nearest(distance.get(), point, &nearest), PALPATE_OK);
        const auto same = expected.nearest({point[0], point[1], point[2]});
        ASSERT_TRUE(same);
        EXPECT_EQ(nearest.is_found, 1);
        EXPECT_EQ(nearest.is_sign_known, 1);
        EXPECT_EQ(test::vec(nearest.position_m), same->position);
        EXPECT_EQ(test::vec(nearest.normal), same->normal);
        EXPECT_EQ(nearest.distance_m, same->distance_m);
        // The ball is 8 mm around the origin; the foot is on the level to 1e-11 m.
        EXPECT_NEAR(nearest.distance_m, std::hypot(point[0], point[1], point[2]) - 0.008, 1e-10);
    }
    for (const double far : {std::nan(""), 1e300, 5.0}) {
        const double point[3] = {far, 0.0, 0.0};
        auto nearest = sized<palpate_nearest>();
        nearest.distance_m = 9.0;
        ASSERT_EQ(palpate_distance_nearest(distance.get(), point, &nearest), PALPATE_OK);
        EXPECT_EQ(nearest.is_found, 0) << far;
        EXPECT_EQ(nearest.distance_m, 0.0);
    }
    const double point[3] = {0.0, 0.0, 0.01};
    auto nearest = sized<palpate_nearest>();
    EXPECT_EQ(palpate_distance_nearest(nullptr, point, &nearest), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_distance_nearest(distance.get(), nullptr, &nearest), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_distance_nearest(distance.get(), point, nullptr), PALPATE_BAD_CALL);
    --nearest.size;
    EXPECT_EQ(palpate_distance_nearest(distance.get(), point, &nearest), PALPATE_BAD_CALL);
    palpate_distance* none = nullptr;
    EXPECT_EQ(palpate_distance_make(nullptr, "soft", &none, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_distance_make(both.scene.get(), nullptr, &none, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_distance_make(both.scene.get(), "hard", &none, &error), PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr("give one of: groove, soft"));
    EXPECT_EQ(none, nullptr);
    palpate_distance_free(nullptr);
}

} // namespace
} // namespace palpate
