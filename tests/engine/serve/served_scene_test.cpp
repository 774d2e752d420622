// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/serve/served_scene.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

ViewStructure structure(const std::string& name, const std::string& color,
                        std::shared_ptr<const TriangleMesh> mesh) {
    ViewStructure made;
    made.name = name;
    made.color = color;
    made.mesh = std::move(mesh);
    return made;
}

TEST(ServedScene, SurfacesKeepColoursAndAreNoLargerThanAsked) {
    const auto large = std::make_shared<TriangleMesh>(test::icosphere(0.05, 4));
    const auto small = std::make_shared<TriangleMesh>(test::icosphere(0.01, 1));
    ASSERT_GT(large->triangles.size(), 2000u);
    const std::vector<ViewStructure> structures{structure("large", "#ff8000", large),
                                                structure("nothing", "#ffffff", nullptr),
                                                structure("small", "#000033", small)};
    const std::vector<ServedSurface> all = served_surfaces(structures, 1'000'000);
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].name, "large");
    EXPECT_THAT(all[0].rgba, testing::ElementsAre(1.0f, 128.0f / 255.0f, 0.0f, 1.0f));
    EXPECT_EQ(all[0].mesh, large); // as it is
    EXPECT_THAT(all[1].rgba, testing::ElementsAre(0.0f, 0.0f, 0.2f, 1.0f));
    const std::vector<ServedSurface> few = served_surfaces(structures, 1'000);
    EXPECT_LE(few[0].mesh->triangles.size(), 1'000u);
    EXPECT_GT(few[0].mesh->triangles.size(), 200u);
    EXPECT_EQ(few[1].mesh, small);
}

TEST(ServedScene, NamesFitAndStayApart) {
    const auto mesh = std::make_shared<TriangleMesh>(test::icosphere(0.01, 1));
    const std::vector<ServedSurface> served =
        served_surfaces(std::vector{structure("superior temporal gyrus left", "", mesh),
                                    structure("superior temporal gyrus right", "", mesh),
                                    structure("superior temporal g", "", mesh),
                                    structure("superior temporal gyr~2", "", mesh),
                                    structure("a name with \xC3\xBCmlaut\xC3\xA4", "", mesh)},
                        1000);
    std::vector<std::string> names;
    for (const ServedSurface& surface : served)
        names.push_back(surface.name);
    EXPECT_THAT(names, testing::ElementsAre("superior temporal gy", "superior temporal ~2",
                                            "superior temporal g", "superior temporal ~3",
                                            "a name with \xC3\xBCmlaut"));
}

TEST(ServedScene, TransformsAreThoseOfPlusAndTheProxy) {
    RunFrame run;
    run.frame.frame = 4'294'967'296 + 17;
    run.frame.probe = {0.001, 0.002, 0.003};
    run.frame.proxy = {0.004, 0.005, 0.006};
    run.frame.force = {1.0, -2.0, 3.0};
    run.input.buttons = 0b1101;
    ServedFrame frame = served_frame(run, 1234567890.5);
    frame.velocity = {0.1, 0.2, -0.3};
    for (const IgtlVersion version : {IgtlVersion::one, IgtlVersion::two}) {
        const std::vector<IgtlMessage> messages = transforms_of(frame, version);
        ASSERT_EQ(messages.size(), 5u);
        const auto expect = [&](std::size_t place, const std::string& name,
                                const std::array<float, 12>& values) {
            const IgtlMessage& message = messages[place];
            EXPECT_EQ(message.version, version);
            EXPECT_EQ(message.type, "TRANSFORM");
            EXPECT_EQ(message.device, name);
            EXPECT_EQ(message.id, 17u);
            EXPECT_EQ(message.time >> 31, 2 * 1234567890u + 1);
            EXPECT_EQ(read_igtl_transform(message.content)->values, values) << name;
        };
        expect(0, "Stylus", {1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -2, 3});
        expect(1, "StylusVelocity", {1, 0, 0, 0, 1, 0, 0, 0, 1, -100, -200, -300});
        expect(2, "Buttons", {1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0});
        expect(3, "Force", {1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 2, 3});
        expect(4, "Proxy", {1, 0, 0, 0, 1, 0, 0, 0, 1, -4, -5, 6});
    }
}

TEST(ServedScene, VelocityIsOfOneTrial) {
    ServedFrame before;
    before.time_s = 1.0;
    before.stylus.position = {0.01, 0.0, 0.0};
    ServedFrame now = before;
    EXPECT_EQ(velocity_between(before, now), Vec3(0.0));
    now.time_s = 1.5;
    now.stylus.position = {0.02, -0.01, 0.0};
    EXPECT_NEAR(glm::length(velocity_between(before, now) - Vec3(0.02, -0.02, 0.0)), 0.0, 1e-15);
    now.trial = 1;
    EXPECT_EQ(velocity_between(before, now), Vec3(0.0));
}

} // namespace
} // namespace palpate
