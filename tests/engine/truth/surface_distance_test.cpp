// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/truth/surface_distance.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/surface_scene.h>

#include "tests/support/scene_texts.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

std::shared_ptr<const Scene> formula(const std::string& volume) {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\n" + volume +
            "\n[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
        "formula.toml"));
}

struct Formula {
    const char* volume;
    std::function<double(const Vec3&)> distance; // m, < 0 in the material
};

Vec3 any_point(std::mt19937_64& random, double size) {
    std::uniform_real_distribution<double> any(-size, size);
    return {any(random), any(random), any(random)};
}

// A point is on the level to 1e-11 m. A foot that is beside the nearest one by t is too far by
// t^2 / 2 times what curves: rounding, 1e-17 m, hides a t of 1e-9 m at 50 mm, so 1e-10 m it is.
constexpr double kError_m = 1e-10;

TEST(SurfaceDistance, OfFormulasIsWhatThePencilSays) {
    const std::vector<Formula> formulas{
        {"analytic = \"solid_sphere\"\nradius_mm = 30",
         [](const Vec3& p) { return glm::length(p) - 0.03; }},
        {"analytic = \"sphere_cavity\"\nradius_mm = 30",
         [](const Vec3& p) { return 0.03 - glm::length(p); }},
        {"analytic = \"slab\"\nthickness_mm = 10",
         [](const Vec3& p) { return std::abs(p.z) - 0.005; }},
        {"analytic = \"torus\"\nradius_mm = 30\ntube_mm = 8",
         [](const Vec3& p) { return std::hypot(std::hypot(p.x, p.y) - 0.03, p.z) - 0.008; }},
    };
    for (const Formula& one : formulas) {
        SCOPED_TRACE(one.volume);
        const SurfaceDistance distance(formula(one.volume), "s");
        std::mt19937_64 random(7);
        for (int i = 0; i < 500; ++i) {
            const Vec3 point = any_point(random, 0.05);
            const auto nearest = distance.nearest(point);
            ASSERT_TRUE(nearest);
            EXPECT_NEAR(nearest->distance_m, one.distance(point), kError_m);
            EXPECT_NEAR(one.distance(nearest->position), 0.0, 1e-11 + 1e-16);
            EXPECT_NEAR(glm::length(nearest->position - point), std::abs(nearest->distance_m),
                        1e-15);
            EXPECT_TRUE(nearest->sign_known);
            // The way to it is along its normal: beside it by 1e-6 m, the distance would be longer
            // by 1e-11 m or more.
            if (std::abs(nearest->distance_m) > 1e-4) {
                EXPECT_GT(glm::dot(nearest->normal, point - nearest->position) /
                              nearest->distance_m,
                          0.9999);
            }
        }
    }
}

TEST(SurfaceDistance, OfAMeshIsTheNearestOfAllItsTriangles) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    for (const char* file : {"ball.ply", "bumps.ply", "box.ply"}) {
        SCOPED_TRACE(file);
        const auto scene = std::make_shared<const Scene>(
            parse_scene("[surface.s]\nmesh = \"" + std::string(file) +
                            "\"\nmesh_unit = \"mm\"\nmesh_frame = \"LPS\"\n"
                            "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                        folder.path() / "scene.toml"),
            SceneResources{.files = scene_files()});
        const SurfaceDistance distance(scene, "s");
        const TriangleMesh& mesh = scene->surfaces()[0].mesh.scene->mesh();
        std::mt19937_64 random(3);
        for (int i = 0; i < 200; ++i) {
            const Vec3 point = any_point(random, 0.02);
            double nearest_m = std::numeric_limits<double>::infinity();
            for (const auto& triangle : mesh.triangles) { // finely sampled: never nearer than it
                const Vec3 &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]],
                           &c = mesh.vertices[triangle[2]];
                constexpr int kParts = 12;
                for (int u = 0; u <= kParts; ++u)
                    for (int v = 0; u + v <= kParts; ++v)
                        nearest_m =
                            std::min(nearest_m, glm::length(a + double(u) / kParts * (b - a) +
                                                            double(v) / kParts * (c - a) - point));
            }
            const auto nearest = distance.nearest(point);
            ASSERT_TRUE(nearest);
            EXPECT_LE(std::abs(nearest->distance_m), nearest_m + 1e-15);
            // Samples are at most a twelfth of the longest edge, 23 mm for the box, apart.
            EXPECT_GE(std::abs(nearest->distance_m), nearest_m - 2e-3);
            EXPECT_TRUE(nearest->sign_known);
            if (std::string(file) == "box.ply") {
                const Vec3 q =
                    glm::max(1e-3 * Vec3(-9, -7, -8) - point, point - 1e-3 * Vec3(9, 8, 7));
                const double outside = glm::length(glm::max(q, Vec3(0.0)));
                const double expected = outside > 0.0 ? outside : std::max(q.x, std::max(q.y, q.z));
                EXPECT_NEAR(nearest->distance_m, expected, 1e-15);
            }
        }
    }
}

TEST(SurfaceDistance, RefusesASurfaceThatIsNotThereAndPointsThatAreNone) {
    const auto scene = formula("analytic = \"solid_sphere\"\nradius_mm = 30");
    const auto complaint = [](const std::shared_ptr<const Scene>& of) -> std::string {
        try {
            SurfaceDistance(of, "bone");
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "nothing was thrown";
    };
    const std::string none = "surface \"bone\" is none that the scene lets one feel; ";
    EXPECT_EQ(complaint(scene), none + "give one of: s");
    EXPECT_EQ(complaint(std::make_shared<const Scene>(SceneDescription{})),
              none + "there are none: add an effect with type = \"surface\"");
    EXPECT_FALSE(SurfaceDistance(scene, "s").nearest({NAN, 0, 0}));
}

} // namespace
} // namespace palpate
