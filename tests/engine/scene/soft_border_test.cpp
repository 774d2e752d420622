// SPDX-License-Identifier: Apache-2.0
// Soft surfaces that share a border are warned of when a scene is loaded.
#include <palpate/engine/scene/scene.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/made_labels.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Value = std::function<int(const Vec3&)>;

/// The warnings of a scene with surfaces a and b, of labels of 40 x 30 x 30 voxels of 1 mm.
std::vector<std::string> warned(const Value& value, const std::string& a, const std::string& b) {
    SceneData data;
    data.volumes["v"].label_volume = std::make_shared<const LabelVolume>(
        test::made_labels({40, 30, 30}, AffineTransform{Mat3(1e-3), Vec3(0.0)}, 2, value));
    SceneDescription scene = parse_scene(
        "[volume.v]\n[surface.a]\nvolume = \"v\"\n" + a + "[surface.b]\nvolume = \"v\"\n" + b +
            "[[effect]]\ntype = \"surface\"\nsurface = [\"a\", \"b\"]\n",
        "x.toml", data);
    SceneResources resources;
    resources.files = scene_files();
    return Scene(std::move(scene), resources).plan().warnings;
}

bool is_within(const Vec3& at, const Vec3& low, const Vec3& high) {
    return glm::all(glm::greaterThanEqual(at, low)) && glm::all(glm::lessThanEqual(at, high));
}

/// A box of 30 x 20 x 20 voxels, its halves 1 and 2, with `gap` voxels between them.
Value halves(int gap) {
    return [gap](const Vec3& at) {
        if (!is_within(at, Vec3(5), Vec3(34, 24, 24))) return 0;
        return at.x < 20 ? 1 : at.x < 20 + gap ? 0 : 2;
    };
}

const std::string kOne = "label = \"1\"\nstiffness_n_per_mm = 0.1\n";
const std::string kTwo = "label = \"2\"\nstiffness_n_per_mm = 0.2\n";

TEST(SoftBorder, IsWarnedOfWithTheUnionOfTheLabels) {
    EXPECT_THAT(warned(halves(0), kOne, kTwo),
                ElementsAre(AllOf(HasSubstr("surfaces a and b are both soft and share a border"),
                                  HasSubstr("label = [\"1\", \"2\"]"))));
}

// 20 x 20 mm of it are flat; towards its edges, smoothing turns the surface away.
TEST(SoftBorder, SaysHowLargeItIs) {
    const std::string warning = warned(halves(0), kOne, kTwo).at(0);
    const double area_cm2 = std::stod(warning.substr(warning.find("border of ") + 10));
    EXPECT_GT(area_cm2, 2.5);
    EXPECT_LT(area_cm2, 4.5);
}

TEST(SoftBorder, IsNoneOfSurfacesThatAreApartOrHardOrWithinEachOther) {
    EXPECT_THAT(warned(halves(5), kOne, kTwo), IsEmpty());
    EXPECT_THAT(warned(halves(0), kOne, "label = \"2\"\n"), IsEmpty());
    EXPECT_THAT(warned(halves(0), kOne, "label = \"2\"\nstiffness_n_per_mm = 0.5\n"), IsEmpty())
        << "as stiff as the coupling: hard";
    const Value nested = [](const Vec3& at) {
        return is_within(at, Vec3(10), Vec3(29, 19, 19))  ? 2
               : is_within(at, Vec3(5), Vec3(34, 24, 24)) ? 1
                                                          : 0;
    };
    EXPECT_THAT(warned(nested, "label = [\"1\", \"2\"]\nstiffness_n_per_mm = 0.1\n", kTwo),
                IsEmpty());
}

} // namespace
} // namespace palpate
