// SPDX-License-Identifier: Apache-2.0
// Data in memory that comes from C is felt as the same data of the C++ interface is, whoever frees
// what when; and what is wrong with it is refused by its name.
#include <palpate/palpate_c.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/c/c_data.h"
#include "tests/support/made_labels.h"
#include "tests/support/memory_scenes.h"

namespace palpate {
namespace {

using test::in_c;
using test::no_error;
using test::sized;
using testing::HasSubstr;
using testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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

LabelVolume two_halves() {
    return test::made_labels({24, 24, 24}, {Mat3(1e-3), Vec3(-11.5e-3)}, 2, [](const Vec3& index) {
        if (glm::length(index - 11.5) > 9.0) return 0;
        return index.x < 12.0 ? 1 : 2;
    });
}

/// Depth below a ball's surface, m, and counts what Palpate does with it.
struct Ball {
    double radius_m = test::kBall_m;
    double scale = 1.0;                  // of the gradient
    std::atomic<bool> has_failed{false}; // gives NaN from then on
    std::atomic<bool> has_ended{false};  // has no value from then on
    std::atomic<int> calls{0};
    std::atomic<int> releases{0};
};

extern "C" int32_t sample_ball(const double* p, double* value, double* gradient, void* user) {
    auto& ball = *static_cast<Ball*>(user);
    ++ball.calls;
    if (ball.has_ended) return 0;
    const double r = std::hypot(p[0], p[1], p[2]);
    *value = ball.has_failed ? kNan : ball.radius_m - r;
    for (int i = 0; i < 3; ++i)
        gradient[i] = r > 0.0 ? -ball.scale * p[i] / r : 0.0;
    return 1;
}

extern "C" void release_ball(void* user) { ++static_cast<Ball*>(user)->releases; }

palpate_scalar_field field_of(Ball& ball) {
    auto field = sized<palpate_scalar_field>();
    field.sample = sample_ball;
    field.user = &ball;
    field.release = release_ball;
    for (int i = 0; i < 3; ++i) {
        field.lower_m[i] = -1.2 * test::kBall_m;
        field.upper_m[i] = 1.2 * test::kBall_m;
    }
    field.steepest_per_m = 1.0;
    field.feature_size_m = test::kBall_m;
    return field;
}

extern "C" int32_t sample_up(const double* p, double* value, void* user) {
    auto& ball = *static_cast<Ball*>(user);
    ++ball.calls;
    value[0] = value[1] = 0.0;
    value[2] = ball.has_failed ? kNan : 1.0;
    return p[0] > -1.0 ? 1 : 0;
}

palpate_vector_field vector_field_of(Ball& ball) {
    const palpate_scalar_field like = field_of(ball);
    auto field = sized<palpate_vector_field>();
    field.sample = sample_up;
    field.user = &ball;
    field.release = release_ball;
    std::copy_n(like.lower_m, 3, field.lower_m);
    std::copy_n(like.upper_m, 3, field.upper_m);
    field.feature_size_m = 1e-2;
    return field;
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
    auto left = sized<palpate_label>();
    left.name = "left half";
    left.value = 1;
    given.labels = &left;
    given.label_count = 1;
    const test::DataPtr data = test::no_data();
    palpate_error error = no_error();
    ASSERT_EQ(palpate_data_add_labels(data.get(), "ct", &given, &error), PALPATE_OK)
        << error.message;
    const test::ScenePtr scene =
        test::parsed("[volume.ct]\n[surface.ball]\nvolume = \"ct\"\nlabel = [\"left half\", 2]\n"
                     "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n",
                     data);
    EXPECT_GT(expect_same_frames(test::made(scene), expected), 200);
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
    const test::LoopPtr own = test::made(test::parsed(kFieldBall, data));
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

struct Complaint {
    palpate_code code;
    std::string message;
};

/// What adding says; a second good call with the same name then has to succeed.
Complaint complaint_of(const std::function<palpate_code(palpate_data*, palpate_error*)>& add) {
    const test::DataPtr data = test::no_data();
    palpate_error error = no_error();
    const palpate_code code = add(data.get(), &error);
    EXPECT_EQ(code, error.code);
    EXPECT_EQ(std::string(error.message).find('\n'), std::string::npos);
    const VoxelVolume good = test::ball_voxels();
    const palpate_voxels given = in_c(good);
    if (code != PALPATE_OK) {
        EXPECT_EQ(palpate_data_add_voxels(data.get(), "v", &given, nullptr), PALPATE_OK)
            << "what was refused left something behind: " << error.message;
    }
    return {code, error.message};
}

Complaint of_voxels(const std::function<void(palpate_voxels&)>& change) {
    const VoxelVolume good = test::ball_voxels();
    palpate_voxels given = in_c(good);
    change(given);
    return complaint_of([&](palpate_data* data, palpate_error* error) {
        return palpate_data_add_voxels(data, "v", &given, error);
    });
}

Complaint of_labels(const std::function<void(palpate_labels&, palpate_label&)>& change) {
    const LabelVolume good = two_halves();
    const std::vector<std::int32_t> values(good.layers[0].begin(), good.layers[0].end());
    palpate_labels given = in_c(good, values);
    auto label = sized<palpate_label>();
    label.name = "one";
    label.value = 1;
    given.labels = &label;
    given.label_count = 1;
    change(given, label);
    return complaint_of([&](palpate_data* data, palpate_error* error) {
        return palpate_data_add_labels(data, "v", &given, error);
    });
}

Complaint of_mesh(const std::function<void(palpate_mesh&)>& change) {
    TriangleMesh good = test::ball_mesh();
    palpate_mesh given = in_c(good);
    change(given);
    return complaint_of([&](palpate_data* data, palpate_error* error) {
        return palpate_data_add_mesh(data, "bone", &given, error);
    });
}

Complaint of_field(const std::function<void(palpate_scalar_field&, Ball&)>& change) {
    Ball ball;
    palpate_scalar_field given = field_of(ball);
    change(given, ball);
    const Complaint complaint = complaint_of([&](palpate_data* data, palpate_error* error) {
        return palpate_data_add_scalar_field(data, "v", &given, error);
    });
    EXPECT_EQ(ball.releases, complaint.code == PALPATE_OK ? 1 : 0);
    return complaint;
}

Complaint of_vector_field(const std::function<void(palpate_vector_field&, Ball&)>& change) {
    Ball ball;
    palpate_vector_field given = vector_field_of(ball);
    change(given, ball);
    return complaint_of([&](palpate_data* data, palpate_error* error) {
        return palpate_data_add_vector_field(data, "v", &given, error);
    });
}

void expect(const Complaint& complaint, palpate_code code, const std::string& words) {
    EXPECT_EQ(complaint.code, code) << complaint.message;
    EXPECT_THAT(complaint.message, HasSubstr(words));
}

TEST(DataInC, WrongSizesOfStructsAreBadCalls) {
    const auto wrong = [](auto& given) { given.size -= 1; };
    expect(of_voxels(wrong), PALPATE_BAD_CALL, "sizeof(palpate_voxels)");
    expect(of_labels([&](palpate_labels& l, palpate_label&) { wrong(l); }), PALPATE_BAD_CALL,
           "sizeof(palpate_labels)");
    for (const std::size_t size : {std::size_t{0}, std::size_t{23}, std::size_t{25},
                                   std::size_t{8192}, std::numeric_limits<std::size_t>::max()})
        expect(of_labels([&](palpate_labels&, palpate_label& l) { l.size = size; }),
               PALPATE_BAD_CALL, "sizeof(palpate_label)");
    expect(of_mesh(wrong), PALPATE_BAD_CALL, "sizeof(palpate_mesh)");
    expect(of_field([&](palpate_scalar_field& f, Ball&) { wrong(f); }), PALPATE_BAD_CALL,
           "sizeof(palpate_scalar_field)");
    expect(of_vector_field([&](palpate_vector_field& f, Ball&) { wrong(f); }), PALPATE_BAD_CALL,
           "sizeof(palpate_vector_field)");
}

TEST(DataInC, NullPointersAndEmptyOrTakenNamesAreBadCalls) {
    const VoxelVolume good = test::ball_voxels();
    const palpate_voxels given = in_c(good);
    const test::DataPtr data = test::no_data();
    palpate_error error = no_error();
    EXPECT_EQ(palpate_data_make(nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_voxels(nullptr, "v", &given, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_voxels(data.get(), nullptr, &given, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_voxels(data.get(), "v", nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_labels(data.get(), "v", nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_vectors(data.get(), "v", nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_mesh(data.get(), "v", nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_scalar_field(data.get(), "v", nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_data_add_vector_field(data.get(), "v", nullptr, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("NULL"));
    EXPECT_EQ(palpate_data_add_voxels(data.get(), "", &given, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("name is empty"));
    ASSERT_EQ(palpate_data_add_voxels(data.get(), "v", &given, &error), PALPATE_OK);
    EXPECT_EQ(palpate_data_add_voxels(data.get(), "v", &given, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("another name"));
    EXPECT_EQ(palpate_data_failures(nullptr, "v"), 0u);
    EXPECT_EQ(palpate_data_failures(data.get(), nullptr), 0u);
    palpate_data_free(nullptr);

    expect(of_voxels([](palpate_voxels& v) { v.values = nullptr; }), PALPATE_BAD_CALL,
           "values is NULL");
    expect(of_labels([](palpate_labels&, palpate_label& l) { l.name = nullptr; }), PALPATE_BAD_CALL,
           "labels[0].name is NULL");
    expect(of_labels([](palpate_labels& l, palpate_label&) { l.labels = nullptr; }),
           PALPATE_BAD_CALL, "labels is NULL");
    expect(of_mesh([](palpate_mesh& m) { m.vertices_m = nullptr; }), PALPATE_BAD_CALL, "NULL");
    expect(of_field([](palpate_scalar_field& f, Ball&) { f.sample = nullptr; }), PALPATE_BAD_CALL,
           "sample is NULL");
    expect(of_vector_field([](palpate_vector_field& f, Ball&) { f.sample = nullptr; }),
           PALPATE_BAD_CALL, "sample is NULL");
}

TEST(DataInC, NumbersThatCannotBeNameTheirField) {
    expect(of_voxels([](palpate_voxels& v) { --v.value_count; }), PALPATE_BAD_CALL,
           "value_count = 26999, and its voxels take 27000");
    expect(of_voxels(
               [](palpate_voxels& v) { v.value_count = std::numeric_limits<std::size_t>::max(); }),
           PALPATE_BAD_CALL, "value_count = 18446744073709551615");
    expect(of_voxels([](palpate_voxels& v) { v.voxels[1] = -30; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].voxels.size = 30 x -30 x 30 is out of range");
    expect(of_voxels([](palpate_voxels& v) { v.voxels[0] = v.voxels[1] = 2000000000; }),
           PALPATE_BAD_INPUT, "volumes[\"v\"].voxels.size");
    expect(of_voxels([](palpate_voxels& v) { v.index_to_scene[1][1] = 0.0; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].voxels.index_to_scene is singular");
    expect(of_voxels([](palpate_voxels& v) { v.index_to_scene[2][3] = kNan; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].voxels.index_to_scene is not finite");
    expect(of_labels([](palpate_labels& l, palpate_label&) { l.layer_count = -1; }),
           PALPATE_BAD_CALL, "layer_count = -1 is out of range");
    expect(of_labels([](palpate_labels& l, palpate_label&) { l.layer_count = 2; }),
           PALPATE_BAD_CALL, "value_count = 13824");
    expect(of_labels([](palpate_labels& l, palpate_label&) { l.voxels[2] = 0; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].label_volume.size");
    expect(of_labels([](palpate_labels&, palpate_label& l) { l.value = 0; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].label_volume.labels[0].value = 0 is the background");
    expect(of_labels([](palpate_labels&, palpate_label& l) { l.layer = 7; }), PALPATE_BAD_INPUT,
           "labels[0].layer = 7");
    expect(of_labels([](palpate_labels&, palpate_label& l) { l.layer = -1; }), PALPATE_BAD_CALL,
           "labels[0].layer");
    expect(of_mesh([](palpate_mesh& m) { m.triangle_count = 0; }), PALPATE_BAD_INPUT,
           "surfaces[\"bone\"].triangle_mesh.triangles is empty");
    expect(of_mesh([](palpate_mesh& m) { m.vertex_count = 10; }), PALPATE_BAD_INPUT,
           "surfaces[\"bone\"].triangle_mesh.triangles[");
    expect(
        of_mesh([](palpate_mesh& m) { m.vertex_count = std::numeric_limits<std::size_t>::max(); }),
        PALPATE_NO_MEMORY, "memory");
}

TEST(DataInC, FunctionsThatAreNotWhatTheySayAreRefused) {
    expect(of_field([](palpate_scalar_field&, Ball& b) { b.has_failed = true; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].scalar_field: its function is not finite at (");
    expect(of_field([](palpate_scalar_field&, Ball& b) { b.has_ended = true; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].scalar_field: its function has no value anywhere");
    expect(of_field([](palpate_scalar_field& f, Ball&) { f.steepest_per_m = 0.9; }),
           PALPATE_BAD_INPUT,
           "volumes[\"v\"].scalar_field: steepest_per_m = 0.9, and the gradient");
    expect(of_field([](palpate_scalar_field&, Ball& b) { b.scale = 1e-3; }), PALPATE_BAD_INPUT,
           "volumes[\"v\"].scalar_field.sample() has a slope of ");
    for (const double absurd : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()}) {
        expect(of_field([&](palpate_scalar_field& f, Ball&) { f.steepest_per_m = absurd; }),
               PALPATE_BAD_INPUT, "volumes[\"v\"].scalar_field: steepest_per_m");
        expect(of_field([&](palpate_scalar_field& f, Ball&) { f.feature_size_m = absurd; }),
               PALPATE_BAD_INPUT, "volumes[\"v\"].scalar_field: feature_size_m");
        expect(of_field([&](palpate_scalar_field& f, Ball&) {
                   f.upper_m[2] = f.lower_m[2] + std::min(absurd, 0.0);
               }),
               PALPATE_BAD_INPUT, "volumes[\"v\"].scalar_field: bounds");
        expect(of_vector_field([&](palpate_vector_field& f, Ball&) { f.feature_size_m = absurd; }),
               PALPATE_BAD_INPUT, "volumes[\"v\"].vector_field: feature_size_m");
    }
    expect(of_vector_field([](palpate_vector_field&, Ball& b) { b.has_failed = true; }),
           PALPATE_BAD_INPUT, "volumes[\"v\"].vector_field: its function is not finite at (");
}

TEST(DataInC, TheTextAndTheDataHaveToNameEachOther) {
    const VoxelVolume voxels = test::ball_voxels();
    const TriangleMesh triangles = test::ball_mesh();
    const palpate_voxels given = in_c(voxels);
    const palpate_mesh mesh = in_c(triangles);
    const test::DataPtr data = test::no_data();
    ASSERT_EQ(palpate_data_add_voxels(data.get(), "ct", &given, nullptr), PALPATE_OK);
    auto options = sized<palpate_scene_options>();
    options.data = data.get();
    const auto refusal = [&](const std::string& text) {
        palpate_error error = no_error();
        palpate_scene* scene = nullptr;
        EXPECT_EQ(palpate_scene_parse(text.c_str(), "ball.toml", &options, &scene, &error),
                  PALPATE_BAD_INPUT);
        EXPECT_EQ(scene, nullptr);
        return std::string(error.message);
    };
    EXPECT_THAT(refusal("[volume.mr]\n"), StartsWith("ball.toml:1: "));
    EXPECT_THAT(refusal(""), HasSubstr("ct"));
    EXPECT_THAT(refusal("[volume.ct]\nanalytic = \"slab\"\nthickness_mm = 3\n"),
                StartsWith("ball.toml:2: analytic"));
    ASSERT_EQ(palpate_data_add_mesh(data.get(), "bone", &mesh, nullptr), PALPATE_OK);
    EXPECT_THAT(refusal(kVoxelBall), HasSubstr("bone"));
}

TEST(DataInC, AbsurdNumbersAreNeverReadBeyondWhatTheyCount) {
    constexpr unsigned kSeed = 7;
    SCOPED_TRACE(kSeed);
    std::mt19937 random(kSeed);
    const auto one_of = [&](const auto& list) {
        return list[std::uniform_int_distribution<std::size_t>(0, list.size() - 1)(random)];
    };
    const std::vector<std::int32_t> sizes{-2147483647 - 1, -1,        0, 1, 2, 7, 8, 8, 8,
                                          65536,           2147483647};
    const std::vector<std::size_t> counts{
        0, 1, 511, 512, 512, 512, std::size_t{1} << 40, std::numeric_limits<std::size_t>::max()};
    const std::vector<double> places{0.0, 1e-3, 1e-3, 1e-3, -1e-3, 1e300, -1e-300, kNan};
    const std::vector<float> values(512, 1.0F); // what is behind it, a sanitizer watches
    int taken = 0;
    for (int i = 0; i < 3000; ++i) {
        auto given = sized<palpate_voxels>();
        const bool is_diagonal = random() % 2 == 0;
        for (int row = 0; row < 3; ++row) {
            given.voxels[row] = one_of(sizes);
            for (int column = 0; column < 4; ++column)
                given.index_to_scene[row][column] =
                    is_diagonal ? (row == column ? 1e-3 : 0.0) : one_of(places);
        }
        given.value_count = one_of(counts);
        given.values = values.data();
        const test::DataPtr data = test::no_data();
        palpate_error error = no_error();
        const palpate_code code = palpate_data_add_voxels(data.get(), "v", &given, &error);
        if (code == PALPATE_OK) {
            ++taken;
            std::size_t voxels = 1;
            for (const std::int32_t n : given.voxels)
                voxels *= static_cast<std::size_t>(n);
            ASSERT_EQ(voxels, given.value_count) << i;
        } else {
            ASSERT_NE(std::string(error.message), "") << i;
        }
    }
    EXPECT_GT(taken, 5);
}

} // namespace
} // namespace palpate
