// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/scene_in_words.h>

#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate {
namespace {

using testing::HasSubstr;

TEST(SceneInWords, SaysWhichSurfacesNoVibrationAnswers) {
    SceneDescription many;
    many.volumes["v"].analytic = "solid_sphere";
    many.volumes["v"].parameters = {{"radius_mm", 20.0}};
    for (int i = 0; i < 65; ++i) {
        const std::string name = fmt::format("s{:02}", i);
        many.surfaces[name].volume = "v";
        many.effects.push_back(effects::Surface{.surface = name});
    }
    const Scene scene(many);
    const std::vector<double> prices(many.effects.size());
    EXPECT_THAT(scene_in_words(scene, prices), HasSubstr("warning: the scene has 65 surfaces, and "
                                                         "only of the first 64"));
    EXPECT_THAT(scene_as_json(scene, prices), HasSubstr("only of the first 64"));
}

} // namespace
} // namespace palpate
