// SPDX-License-Identifier: Apache-2.0
// Strengths that are functions of a volume's value where a frame begins; guides from files.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/effects/local_strength.h>
#include <palpate/volume/fields/grid_field.h>

#include "tests/support/mesh_text.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

// Its value is 30 mm less the distance from the origin, in m.
const std::string kGround = "[volume.ground]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n";
const std::string kPlate = "[volume.plate]\nanalytic = \"slab\"\nthickness_mm = 20\n";
const std::string kFunction = "volume = \"ground\"\nstrength_n = [[0, 0.2], [0.03, 1.0]]\n";

double strength_at(const Vec3& point) {
    const double value = std::clamp(0.03 - glm::length(point), 0.0, 0.03);
    return 0.2 + 0.8 * value / 0.03;
}

std::string complaint(const std::string& text) {
    try {
        parse_scene(text, "x.toml");
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

/// Frames of a hand; `look` gets each with the proxy at whose place it began.
void frames(const std::string& text, const std::function<Vec3(int)>& hand, int count,
            const std::function<void(const FrameReport&, const Vec3&)>& look) {
    test::ScriptedClock clock;
    HapticLoop loop(std::make_shared<const Scene>(parse_scene(text, "x.toml"),
                                                  SceneResources{.files = scene_files()}),
                    clock);
    DeviceState state;
    state.position = hand(0);
    Vec3 start = state.position;
    for (int i = 0; i < count; ++i) {
        state.position = hand(i);
        const FrameReport report = loop.frame(state);
        look(report, start);
        start = report.proxy;
    }
}

// What slips, yields or holds from behind does so with the strength of the place where the frame
// began: 500 N/m times the tolerance of 0.1 um.
constexpr double kTolerance_n = 1e-4;

TEST(LocalStrength, AGuideLetsSlipByPlace) {
    for (const char* points : {"[[0, 0, 0]]", "[[-100, 0, 0], [100, 0, 0]]"}) {
        int slipped = 0;
        frames(
            kGround + "[[effect]]\ntype = \"guide\"\npoints_mm = " + points + "\n" + kFunction,
            [](int i) {
                return Vec3{0.0, 0.04e-3 * i, 0.0};
            },
            500,
            [&](const FrameReport& frame, const Vec3& start) {
                if (glm::length(frame.proxy) < 1e-6) return;
                ++slipped;
                EXPECT_NEAR(frame.force.y, -strength_at(start), kTolerance_n) << frame.frame;
                EXPECT_LE(frame.field_samples, 1u); // a proxy at rest has it
            });
        EXPECT_GT(slipped, 300) << points;
    }
}

TEST(LocalStrength, AWorkspaceYieldsByPlace) {
    for (const char* limits : {"radius_mm = 10\ncenter_mm = [0, 0, 0]\n",
                               "box_mm = [[-10, -10, -10], [10, 10, 10]]\n"}) {
        int yielded = 0;
        frames(
            kGround + "[[effect]]\ntype = \"workspace\"\n" + limits + kFunction,
            [](int i) {
                return Vec3{0.0, 0.04e-3 * i, 0.0};
            },
            500,
            [&](const FrameReport& frame, const Vec3& start) {
                if (frame.proxy.y < 0.01 + 1e-6) return;
                ++yielded;
                EXPECT_NEAR(frame.force.y, -strength_at(start), kTolerance_n) << frame.frame;
            });
        EXPECT_GT(yielded, 100) << limits;
    }
}

// Where there are no data, what must not let go holds as strongly as it can.
TEST(LocalStrength, WithoutDataNothingIsFeltOfAGuideAndAllOfAWorkspace) {
    VoxelVolume voxels;
    voxels.size = {2, 2, 2};
    voxels.index_to_scene = {Mat3(1e-3), Vec3(0.0)};
    voxels.values.assign(8, 1.0F);
    TransferFunction strength;
    strength.count = 2;
    strength.nodes[0] = {0.0, 0.5};
    strength.nodes[1] = {1.0, 0.7};
    const StrengthOverField over{std::make_shared<GridField>(voxels, 0.0F), strength};
    LocalStrength guide(1.0, over), workspace = LocalStrength::holding(1.0, over);
    const Vec3 inside(0.5e-3), outside(0.1);
    EXPECT_DOUBLE_EQ(guide.at(inside), 0.7);
    EXPECT_DOUBLE_EQ(workspace.at(inside), 0.7);
    EXPECT_DOUBLE_EQ(guide.at(outside), 0.0);
    EXPECT_DOUBLE_EQ(workspace.at(outside), 0.7);
    EXPECT_FALSE(LocalStrength(1.0).depends_on_place());
    EXPECT_DOUBLE_EQ(LocalStrength(1.0).at(outside), 1.0);
}

std::string plate(const std::string& keys) {
    return kGround + kPlate + "[surface.top]\nvolume = \"plate\"\niso_value = 0\n" + keys +
           "[[effect]]\ntype = \"surface\"\nsurface = \"top\"\n";
}

TEST(LocalStrength, AMagnetLetsGoByPlace) {
    for (const double x_m : {0.0, 10e-3, 20e-3}) {
        double most_n = 0.0;
        const Vec3 on_plate{x_m, 0, 10e-3};
        frames(
            plate("") + "[[effect]]\ntype = \"magnet\"\nsurface = \"top\"\ncapture_mm = 1\n" +
                kFunction,
            [&](int i) {
                return on_plate + Vec3{0, 0, i == 0 ? 1e-6 : 0.01e-3 * i};
            },
            250,
            [&](const FrameReport& frame, const Vec3&) {
                if (frame.proxy.z < 10e-3 + 1e-6) most_n = std::max(most_n, -frame.force.z);
            });
        // Found in steps of 0.01 mm times 500 N/m.
        EXPECT_LE(most_n, strength_at(on_plate) + kTolerance_n) << x_m;
        EXPECT_GE(most_n, strength_at(on_plate) - 0.006) << x_m;
    }
}

/// Where it is pushed to it holds: its force is the strength of where each frame began.
void expect_yielding_by_place(const std::string& text) {
    int yielded = 0;
    frames(
        text,
        [](int i) {
            return Vec3{0.02e-3 * i, 0, 11e-3 - 0.02e-3 * i};
        },
        400,
        [&](const FrameReport& frame, const Vec3& start) {
            if (!frame.surfaces_open || start.z > 10e-3 - 1e-6) return;
            ++yielded;
            // It yields along its normal.
            EXPECT_NEAR(frame.force.z, strength_at(start), kTolerance_n) << frame.frame;
        });
    EXPECT_GT(yielded, 100);
}

TEST(LocalStrength, ASurfaceYieldsByPlace) {
    expect_yielding_by_place(
        plate("strength_volume = \"ground\"\nstrength_n = [[0, 0.2], [0.03, 1.0]]\n"));
}

// Where its strength is less than anybody feels, a hand goes through; elsewhere it holds. The
// guide, a line along the hand's way, holds nothing: with it the solver is that of mixed
// primitives.
TEST(LocalStrength, ASurfaceIsPassedWhereItsStrengthIsNothing) {
    for (const double x_mm : {0.0, 28.0}) {
        double most_n = 0.0, last_m = 0.0;
        frames(
            plate("strength_volume = \"ground\"\nstrength_n = [[0.005, 1e-307], [0.015, 1.0]]\n") +
                fmt::format("[[effect]]\ntype = \"guide\"\nstrength_n = 0.001\n"
                            "points_mm = [[{0}, 0, -50], [{0}, 20, 50]]\n",
                            x_mm),
            [&](int i) {
                return Vec3{1e-3 * x_mm, 0, 11e-3 - 0.02e-3 * i};
            },
            150, // to 2 mm behind it
            [&](const FrameReport& frame, const Vec3&) {
                most_n = std::max(most_n, glm::length(frame.force));
                last_m = frame.proxy.z - frame.probe.z;
            });
        if (x_mm == 0.0) {
            EXPECT_NEAR(last_m, 2e-3, 0.1e-3) << "it holds there";
        } else {
            EXPECT_LE(most_n, 0.001 + kTolerance_n);
            EXPECT_LE(last_m, 0.001 / 500.0 + 1e-7);
        }
    }
}

// In code strength_n need not be given: it is the greatest of the function, as a file's reader
// says.
TEST(LocalStrength, InCodeItIsAsInAFile) {
    const std::string ball = "[volume.b]\nanalytic = \"solid_sphere\"\nradius_mm = 40\n"
                             "[surface.s]\nvolume = \"b\"\n";
    const std::string felt = "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n";
    const std::string over = "volume = \"b\"\nstrength_n = [[-1, 0.5], [1, 0.5]]\n";
    struct Case {
        std::string text;
        std::function<void(SceneDescription&)> forget; // the number that the reader has found
    };
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    const std::vector<Case> cases{
        {ball + felt + "[[effect]]\ntype = \"workspace\"\nbox_mm = [[50, -9, -9], [99, 9, 9]]\n" +
             over,
         [](SceneDescription& s) {
             std::get<effects::Workspace>(s.effects[1].settings).strength_n = kInfinite;
         }},
        {ball + felt + "[[effect]]\ntype = \"magnet\"\nsurface = \"s\"\n" + over,
         [](SceneDescription& s) {
             std::get<effects::Magnet>(s.effects[1].settings).strength_n = 0.0;
         }},
        {ball + felt + "[[effect]]\ntype = \"guide\"\npoints_mm = [[50, 0, 0]]\n" + over,
         [](SceneDescription& s) {
             std::get<effects::Guide>(s.effects[1].settings).strength_n = 0.0;
         }},
        {ball + "strength_volume = \"b\"\nstrength_n = [[-1, 0.5], [1, 0.5]]\nyield = \"opens\"\n" +
             felt,
         [](SceneDescription& s) { s.surfaces.at("s").strength_n = kInfinite; }},
    };
    for (const Case& one : cases) {
        const SceneDescription file = parse_scene(one.text, "x.toml");
        SceneDescription code = file;
        one.forget(code);
        const auto from_file = std::make_shared<const Scene>(file);
        const auto from_code = std::make_shared<const Scene>(code);
        EXPECT_EQ(from_code->plan().left_out, from_file->plan().left_out) << one.text;
        test::ScriptedClock clock;
        HapticLoop a(from_file, clock), b(from_code, clock);
        DeviceState state;
        for (int i = 0; i < 400; ++i) {
            state.position = {60e-3 - 1e-4 * i, 0.0, 0.0};
            const FrameReport x = a.frame(state), y = b.frame(state);
            ASSERT_EQ(x.proxy, y.proxy) << i << one.text;
            ASSERT_EQ(x.force, y.force) << i << one.text;
        }
    }
    // Contact direct never yields, whatever the number was.
    SceneDescription direct = parse_scene(cases.back().text, "x.toml");
    cases.back().forget(direct);
    direct.surfaces.at("s").contact = ContactKind::direct;
    direct.surfaces.at("s").triangle_mesh =
        std::make_shared<TriangleMesh>(test::icosphere(0.04, 3));
    try {
        Scene{direct};
        FAIL() << "it yields at 0.5 N";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("never yields, and its strength_n = 0.5"),
                  std::string::npos)
            << error.what();
    }
}

TEST(LocalStrength, AMaterialsFunctionIsOfItsSurfacesVolume) {
    expect_yielding_by_place("[material.skin]\nstrength_n = [[0, 0.2], [0.03, 1.0]]\n" +
                             plate("material = \"skin\"\nstrength_volume = \"ground\"\n"));
    // Without one it is the value at the surface's own level.
    const SceneDescription scene = parse_scene(
        "[material.skin]\nstrength_n = [[-1, 0], [1, 1.0]]\n" + plate("material = \"skin\"\n"),
        "x.toml");
    EXPECT_DOUBLE_EQ(scene.surfaces.at("top").strength_n, 0.5);
}

// A surface of the volume itself samples it in any case.
TEST(LocalStrength, ItsSampleIsTheFramesFirst) {
    const std::string ball =
        kGround + "[surface.ball]\nvolume = \"ground\"\niso_value = 0\n[[effect]]\ntype = "
                  "\"surface\"\nsurface = \"ball\"\n[loop]\nmethod = \"fixed\"\nsub_steps = 3\n";
    const std::string guide = "[[effect]]\ntype = \"guide\"\npoints_mm = [[0, 0, 0]]\n" + kFunction;
    const std::string limit =
        "[[effect]]\ntype = \"workspace\"\nradius_mm = 40\ncenter_mm = [0, 0, 0]\n" + kFunction;
    frames(
        ball + guide + limit,
        [](int i) {
            return Vec3{0, 0, 35e-3 - 0.1e-3 * i};
        },
        100,
        [](const FrameReport& frame, const Vec3&) {
            EXPECT_LE(frame.field_samples, frame.evaluations + (frame.frame == 0 ? 1 : 0));
        });
    const EffectPlan plan =
        plan_effects(parse_scene(ball + guide + limit, "x.toml"), Extraction::impossible);
    EXPECT_EQ(plan.effects[1].start_samples, 0.0);
    EXPECT_EQ(plan.effects[2].start_samples, 0.0);
    EXPECT_NE(plan.effects[1].sharing.find("effect 1"), std::string::npos);
}

TEST(LocalStrength, FunctionsAndVolumesGoTogether) {
    const auto expect = [&](const std::string& text, const std::string& wanted) {
        EXPECT_NE(complaint(text).find(wanted), std::string::npos) << complaint(text);
    };
    const std::string guide = kGround + "[[effect]]\ntype = \"guide\"\npoints_mm = [[0, 0, 0]]\n";
    expect(guide + "strength_n = [[0, 1], [1, 2]]\n",
           "x.toml:7: strength_n in [[effect]] is a function, and no volume says of what; name the "
           "volume with volume = \"...\"");
    expect(guide + "strength_n = 1\nvolume = \"ground\"\n",
           "x.toml:8: volume in [[effect]] is for a strength_n that is a function of its value");
    expect(plate("strength_volume = \"ground\"\n"),
           "strength_volume in [surface.top] is for a strength_n that is a function");
    expect(plate("strength_volume = \"none\"\nstrength_n = [[0, 1], [1, 2]]\n"),
           "strength_volume \"none\" in [surface.top] does not exist");
    expect(plate("strength_volume = \"ground\"\nstrength_n = [[0, 0], [1, 2]]\n"),
           "strength_n in [surface.top] is 0 N at the value 0, where there would be no surface");
}

class GuideFile : public testing::Test {
protected:
    std::string scene_with(const std::string& csv) {
        test::make_file(folder_ / "line.csv", csv);
        return "[[effect]]\ntype = \"guide\"\nfile = \"line.csv\"\nstrength_n = 2\n";
    }
    std::string complaint_about(const std::string& csv) {
        try {
            parse_scene(scene_with(csv), folder_ / "x.toml");
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            return message.substr(message.rfind(folder_.path().string(), 0) == 0
                                      ? folder_.path().string().size() + 1
                                      : 0);
        }
        return "";
    }
    const test::TemporaryFolder folder_;
};

TEST_F(GuideFile, HoldsThePointsOfTheScene) {
    const SceneDescription from_file =
        parse_scene(scene_with("x_m,y_m,z_m\n0,0,0\r\n 0.01, -0.02 ,3e-3\n"), folder_ / "x.toml");
    const std::vector<Vec3> expected{{0, 0, 0}, {0.01, -0.02, 3e-3}};
    EXPECT_EQ(std::get<effects::Guide>(from_file.effects[0].settings).points_m, expected);
}

TEST_F(GuideFile, IsRefusedWithItsLine) {
    EXPECT_EQ(complaint_about("x,y,z\n1,2,3\n"),
              "line.csv:1: the header is \"x,y,z\"; begin with x_m,y_m,z_m");
    EXPECT_EQ(complaint_about("x_m,y_m,z_m\n"),
              "line.csv:1: no rows after the header; give a row per point");
    EXPECT_EQ(complaint_about("x_m,y_m,z_m\n1,2\n"),
              "line.csv:2: 2 columns instead of 3; give x_m,y_m,z_m");
    EXPECT_EQ(complaint_about("x_m,y_m,z_m\n0,0,0\n1,2,nan\n"),
              "line.csv:3: nan is not a place in a scene; give metres, scene frame (LPS), finite");
    EXPECT_EQ(complaint_about("x_m,y_m,z_m\n0,0,0\n0,0,zero\n"),
              "line.csv:3: \"zero\" is not a number; write decimals with a point, columns with "
              "commas");
    EXPECT_TRUE(complaint_about("x_m,y_m,z_m\n0,0,0\n0,0,0\n").starts_with("x.toml:3: file in "));
    EXPECT_TRUE(complaint("[[effect]]\ntype = \"guide\"\nfile = \"none.csv\"\nstrength_n = 1\n")
                    .starts_with("x.toml:3: file = \"none.csv\" in [[effect]] does not exist"));
    EXPECT_TRUE(
        complaint("[[effect]]\ntype = \"guide\"\nfile = \"a.csv\"\npoints_mm = [[0, 0, 0]]\n"
                  "strength_n = 1\n")
            .starts_with("x.toml:3: file and points_mm in [[effect]] exclude each other"));
}

// A recording is of the file as it was.
TEST_F(GuideFile, IsASourceOfARecording) {
    const Scene scene(parse_scene(scene_with("x_m,y_m,z_m\n0,0,0\n1,0,0\n"), folder_ / "x.toml"));
    const auto before = sources(scene);
    ASSERT_EQ(before.size(), 1u);
    EXPECT_EQ(before[0].file, (folder_ / "line.csv").string());
    test::make_file(folder_ / "line.csv", "x_m,y_m,z_m\n0,0,0\n2,0,0\n");
    EXPECT_NE(sources(scene)[0].sha256, before[0].sha256);
}

} // namespace
} // namespace palpate
