// SPDX-License-Identifier: Apache-2.0
// Data in memory that comes from C is felt as the same data of the C++ interface is, whoever frees
// what when.
#include <palpate/palpate_c.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/c/c_ball.h"
#include "tests/c/c_data.h"
#include "tests/support/made_labels.h"
#include "tests/support/memory_scenes.h"

namespace palpate {
namespace {

using test::Ball;
using test::field_of;
using test::in_c;
using test::no_error;
using test::sized;
using test::two_halves;
using test::vector_field_of;

const std::string kVoxelBall = "[volume.ct]\n[surface.ball]\nvolume = \"ct\"\niso_value = 500\n"
                               "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

/// The frames of a hand around the ball, in C and in C++: the same to the last bit. Returns how
/// many were in contact.
int expect_same_frames(const test::LoopPtr& loop, const SceneDescription& description) {
    const auto scene = std::make_shared<const Scene>(
        description, SceneResources{.files = scene_files()}); // no extractor, as in C
    const std::vector<FrameReport> expected = test::frames_of(scene);
    int in_contact = 0;
    std::size_t i = 0;
    for (const DeviceState& hand : test::around_ball()) {
        const palpate_frame frame = test::frame_of(loop.get(), test::probe_of(hand));
        const FrameReport& report = expected[i];
        EXPECT_EQ(test::vec(frame.proxy_m), report.proxy) << i;
        EXPECT_EQ(test::vec(frame.force_n), report.force) << i;
        EXPECT_EQ(frame.flags, report.flags) << i;
        EXPECT_EQ(frame.field_samples, report.field_samples) << i;
        EXPECT_EQ(frame.surface_queries, report.surface_queries) << i;
        in_contact += frame.contacts > 0 ? 1 : 0;
        if (testing::Test::HasFailure()) break;
        ++i;
    }
    return in_contact;
}

const std::string kFieldBall = "[volume.own]\n[surface.ball]\nvolume = \"own\"\niso_value = 0\n"
                               "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

TEST(DataInC, VoxelsAreFeltAsThoseOfCppAndAreCopied) {
    SceneDescription expected = test::ball_scene();
    expected.volumes["ct"].voxels = std::make_shared<const VoxelVolume>(test::ball_voxels());
    test::DataPtr data = test::no_data();
    {
        VoxelVolume mine = test::ball_voxels();
        const palpate_voxels given = in_c(mine);
        palpate_error error = no_error();
        ASSERT_EQ(palpate_data_add_voxels(data.get(), "ct", &given, &error), PALPATE_OK)
            << error.message;
        std::fill(mine.values.begin(), mine.values.end(), 0.0F);
    }
    const test::ScenePtr scene = test::parsed(kVoxelBall, data);
    data.reset(); // the scene keeps what it needs
    EXPECT_GT(expect_same_frames(test::made(scene), expected), 200);
}

TEST(DataInC, AMeshAloneAndAMeshBesideVoxelsAreFeltAsThoseOfCpp) {
    SceneDescription expected = test::ball_scene();
    expected.volumes["ct"].voxels = std::make_shared<const VoxelVolume>(test::ball_voxels());
    expected.surfaces["ball"].triangle_mesh =
        std::make_shared<const TriangleMesh>(test::ball_mesh());
    const VoxelVolume voxels = test::ball_voxels();
    const TriangleMesh triangles = test::ball_mesh();
    const palpate_voxels given = in_c(voxels);
    const palpate_mesh mesh = in_c(triangles);

    const test::DataPtr both = test::no_data();
    ASSERT_EQ(palpate_data_add_voxels(both.get(), "ct", &given, nullptr), PALPATE_OK);
    ASSERT_EQ(palpate_data_add_mesh(both.get(), "ball", &mesh, nullptr), PALPATE_OK);
    EXPECT_GT(expect_same_frames(test::made(test::parsed(kVoxelBall, both)), expected), 200);

    const test::DataPtr alone = test::no_data();
    ASSERT_EQ(palpate_data_add_mesh(alone.get(), "ball", &mesh, nullptr), PALPATE_OK);
    expected.volumes.clear();
    expected.surfaces["ball"].volume.clear();
    expected.surfaces["ball"].iso_value = 0.0;
    const test::ScenePtr scene =
        test::parsed("[surface.ball]\n[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n", alone);
    EXPECT_GT(expect_same_frames(test::made(scene), expected), 200);
}

TEST(DataInC, LabelsAreFeltAsThoseOfCppAndTheUnnamedAreNamedByTheirDigits) {
    LabelVolume mine = two_halves();
    mine.labels[0].name = "left half";
    SceneDescription expected = test::ball_scene();
    expected.volumes["ct"].label_volume = std::make_shared<const LabelVolume>(mine);
    expected.surfaces["ball"].iso_value = 0.0;
    expected.surfaces["ball"].labels = {"left half", "2"};

    const std::vector<std::int32_t> values(mine.layers[0].begin(), mine.layers[0].end());
    palpate_labels given = in_c(mine, values);
    // One table of names is for many patients: nobody has a tumour here.
    auto names = std::array{sized<palpate_label>(), sized<palpate_label>()};
    names[0].name = "left half";
    names[0].value = 1;
    names[1].name = "tumour";
    names[1].value = 7;
    given.labels = names.data();
    given.label_count = names.size();
    const test::DataPtr data = test::no_data();
    palpate_error error = no_error();
    ASSERT_EQ(palpate_data_add_labels(data.get(), "ct", &given, &error), PALPATE_OK)
        << error.message;
    const test::ScenePtr scene =
        test::parsed("[volume.ct]\n[surface.ball]\nvolume = \"ct\"\nlabel = [\"left half\", 2]\n"
                     "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n",
                     data);
    EXPECT_GT(expect_same_frames(test::made(scene), expected), 200);
    palpate_scene* none = nullptr;
    auto options = sized<palpate_scene_options>();
    options.data = data.get();
    EXPECT_EQ(palpate_scene_parse("[volume.ct]\n[surface.s]\nvolume = \"ct\"\nlabel = \"tumour\"\n"
                                  "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                                  "two.toml", &options, &none, &error),
              PALPATE_BAD_INPUT);
    EXPECT_THAT(error.message, testing::HasSubstr("no label is called \"tumour\""));
}

TEST(DataInC, LayersLieOneBehindTheOther) {
    const LabelVolume one = two_halves();
    const std::size_t voxels = one.layers[0].size();
    std::vector<std::int32_t> values(2 * voxels, 0);
    values[0] = 1;
    values[voxels + 5] = 1;
    palpate_labels given = in_c(one, values);
    given.layer_count = 2;
    auto names = std::array{sized<palpate_label>(), sized<palpate_label>()};
    names[0].name = "first";
    names[1].name = "second";
    names[0].value = names[1].value = 1;
    names[1].layer = 1;
    given.labels = names.data();
    given.label_count = names.size();
    const test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_labels(data.get(), "ct", &given, nullptr), PALPATE_OK);
    palpate_label_probe* made = nullptr;
    const test::ScenePtr scene =
        test::parsed("[volume.ct]\n[surface.ball]\nvolume = \"ct\"\nlabel = \"first\"\n", data);
    ASSERT_EQ(palpate_label_probe_make(scene.get(), &made, nullptr), PALPATE_OK);
    const test::LabelProbePtr probe(made);
    const double first[3] = {-11.5e-3, -11.5e-3, -11.5e-3};
    const double second[3] = {-6.5e-3, -11.5e-3, -11.5e-3};
    EXPECT_STREQ(palpate_label_at(probe.get(), first), "first");
    EXPECT_STREQ(palpate_label_at(probe.get(), second), "second");
}

TEST(DataInC, VectorsAndTensorsReachTheEffects) {
    VectorVolume flow;
    flow.size = {4, 4, 4};
    flow.index_to_scene = {Mat3(20e-3), Vec3(-30e-3)};
    std::vector<float> values;
    for (std::size_t n = 0; n < flow.voxels(); ++n)
        values.insert(values.end(), {0.0F, 0.0F, 2.0F});
    flow.values = values;
    palpate_vectors given = in_c(flow);
    const test::DataPtr data = test::no_data();
    palpate_error error = no_error();
    ASSERT_EQ(palpate_data_add_vectors(data.get(), "flow", &given, &error), PALPATE_OK)
        << error.message;
    const std::vector<float> tensors(6 * flow.voxels(), 1.0F);
    given.kind = PALPATE_TENSORS;
    given.values = tensors.data();
    given.value_count = tensors.size();
    ASSERT_EQ(palpate_data_add_vectors(data.get(), "fibres", &given, &error), PALPATE_OK)
        << error.message;
    const test::LoopPtr loop = test::made(
        test::parsed("[volume.flow]\n[volume.fibres]\n"
                     "[[effect]]\ntype = \"vector_force\"\nvolume = \"flow\"\nstrength_n = 0.5\n",
                     data));
    Vec3 force(0.0);
    for (int i = 0; i < 300; ++i) {
        DeviceState hand;
        hand.time_s = 1e-3 * i;
        force = test::vec(test::frame_of(loop.get(), test::probe_of(hand)).force_n);
    }
    // The proxy is right to 0.1 um, at 500 N/m.
    EXPECT_NEAR(force.z, 0.5, 5e-5);
    EXPECT_NEAR(std::hypot(force.x, force.y), 0.0, 5e-5);
}

TEST(DataInC, AFunctionIsFeltAsTheFormulaIs) {
    Ball ball;
    const palpate_scalar_field given = field_of(ball);
    const test::DataPtr data = test::no_data();
    palpate_error error = no_error();
    ASSERT_EQ(palpate_data_add_scalar_field(data.get(), "own", &given, &error), PALPATE_OK)
        << error.message;
    // Without iso_value: as of a formula, it is 0.
    const test::LoopPtr own = test::made(test::parsed(
        "[volume.own]\n[surface.ball]\nvolume = \"own\"\n[[effect]]\ntype = \"surface\"\n"
        "surface = \"ball\"\n",
        data));
    const test::LoopPtr formula = test::made(test::parsed(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 10\n[surface.ball]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n"));
    int in_contact = 0;
    for (const DeviceState& hand : test::around_ball()) {
        const palpate_frame a = test::frame_of(own.get(), test::probe_of(hand));
        const palpate_frame b = test::frame_of(formula.get(), test::probe_of(hand));
        // Two ways to compute the same root: within the proxy's tolerance of 0.1 um.
        ASSERT_LT(glm::length(test::vec(a.proxy_m) - test::vec(b.proxy_m)), 1e-7) << a.frame;
        in_contact += a.contacts > 0 ? 1 : 0;
    }
    EXPECT_GT(in_contact, 200);
    EXPECT_EQ(palpate_data_failures(data.get(), "own"), 0u);
}

// What is refused leaves nothing: neither a field nor its count.
TEST(DataInC, AFunctionThatIsRefusedLeavesNoFailures) {
    palpate_scalar_field given{};
    given.size = sizeof given;
    given.steepest_per_m = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        given.lower_m[axis] = -0.01;
        given.upper_m[axis] = 0.01;
    }
    given.feature_size_m = 1e-3;
    given.sample = [](const double*, double* value, double*, void*) {
        *value = std::nan("");
        return 1;
    };
    const test::DataPtr data = test::no_data();
    ASSERT_NE(palpate_data_add_scalar_field(data.get(), "own", &given, nullptr), PALPATE_OK);
    EXPECT_EQ(palpate_data_failures(data.get(), "own"), 0u);
}

TEST(DataInC, AVectorFunctionReachesTheEffects) {
    Ball ball;
    const palpate_vector_field given = vector_field_of(ball);
    const test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_vector_field(data.get(), "up", &given, nullptr), PALPATE_OK);
    const test::LoopPtr loop = test::made(test::parsed(
        "[volume.up]\n[[effect]]\ntype = \"vector_force\"\nvolume = \"up\"\nstrength_n = 0.5\n",
        data));
    palpate_frame frame{};
    for (int i = 0; i < 300; ++i) {
        DeviceState hand;
        hand.time_s = 1e-3 * i;
        frame = test::frame_of(loop.get(), test::probe_of(hand));
    }
    EXPECT_NEAR(frame.force_n[2], 0.5, 5e-5);
    ball.has_failed = true; // from here on it is no vector: the force ends
    for (int i = 300; i < 600; ++i) {
        DeviceState hand; // moves: a proxy at rest would not ask again
        hand.time_s = 1e-3 * i;
        hand.position.x = 1e-5 * i;
        frame = test::frame_of(loop.get(), test::probe_of(hand));
        ASSERT_TRUE(is_finite(test::vec(frame.force_n)));
    }
    EXPECT_EQ(test::vec(frame.force_n), Vec3(0.0));
    EXPECT_GT(palpate_data_failures(data.get(), "up"), 0u);
}

TEST(DataInC, AFunctionIsReleasedOnceWhenNothingCanAskItAnyMore) {
    Ball ball;
    const palpate_scalar_field given = field_of(ball);
    test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_scalar_field(data.get(), "own", &given, nullptr), PALPATE_OK);
    test::ScenePtr scene = test::parsed(kFieldBall, data);
    test::LoopPtr loop = test::made(scene);
    palpate_state* saved = nullptr;
    ASSERT_EQ(palpate_loop_save(loop.get(), &saved, nullptr), PALPATE_OK);
    test::StatePtr state(saved);
    data.reset();
    scene.reset();
    EXPECT_EQ(ball.releases, 0);
    loop.reset();
    EXPECT_EQ(ball.releases, 0) << "the state keeps the scene";
    state.reset();
    EXPECT_EQ(ball.releases, 1);

    palpate_scalar_field wrong = field_of(ball);
    wrong.steepest_per_m = 0.5;
    const test::DataPtr other = test::no_data();
    EXPECT_EQ(palpate_data_add_scalar_field(other.get(), "own", &wrong, nullptr),
              PALPATE_BAD_INPUT);
    EXPECT_EQ(ball.releases, 1) << "what was refused is the caller's";
}

// As embedding.md says: a scan of before is not kept until the end of the run.
TEST(DataInC, AFunctionIsReleasedOnceALoopHasLeftItsScene) {
    Ball ball;
    const palpate_scalar_field given = field_of(ball);
    test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_scalar_field(data.get(), "own", &given, nullptr), PALPATE_OK);
    test::ScenePtr scene = test::parsed(kFieldBall, data);
    const test::LoopPtr loop = test::made(scene);
    data.reset();
    scene.reset();
    const test::ScenePtr other =
        test::parsed("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n[surface.s]\n"
                     "volume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n");
    for (const int released : {0, 1, 1}) {
        ASSERT_EQ(palpate_loop_adopt(loop.get(), other.get(), nullptr), PALPATE_OK);
        EXPECT_EQ(ball.releases, released);
        for (int i = 0; i < 3; ++i)
            test::frame_of(loop.get(), test::probe_of(DeviceState{}));
    }
}

TEST(DataInC, AFunctionThatFailsInTheLoopIsCountedAndNothingIsFeltThere) {
    for (const bool says_so : {false, true}) {
        Ball ball;
        const palpate_scalar_field given = field_of(ball);
        const test::DataPtr data = test::no_data();
        ASSERT_EQ(palpate_data_add_scalar_field(data.get(), "own", &given, nullptr), PALPATE_OK);
        const test::LoopPtr loop = test::made(test::parsed(kFieldBall, data));
        palpate_frame frame{};
        double before_n = 0.0;
        for (const DeviceState& hand : test::around_ball()) {
            (says_so ? ball.has_ended : ball.has_failed) = frame.frame >= 200;
            frame = test::frame_of(loop.get(), test::probe_of(hand));
            const double force_n = glm::length(test::vec(frame.force_n));
            ASSERT_TRUE(std::isfinite(force_n)) << frame.frame;
            ASSERT_TRUE(is_finite(test::vec(frame.proxy_m))) << frame.frame;
            ASSERT_LE(std::abs(force_n - before_n), 2.0 + 1e-9) << "2000 N/s at 1 kHz";
            before_n = force_n;
            if (frame.frame == 200) {
                EXPECT_GT(force_n, 0.5);
            }
        }
        EXPECT_EQ(before_n, 0.0);
        EXPECT_EQ(palpate_data_failures(data.get(), "own") > 0, !says_so);
        EXPECT_EQ(palpate_data_failures(data.get(), "other"), 0u);
    }
}

TEST(DataInC, LoopsOfSeveralThreadsAskOneFunctionAtOnce) {
    Ball ball;
    const palpate_scalar_field given = field_of(ball);
    const test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_scalar_field(data.get(), "own", &given, nullptr), PALPATE_OK);
    const test::ScenePtr scene = test::parsed(kFieldBall, data);
    std::array<std::vector<Vec3>, 3> proxies;
    std::vector<std::thread> threads;
    for (std::vector<Vec3>& list : proxies)
        threads.emplace_back([&] {
            const test::LoopPtr loop = test::made(scene);
            for (const DeviceState& hand : test::around_ball())
                list.push_back(test::vec(test::frame_of(loop.get(), test::probe_of(hand)).proxy_m));
        });
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(proxies[0].size(), 400u);
    EXPECT_EQ(proxies[0], proxies[1]);
    EXPECT_EQ(proxies[0], proxies[2]);
}

// ---- what is refused ---------------------------------------------------------------------------

} // namespace
} // namespace palpate
