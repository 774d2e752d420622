// SPDX-License-Identifier: Apache-2.0
// Where effects are priced, and of what. Not what the prices are: those are of a machine.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/run/effect_prices.h>
#include <palpate/engine/run/internal/felt_places.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/loop_parts.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>

#include "tests/support/one_of_each.h"

namespace palpate {
namespace {

constexpr const char* kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                              "[surface.s]\nvolume = \"ball\"\n"
                              "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n";

/// Of the places where the last effect of a scene is priced, the share where it adds something.
double share_felt(const std::string& text) {
    const Scene scene(parse_scene(text, "x.toml"));
    const LoopParts parts = scene.make_parts();
    Effect& built = *parts.effects.back();
    const EffectDescription& effect = scene.description().effects[scene.effect_order().back()];
    const std::vector<Vec3> places = internal::places_where_felt(scene, effect, built);
    int felt = 0;
    for (const Vec3& place : places) {
        PrimitiveSet primitives;
        built.restart(place);
        built.begin(internal::frame_from(place, place + Vec3{2e-4, 0, 0}));
        built.gather(place, primitives);
        felt += !primitives.is_free() || glm::length(primitives.force()) > 0.0 ||
                primitives.total_stiffness(0.0) > 0.0;
    }
    EXPECT_GT(places.size(), 500u);
    return felt / static_cast<double>(places.size());
}

// Seen: viscosity in a surface was priced at the origin, guides and workspaces too.
TEST(EffectPrices, AreMeasuredWhereTheEffectIsFelt) {
    for (const std::string& effect : std::vector<std::string>{
             "type = \"viscosity\"\nsurface = \"s\"\ndamping_n_s_per_m = 3\n",
             "type = \"viscosity\"\ndamping_n_s_per_m = 3\n",
             // Nowhere near the middle of the ball.
             "type = \"gradient_force\"\nvolume = \"ball\"\n"
             "strength_n = [[-1e-3, 0], [0, 1], [0.03, 1], [0.031, 0]]\n",
             "type = \"guide\"\npoints_mm = [[200, 0, 0], [200, 90, 0]]\ncapture_mm = "
             "2\nstrength_n = 1\n",
             "type = \"guide\"\npoints_mm = [[200, 0, 0]]\ncapture_mm = 2\nstrength_n = 1\n",
             "type = \"workspace\"\nradius_mm = 80\ncenter_mm = [0, 10, 0]\n",
             "type = \"workspace\"\nbox_mm = [[-90, -90, -90], [90, 90, 90]]\nstrength_n = 2\n"})
        EXPECT_EQ(share_felt(kBall + ("[[effect]]\n" + effect)), 1.0) << effect;
}

// Seen: what goes along with a body was priced at the origin.
TEST(EffectPrices, AreMeasuredWhereAnEffectOfABodyIsFelt) {
    const std::string body = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                             "[surface.s]\nvolume = \"ball\"\nmoves = true\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[[effect]]\n";
    for (const std::string& effect : std::vector<std::string>{
             "type = \"viscosity\"\nsurface = \"s\"\ndamping_n_s_per_m = 3\n",
             "type = \"gradient_force\"\nvolume = \"ball\"\nmoves_with = \"s\"\n"
             "strength_n = [[-1e-3, 0], [0, 1], [0.03, 1], [0.031, 0]]\n",
             "type = \"guide\"\npoints_mm = [[200, 0, 0]]\ncapture_mm = 2\nstrength_n = 1\n"
             "moves_with = \"s\"\n"})
        EXPECT_EQ(share_felt(body + effect), 1.0) << effect;
}

TEST(EffectPrices, PlacesInASurfaceAreBehindItsLevel) {
    const Scene scene(parse_scene(kBall, "x.toml"));
    std::size_t behind = 0;
    const std::vector<Vec3> places = internal::places_on(scene.surfaces()[0], 1.0);
    for (const Vec3& place : places)
        behind += std::abs(glm::length(place) - 0.049) < 1e-5; // chords of 0.2 mm: 1e-7 m
    EXPECT_GT(behind, places.size() / 2) << "it comes from outside";
}

TEST(EffectPrices, EveryKindHasOneAndIsNamedInWords) {
    const auto scene = test::one_of_each_scene();
    const std::vector<double> prices_us = measure_prices(*scene);
    const std::string words = scene_in_words(*scene, prices_us);
    for (std::size_t i = 0; i < prices_us.size(); ++i) {
        const std::string kind(name(scene->description().effects[i]));
        EXPECT_THAT(words, testing::HasSubstr(kind));
        EXPECT_TRUE(std::isfinite(prices_us[i]) && prices_us[i] >= 0.0) << kind;
    }
}

// Seen: a magnet's price was 0. A price is a difference of two times, and on a busy machine one
// measurement of it may come out as 0.
TEST(EffectPrices, AMagnetHasOne) {
    const Scene scene(parse_scene(kBall + std::string("[[effect]]\ntype = \"magnet\"\n"
                                                      "surface = \"s\"\nstrength_n = 1\n"),
                                  "x.toml"));
    double price_us = 0.0;
    for (int tries = 0; tries < 20 && !(price_us > 0.0); ++tries)
        price_us = measure_prices(scene)[1];
    EXPECT_GT(price_us, 0.0);
}

} // namespace
} // namespace palpate
