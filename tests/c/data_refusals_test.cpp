// SPDX-License-Identifier: Apache-2.0
// What is wrong with data in memory that comes from C is refused by its name, and leaves nothing
// behind.
#include <palpate/palpate_c.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/c/c_ball.h"
#include "tests/c/c_data.h"
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
using testing::HasSubstr;
using testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const std::string kVoxelBall = "[volume.ct]\n[surface.ball]\nvolume = \"ct\"\niso_value = 500\n"
                               "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

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

TEST(DataRefusedInC, WrongSizesOfStructsAreBadCalls) {
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

TEST(DataRefusedInC, NullPointersAndEmptyOrTakenNamesAreBadCalls) {
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

TEST(DataRefusedInC, NumbersThatCannotBeNameTheirField) {
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

TEST(DataRefusedInC, FunctionsThatAreNotWhatTheySayAreRefused) {
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

TEST(DataRefusedInC, TheTextAndTheDataHaveToNameEachOther) {
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

TEST(DataRefusedInC, AbsurdNumbersAreNeverReadBeyondWhatTheyCount) {
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
