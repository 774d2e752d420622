// SPDX-License-Identifier: Apache-2.0
// Scenes of data that a program has in memory: what is refused, and what needs no palpate::files.
#include <palpate/engine/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/volume/vector_field.h>

#include "tests/support/host_fields.h"
#include "tests/support/made_labels.h"
#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadius_m = 0.02;
const AffineTransform kFrame{Mat3(1e-3), Vec3(-3.5e-3)};

VoxelVolume voxels() {
    return test::sampled({8, 8, 8}, kFrame, [](const Vec3& p) { return 1e3 * p.x; });
}

VectorVolume vectors() {
    VectorVolume volume;
    volume.size = {4, 4, 4};
    volume.index_to_scene = {Mat3(10e-3), Vec3(-15e-3)};
    for (std::size_t n = 0; n < volume.voxels(); ++n)
        volume.values.insert(volume.values.end(), {0.0F, 0.0F, 1.0F});
    return volume;
}

template <class T>
std::shared_ptr<const T> shared(T data) {
    return std::make_shared<const T>(std::move(data));
}

std::string complaint(const SceneDescription& scene) {
    try {
        Scene made(scene);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

template <class Data, class Field>
std::string complaint_of(Data data, Field VolumeDescription::*field,
                         const std::function<void(Data&)>& change) {
    change(data);
    SceneDescription scene;
    scene.volumes["v"].*field = shared(std::move(data));
    return complaint(scene);
}

std::string of_voxels(const std::function<void(VoxelVolume&)>& change) {
    return complaint_of(voxels(), &VolumeDescription::voxels, change);
}

std::string of_labels(const std::function<void(LabelVolume&)>& change) {
    LabelVolume labels = test::made_labels({4, 4, 4}, kFrame, 2, [](const Vec3& p) {
        return p.x < 1.0 ? 0 : p.x < 2.0 ? 1 : 2;
    });
    return complaint_of(std::move(labels), &VolumeDescription::label_volume, change);
}

std::string of_vectors(const std::function<void(VectorVolume&)>& change) {
    return complaint_of(vectors(), &VolumeDescription::vector_volume, change);
}

std::string of_mesh(const std::function<void(TriangleMesh&)>& change) {
    TriangleMesh mesh = test::icosphere(kRadius_m, 2);
    change(mesh);
    SceneDescription scene;
    scene.surfaces["bone"].triangle_mesh = shared(std::move(mesh));
    return complaint(scene);
}

void expect_begins(const std::string& message, const std::string& words) {
    EXPECT_TRUE(message.starts_with(words)) << message << "\n  is not " << words;
    EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
}

/// A ball made felt, and nothing else.
SceneDescription ball_of(const VolumeDescription& volume) {
    SceneDescription scene;
    scene.volumes["v"] = volume;
    scene.surfaces["ball"].volume = "v";
    scene.effects.push_back(effects::Surface{.surface = "ball"});
    return scene;
}

/// Pressed 3 mm into the ball, and along it.
std::vector<FrameReport> felt(const SceneDescription& description,
                              const SceneResources& resources = {}) {
    test::ScriptedClock clock;
    HapticLoop loop(std::make_shared<const Scene>(description, resources), clock);
    std::vector<FrameReport> frames;
    for (int i = 0; i < 300; ++i) {
        DeviceState hand;
        hand.time_s = 1e-3 * i;
        const double angle = i < 100 ? 0.0 : 2e-3 * (i - 100);
        const double radius_m = kRadius_m + 2e-3 - 5e-5 * std::min(i, 100);
        hand.position =
            radius_m * Vec3(std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle));
        frames.push_back(loop.frame(hand));
    }
    return frames;
}

TEST(SceneOfMemory, SoundDataIsTaken) {
    EXPECT_EQ(of_voxels([](VoxelVolume&) {}), "");
    EXPECT_EQ(of_voxels([](VoxelVolume& v) { v.values[3] = static_cast<float>(kNan); }), "");
    EXPECT_EQ(of_labels([](LabelVolume&) {}), "");
    EXPECT_EQ(of_vectors([](VectorVolume&) {}), "");
    EXPECT_EQ(of_mesh([](TriangleMesh&) {}), "");
    SceneDescription scene;
    scene.volumes["v"].scalar_field = std::make_shared<test::HostBall>(kRadius_m);
    scene.volumes["w"].vector_field = make_helix(0.03, 0.02);
    EXPECT_EQ(complaint(scene), "");
}

TEST(SceneOfMemory, ALabelThatNoVoxelHasIsNamedWithItsSurface) {
    LabelVolume labels = test::made_labels({4, 4, 4}, kFrame, 1, [](const Vec3&) { return 1; });
    labels.labels.push_back({"tumour", 7, 0, {}});
    SceneDescription scene;
    scene.volumes["v"].label_volume = shared(labels);
    scene.surfaces["lump"].volume = "v";
    scene.surfaces["lump"].labels = {"tumour"};
    scene.effects.push_back(effects::Surface{.surface = "lump"});
    try {
        Scene made(scene, {.files = scene_files()});
        FAIL() << "nothing is felt of it";
    } catch (const std::runtime_error& error) {
        const std::string said = error.what();
        EXPECT_NE(said.find("surfaces[\"lump\"]"), std::string::npos) << said;
        EXPECT_NE(said.find("no voxel has the label \"tumour\""), std::string::npos) << said;
    }
    match_labels_to_voxels(labels);
    EXPECT_EQ(labels.labels.size(), 1u);
}

TEST(SceneOfMemory, SizesThatDoNotMatchNameTheField) {
    expect_begins(of_voxels([](VoxelVolume& v) { v.values.pop_back(); }),
                  "volumes[\"v\"].voxels.values has 511 numbers, and size 8 x 8 x 8 takes 512");
    expect_begins(of_voxels([](VoxelVolume& v) {
                      v.size = {0, 8, 8};
                  }),
                  "volumes[\"v\"].voxels.size = 0 x 8 x 8 is out of range");
    expect_begins(of_voxels([](VoxelVolume& v) {
                      v.size = {-8, -8, 8};
                  }),
                  "volumes[\"v\"].voxels.size = -8 x -8 x 8 is out of range");
    expect_begins(of_voxels([](VoxelVolume& v) {
                      v.size = {2000000000, 2000000000, 1};
                  }),
                  "volumes[\"v\"].voxels.size = ");
    expect_begins(of_labels([](LabelVolume& v) { v.layers.clear(); }),
                  "volumes[\"v\"].label_volume.layers is empty");
    expect_begins(of_labels([](LabelVolume& v) { v.layers[0].push_back(0); }),
                  "volumes[\"v\"].label_volume.layers[0] has 65 numbers, and size 4 x 4 x 4");
    expect_begins(of_vectors([](VectorVolume& v) { v.values.pop_back(); }),
                  "volumes[\"v\"].vector_volume.values has 191 numbers, and size 4 x 4 x 4 takes "
                  "192");
    expect_begins(of_vectors([](VectorVolume& v) { v.components = 6; }),
                  "volumes[\"v\"].vector_volume.components = 6 is not of its kind");
    expect_begins(of_vectors([](VectorVolume& v) {
                      v.size = {1, 4, 16};
                  }),
                  "volumes[\"v\"].vector_volume.size = 1 x 4 x 16 is out of range");
}

TEST(SceneOfMemory, AMapThatLeadsNowhereNamesTheField) {
    const std::string field = "volumes[\"v\"].voxels";
    expect_begins(of_voxels([](VoxelVolume& v) { v.index_to_scene.linear[1] = Vec3(0.0); }),
                  field + ".index_to_scene is singular");
    expect_begins(
        of_voxels([](VoxelVolume& v) { v.index_to_scene.linear[1] = v.index_to_scene.linear[0]; }),
        field + ".index_to_scene is singular");
    expect_begins(of_voxels([](VoxelVolume& v) { v.index_to_scene.offset.y = kNan; }),
                  field + ".index_to_scene is not finite");
    expect_begins(of_voxels([](VoxelVolume& v) { v.index_to_scene.linear = Mat3(20.0); }),
                  field + " has voxels of 2e+04 x 2e+04 x 2e+04 mm");
    expect_begins(of_voxels([](VoxelVolume& v) { v.index_to_scene.offset.x = 1e6; }),
                  field + " lies up to ");
    expect_begins(of_labels([](LabelVolume& v) { v.index_to_scene.linear = Mat3(0.0); }),
                  "volumes[\"v\"].label_volume.index_to_scene is singular");
    expect_begins(of_vectors([](VectorVolume& v) { v.index_to_scene.linear = Mat3(0.0); }),
                  "volumes[\"v\"].vector_volume.index_to_scene is singular");
}

TEST(SceneOfMemory, LabelsThatNameNothingOrTwiceAreRefused) {
    const std::string field = "volumes[\"v\"].label_volume";
    expect_begins(of_labels([](LabelVolume& v) { v.labels[0].name.clear(); }),
                  field + ".labels[0].name is empty");
    expect_begins(of_labels([](LabelVolume& v) { v.labels[1].value = 0; }),
                  field + ".labels[1].value = 0 is the background's");
    expect_begins(of_labels([](LabelVolume& v) { v.labels[1].layer = 1; }),
                  field + ".labels[1].layer = 1, and there are 1 layers");
    expect_begins(of_labels([](LabelVolume& v) { v.labels[1].value = 1; }),
                  field + ".labels[1] has the value and the layer of another");
    expect_begins(of_labels([](LabelVolume& v) { v.labels.pop_back(); }),
                  field + ".layers[0] has voxels of value 2, which no label has");
    EXPECT_EQ(of_labels([](LabelVolume& v) {
                  v.labels.clear();
                  match_labels_to_voxels(v);
              }),
              "");
}

TEST(SceneOfMemory, AMeshOfNothingOrOfNowhereIsRefused) {
    const std::string field = "surfaces[\"bone\"].triangle_mesh";
    expect_begins(of_mesh([](TriangleMesh& m) { m.triangles.clear(); }),
                  field + ".triangles is empty");
    expect_begins(of_mesh([](TriangleMesh& m) { m.triangles[4][1] = 1000; }),
                  field + ".triangles[4] names vertex 1000, and there are 162");
    expect_begins(of_mesh([](TriangleMesh& m) { m.vertices[5].z = kNan; }),
                  field + ".vertices[5] is not finite");
    expect_begins(of_mesh([](TriangleMesh& m) { m.vertices[5].z = 1e6; }), field + " is ");
}

TEST(SceneOfMemory, TwoSourcesAndNoneAreRefused) {
    SceneDescription scene;
    VolumeDescription& volume = scene.volumes["v"];
    volume.voxels = nullptr;
    expect_begins(complaint(scene), "volumes[\"v\"].file and analytic are both empty, and nothing "
                                    "is in memory; give a file, a formula (analytic), or data in "
                                    "memory (voxels, ");
    volume.voxels = shared(voxels());
    volume.scalar_field = std::make_shared<test::HostBall>(kRadius_m);
    expect_begins(complaint(scene), "volumes[\"v\"].voxels and scalar_field exclude each other");
    volume.scalar_field = nullptr;
    volume.file = "head.nrrd";
    expect_begins(complaint(scene), "volumes[\"v\"].file and voxels exclude each other");
    volume.file.clear();
    volume.labels = "names.txt";
    expect_begins(complaint(scene), "volumes[\"v\"].labels is a table of names for a file");

    SceneDescription meshes;
    SurfaceDescription& surface = meshes.surfaces["s"];
    expect_begins(complaint(meshes), "surfaces[\"s\"].volume and mesh are both empty");
    surface.triangle_mesh = shared(test::icosphere(kRadius_m, 1));
    surface.mesh = "bone.ply";
    expect_begins(complaint(meshes), "surfaces[\"s\"].mesh and triangle_mesh exclude each other");
    surface.mesh.clear();
    surface.mesh_file.unit = MeshUnit::millimetre;
    expect_begins(complaint(meshes), "surfaces[\"s\"].mesh_file is how a file is to be read");
}

TEST(SceneOfMemory, DataOfTheWrongKindIsRefusedWhereItIsNamed) {
    VolumeDescription of_vectors;
    of_vectors.vector_volume = shared(vectors());
    expect_begins(complaint(ball_of(of_vectors)),
                  "surfaces[\"ball\"].volume = \"v\" is data of vectors");
    VolumeDescription of_scalars;
    of_scalars.voxels = shared(voxels());
    SceneDescription scene;
    scene.volumes["v"] = of_scalars;
    scene.effects.push_back(effects::VectorForce{"v", TransferFunction::constant(0.2)});
    expect_begins(complaint(scene), "effects[0].volume = \"v\" is data of scalars");
    SceneDescription named = ball_of(of_scalars);
    named.surfaces["ball"].labels = {"1"};
    expect_begins(complaint(named), "surfaces[\"ball\"].labels is of the voxels of volume \"v\"");
    VolumeDescription of_labels;
    of_labels.label_volume =
        shared(test::made_labels({4, 4, 4}, kFrame, 1, [](const Vec3&) { return 1; }));
    expect_begins(complaint(ball_of(of_labels)),
                  "surfaces[\"ball\"].iso_value is of the label volume \"v\"");
    VectorVolume tensors = vectors();
    tensors.kind = VectorVolume::Kind::symmetric_tensor;
    tensors.components = 6;
    tensors.values.assign(6 * tensors.voxels(), 1.0F);
    scene.volumes["v"] = {};
    scene.volumes["v"].vector_volume = shared(tensors);
    expect_begins(complaint(scene), "effects[0].volume = \"v\" is of tensors");

    VolumeDescription field;
    field.scalar_field = std::make_shared<test::HostBall>(kRadius_m);
    SceneDescription smoothed = ball_of(field);
    smoothed.surfaces["ball"].smooth_voxels = 1.0;
    expect_begins(complaint(smoothed), "surfaces[\"ball\"].smooth_voxels does not go with the "
                                       "scalar_field of volume \"v\"");
    SceneDescription guarded = ball_of(field);
    guarded.surfaces["ball"].contact = ContactKind::guarded;
    expect_begins(complaint(guarded), "surfaces[\"ball\"].contact = guarded needs a mesh, and a "
                                      "surface given by a field of the program's own");
}

TEST(SceneOfMemory, ABrokenFieldIsRefusedByItsName) {
    test::HostBall::Spoil spoil;
    spoil.slope_factor = 1e-3;
    SceneDescription scene;
    scene.volumes["v"].scalar_field = std::make_shared<test::HostBall>(kRadius_m, spoil);
    expect_begins(complaint(scene), "volumes[\"v\"].scalar_field.sample() has a slope of ");
}

TEST(SceneOfMemory, SurfacesOfVoxelsSayWhatToLink) {
    VolumeDescription volume;
    volume.voxels = shared(voxels());
    try {
        Scene made(ball_of(volume));
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what())
                        .starts_with("volumes[\"v\"]: nothing here makes surfaces of voxels: link "
                                     "palpate::files and "))
            << error.what();
    }
}

TEST(SceneOfMemory, ABallOfTheProgramIsFeltAsTheFormulaIs) {
    VolumeDescription formula;
    formula.analytic = "solid_sphere";
    formula.parameters["radius_mm"] = 1e3 * kRadius_m;
    VolumeDescription own;
    own.scalar_field = std::make_shared<test::HostBall>(kRadius_m);
    const std::vector<FrameReport> expected = felt(ball_of(formula)), found = felt(ball_of(own));
    std::size_t in_contact = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        // Two ways to compute the same root and length: within the proxy's tolerance of 0.1 um.
        ASSERT_LT(glm::length(found[i].proxy - expected[i].proxy), 1e-7) << i;
        ASSERT_EQ(found[i].contacts, expected[i].contacts) << i;
        in_contact += found[i].contacts;
    }
    EXPECT_GT(in_contact, 200u);
    EXPECT_GT(glm::length(found.back().force), 1.0);
}

TEST(SceneOfMemory, ALevelThatTheFieldNeverHasIsRefused) {
    VolumeDescription own;
    own.scalar_field = std::make_shared<test::HostBall>(kRadius_m);
    SceneDescription scene = ball_of(own);
    scene.surfaces["ball"].iso_value = 1.0;
    try {
        Scene made(scene);
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what())
                        .starts_with("surfaces[\"ball\"]: iso_value 1 is reached nowhere by "
                                     "scalar_field"))
            << error.what();
    }
}

TEST(SceneOfMemory, AMeshAloneNeedsNoReader) {
    SceneDescription scene;
    scene.surfaces["ball"].triangle_mesh = shared(test::icosphere(kRadius_m, 4));
    scene.effects.push_back(effects::Surface{.surface = "ball"});
    const Scene made(scene);
    ASSERT_EQ(made.surfaces().size(), 1u);
    EXPECT_EQ(made.surfaces()[0].contact, ContactKind::mesh);
    EXPECT_TRUE(made.surfaces()[0].mesh.from_memory);
    EXPECT_TRUE(made.surfaces()[0].mesh.warnings.empty());
    // 3 mm deep at 500 N/m; facets of 20 mm / 4^4 lie up to 30 um below the sphere.
    EXPECT_NEAR(glm::length(felt(scene).back().force), 1.5, 0.02);
}

TEST(SceneOfMemory, AMeshBesideAFieldIsGuardedAndComparedWithItsLevel) {
    VolumeDescription own;
    own.scalar_field = std::make_shared<test::HostBall>(kRadius_m);
    SceneDescription scene = ball_of(own);
    scene.surfaces["ball"].triangle_mesh = shared(test::icosphere(kRadius_m, 4));
    const Scene made(scene);
    EXPECT_EQ(made.surfaces().at(0).contact, ContactKind::guarded);
    ASSERT_TRUE(made.surfaces()[0].mesh.against_level);
    EXPECT_LT(made.surfaces()[0].mesh.against_level->centroids.p99_m, 1e-4);
    EXPECT_NEAR(glm::length(felt(scene).back().force), 1.5, 0.02);

    scene.surfaces["ball"].triangle_mesh = shared(test::icosphere(1.5 * kRadius_m, 4));
    try {
        Scene other(scene);
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what())
                        .starts_with("surfaces[\"ball\"]: triangle_mesh is not of the volume's "
                                     "level: "))
            << error.what();
    }
}

TEST(SceneOfMemory, EffectsFeelVoxelsVectorsAndFieldsWithoutAReader) {
    SceneDescription scene;
    scene.volumes["flow"].vector_volume = shared(vectors());
    scene.volumes["helix"].vector_field = make_helix(0.03, 0.02);
    scene.volumes["density"].voxels = shared(voxels());
    scene.effects = {effects::VectorForce{"flow", TransferFunction::constant(0.5)}};
    std::vector<FrameReport> frames = felt(scene);
    // A unit vector along z, 0.5 N of it, slewed in within the first frames.
    EXPECT_NEAR(frames[20].force.z, 0.0, 1e-12) << "22 mm from the middle is beyond the voxels";
    scene.volumes["flow"].vector_volume = nullptr;
    scene.volumes["flow"].vector_field = make_helix(0.03, 0.02);
    frames = felt(scene);
    // The proxy is right to 0.1 um, at 500 N/m.
    EXPECT_NEAR(glm::length(frames.back().force), 0.5, 5e-5);
    scene.effects = {effects::GradientForce{"density", TransferFunction::constant(0.2)}};
    EXPECT_NO_THROW(felt(scene));
    const auto made = std::make_shared<const Scene>(scene);
    EXPECT_TRUE(made->effect_field("density"));
    EXPECT_FALSE(made->effect_bounds("helix")) << "nothing uses it";
}

} // namespace
} // namespace palpate
