// SPDX-License-Identifier: Apache-2.0
// Data in memory is felt as the same data of a file is, to the last bit.
#include <palpate/engine/baking/baking.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/host_fields.h"
#include "tests/support/memory_scenes.h"
#include "tests/support/same_reports.h"
#include "tests/support/system_call_filter.h"

namespace palpate {
namespace {

template <class T>
std::shared_ptr<const T> shared(T data) {
    return std::make_shared<const T>(std::move(data));
}

class MemoryVolume : public testing::Test {
protected:
    MemoryVolume() {
        write_volume(test::ball_voxels(), folder_ / "ball.nrrd");
        write_volume(test::sampled({30, 30, 30}, {Mat3(1e-3), Vec3(-14.5e-3)},
                                   [](const Vec3& p) {
                                       if (glm::length(p) >= test::kBall_m) return 0.0;
                                       return p.y > 0.0 ? 3.0 : 7.0;
                                   }),
                     folder_ / "halves.nrrd");
        test::make_file(folder_ / "names.txt", "3 Left\n7 Right\n");
        write_ply(test::ball_mesh(), folder_ / "ball.ply");
        write_flow();
    }

    /// Vectors that turn from voxel to voxel.
    void write_flow() const {
        std::string bytes = "NRRD0004\ntype: float\ndimension: 4\nspace: "
                            "left-posterior-superior\nsizes: 3 30 30 30\nkinds: vector space "
                            "space space\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"
                            "space origin: (-14.5,-14.5,-14.5)\nmeasurement frame: (1,0,0) "
                            "(0,1,0) (0,0,1)\nendian: little\nencoding: raw\n\n";
        for (int n = 0; n < 3 * 30 * 30 * 30; ++n)
            test::append(bytes, static_cast<float>(std::sin(0.01 * n)));
        test::make_file(folder_ / "flow.nrrd", bytes);
    }

    /// The same scene twice: `give` gives one its files, `give_data` the other what is in them.
    void expect_same(SceneDescription scene, std::size_t least_in_contact,
                     const std::function<void(SceneDescription&)>& give,
                     const std::function<void(SceneDescription&)>& give_data) const {
        SceneDescription of_files = scene, of_memory = std::move(scene);
        give(of_files);
        give_data(of_memory);
        const auto expected_scene = std::make_shared<const Scene>(of_files, test::ball_resources());
        const auto found_scene = std::make_shared<const Scene>(of_memory, test::ball_resources());
        ASSERT_EQ(found_scene->surfaces().size(), expected_scene->surfaces().size());
        for (std::size_t i = 0; i < found_scene->surfaces().size(); ++i)
            EXPECT_EQ(found_scene->surfaces()[i].contact, expected_scene->surfaces()[i].contact);
        const auto expected = test::frames_of(expected_scene), found = test::frames_of(found_scene);
        std::size_t in_contact = 0;
        for (std::size_t i = 0; i < expected.size(); ++i) {
            ASSERT_EQ(test::difference(found[i], expected[i]), "") << "frame " << i;
            in_contact += glm::length(found[i].force) > 0.0 ? 1 : 0;
        }
        EXPECT_GE(in_contact, least_in_contact);
    }

    void give_ball_file(SceneDescription& scene) const {
        scene.volumes["ct"].file = folder_ / "ball.nrrd";
    }
    void give_ball_voxels(SceneDescription& scene) const {
        scene.volumes["ct"].voxels = shared(read_volume(folder_ / "ball.nrrd"));
    }

    test::TemporaryFolder folder_;
};

TEST_F(MemoryVolume, VoxelsAreFeltAsTheirFileIsByEachContact) {
    for (const ContactKind contact :
         {ContactKind::volume, ContactKind::guarded, ContactKind::direct}) {
        SCOPED_TRACE(static_cast<int>(contact));
        SceneDescription scene = test::ball_scene();
        SurfaceDescription& ball = scene.surfaces["ball"];
        ball.contact = contact;
        ball.smooth_voxels = 0.7;
        ball.keep = {.kind = ComponentPolicy::Kind::largest};
        ball.region_mm = Box{Vec3(-14.0), Vec3(14.2)};
        expect_same(
            scene, 200, [&](SceneDescription& s) { give_ball_file(s); },
            [&](SceneDescription& s) { give_ball_voxels(s); });
    }
}

TEST_F(MemoryVolume, WithoutAChoiceVoxelsAreGuardedByAnExtractedMesh) {
    SceneDescription scene = test::ball_scene();
    give_ball_voxels(scene);
    const Scene guarded(scene, test::ball_resources());
    EXPECT_EQ(guarded.surfaces().at(0).contact, ContactKind::guarded);
    EXPECT_FALSE(guarded.surfaces()[0].mesh.from_memory);
    const Scene volume(scene, SceneResources{.files = scene_files()});
    EXPECT_EQ(volume.surfaces().at(0).contact, ContactKind::volume);
    EXPECT_NE(baked_in_words(volume.surfaces()[0].baked).find("components of the material: 2"),
              std::string::npos);
}

TEST_F(MemoryVolume, LabelsThatAreJoinedAreFeltAsTheirFileIs) {
    SceneDescription scene;
    for (const char* name : {"Left", "Right"}) {
        scene.surfaces[name].volume = "halves";
        scene.surfaces[name].labels = {name};
        scene.surfaces[name].contact = ContactKind::volume;
        scene.effects.push_back(effects::Surface{.surface = name});
    }
    const auto give = [&](SceneDescription& s) {
        s.volumes["halves"].file = folder_ / "halves.nrrd";
        s.volumes["halves"].labels = folder_ / "names.txt";
    };
    const auto give_data = [&](SceneDescription& s) {
        s.volumes["halves"].label_volume =
            shared(read_label_volume(folder_ / "halves.nrrd", folder_ / "names.txt"));
    };
    expect_same(scene, 300, give, give_data);

    give_data(scene);
    const Scene made(scene, test::ball_resources());
    EXPECT_TRUE(made.surfaces().at(0).baked.joined);
    const LabelProbe probe(made);
    EXPECT_EQ(probe.name_at(Vec3(0.0, 5e-3, 0.0)), "Left");
    EXPECT_EQ(probe.name_at(Vec3(0.0, -5e-3, 0.0)), "Right");
    EXPECT_EQ(probe.name_at(Vec3(0.0, -13e-3, 0.0)), "");
}

TEST_F(MemoryVolume, EffectsAndStrengthsOverDataAreAsOverTheirFiles) {
    SceneDescription scene = test::ball_scene();
    SurfaceDescription& ball = scene.surfaces["ball"];
    ball.contact = ContactKind::volume;
    ball.strength_volume = "ct";
    ball.strength_over_value.nodes[0] = {0.0, 0.3};
    ball.strength_over_value.nodes[1] = {1000.0, 2.0};
    ball.strength_over_value.count = 2;
    ball.strength_n = 2.0;
    scene.effects.push_back(effects::VectorForce{"flow", TransferFunction::constant(0.2)});
    scene.effects.push_back(effects::GradientForce{"ct", TransferFunction::constant(0.1)});
    expect_same(
        scene, 300,
        [&](SceneDescription& s) {
            give_ball_file(s);
            s.volumes["flow"].file = folder_ / "flow.nrrd";
        },
        [&](SceneDescription& s) {
            give_ball_voxels(s);
            s.volumes["flow"].vector_volume = shared(read_vector_volume(folder_ / "flow.nrrd"));
        });
}

TEST_F(MemoryVolume, AMeshIsFeltAsItsFileIsAloneAndAsAGuard) {
    SceneDescription alone;
    alone.effects.push_back(effects::Surface{.surface = "ball"});
    SceneDescription guard = test::ball_scene();
    give_ball_voxels(guard);
    for (const SceneDescription& scene : {alone, guard})
        expect_same(
            scene, 300,
            [&](SceneDescription& s) { s.surfaces["ball"].mesh = folder_ / "ball.ply"; },
            [&](SceneDescription& s) {
                s.surfaces["ball"].triangle_mesh = shared(read_mesh(folder_ / "ball.ply").mesh);
            });
}

TEST_F(MemoryVolume, DevicesThatMoveByThemselvesFindItsSurface) {
    using Kind = DeviceDescription::Kind;
    SceneDescription of_field = test::ball_scene(), of_voxels = test::ball_scene(), of_mesh;
    of_field.surfaces["ball"].iso_value = 0.0;
    of_field.volumes["ct"].scalar_field = std::make_shared<test::HostBall>(test::kBall_m);
    give_ball_voxels(of_voxels);
    of_mesh.surfaces["ball"].triangle_mesh = shared(test::ball_mesh());
    of_mesh.effects.push_back(effects::Surface{.surface = "ball"});
    for (SceneDescription scene : {of_field, of_voxels, of_mesh})
        for (const Kind kind : {Kind::orbit, Kind::tour, Kind::hand}) {
            SCOPED_TRACE(static_cast<int>(kind));
            scene.device.kind = kind;
            scene.device.duration_s = 3.0;
            const auto made = std::make_shared<const Scene>(scene, test::ball_resources());
            const SceneDevice device = make_device(*made);
            test::ScriptedClock clock;
            const Trace trace = run_trace(made, device.placed(), clock, 3000);
            EXPECT_GT(std::count_if(trace.frames.begin(), trace.frames.end(),
                                    [](const FrameReport& frame) { return frame.contacts > 0; }),
                      300);
            ASSERT_EQ(trace.audits.size(), 1u);
            EXPECT_EQ(trace.audits[0].frames_inside(), 0u);
        }
}

TEST_F(MemoryVolume, TheCacheKnowsDataByItsContent) {
    SceneDescription scene = test::ball_scene();
    give_ball_voxels(scene);
    const ResultCache cache(folder_ / "cache");
    const BakedSurface first = bake_surface(scene, "ball", cache);
    EXPECT_FALSE(first.from_cache);
    give_ball_voxels(scene); // elsewhere in memory
    EXPECT_TRUE(bake_surface(scene, "ball", cache).from_cache);

    VoxelVolume other = *scene.volumes["ct"].voxels;
    other.values[other.index(10, 10, 10)] += 1.0F;
    scene.volumes["ct"].voxels = shared(other);
    const BakedSurface of_other = bake_surface(scene, "ball", cache);
    EXPECT_FALSE(of_other.from_cache) << "one voxel differs";
    EXPECT_NE(of_other.key, first.key);
    other.index_to_scene.offset.x += 1e-9;
    scene.volumes["ct"].voxels = shared(other);
    EXPECT_FALSE(bake_surface(scene, "ball", cache).from_cache) << "it lies elsewhere";
}

TEST_F(MemoryVolume, TheCacheKnowsLabelsByTheirNames) {
    SceneDescription scene;
    scene.surfaces["s"].volume = "v";
    scene.surfaces["s"].labels = {"7"};
    LabelVolume labels = read_label_volume(folder_ / "halves.nrrd");
    scene.volumes["v"].label_volume = shared(labels);
    const ResultCache cache(folder_ / "cache");
    EXPECT_FALSE(bake_surface(scene, "s", cache).from_cache);
    EXPECT_TRUE(bake_surface(scene, "s", cache).from_cache);
    labels.labels.at(1).name = "Right";
    scene.volumes["v"].label_volume = shared(labels);
    const BakedSurface named = bake_surface(scene, "s", cache);
    EXPECT_FALSE(named.from_cache);
    EXPECT_EQ(named.labels, std::vector<std::string>{"Right"});
}

TEST_F(MemoryVolume, VoxelsThatAreNamesAreNoIsosurface) {
    SceneDescription scene = test::ball_scene();
    VoxelVolume names = read_volume(folder_ / "halves.nrrd");
    scene.volumes["ct"].voxels = shared(names);
    scene.surfaces["ball"].iso_value = 5.0;
    try {
        bake_surface(scene, "ball", ResultCache{});
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what())
                        .starts_with("surfaces[\"ball\"]: iso_value 5 is of the label map in "
                                     "memory, whose values are names"))
            << error.what();
    }
}

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
/// Builds and feels a scene; then again, when there is no file any more. Ends the process: 0 where
/// both are the same.
void build_without_files(const SceneDescription& scene) {
    const auto expected =
        test::frames_of(std::make_shared<const Scene>(scene, test::ball_resources()));
    if (!test::hide_files()) _exit(77);
    try {
        const auto found =
            test::frames_of(std::make_shared<const Scene>(scene, test::ball_resources()));
        bool same = true;
        for (std::size_t i = 0; i < found.size(); ++i)
            same = same && test::difference(found[i], expected[i]).empty();
        _exit(same ? 0 : 1);
    } catch (const std::runtime_error&) {
        _exit(2);
    }
}

TEST_F(MemoryVolume, WithoutACacheItNeedsNoFileAndLeavesNone) {
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    SceneDescription scene = test::ball_scene();
    give_ball_voxels(scene);
    scene.surfaces["ball"].smooth_voxels = 0.7;
    scene.surfaces["left"].volume = "halves";
    scene.surfaces["left"].labels = {"3"};
    scene.volumes["halves"].label_volume = shared(read_label_volume(folder_ / "halves.nrrd"));
    scene.volumes["flow"].vector_volume = shared(read_vector_volume(folder_ / "flow.nrrd"));
    scene.effects.push_back(effects::Surface{.surface = "left"});
    scene.effects.push_back(effects::VectorForce{"flow", TransferFunction::constant(0.2)});
    EXPECT_EXIT(build_without_files(scene), testing::ExitedWithCode(0), "");
    // That files are hidden, indeed: the same scene of a file.
    give_ball_file(scene);
    scene.volumes["ct"].voxels = nullptr;
    EXPECT_EXIT(build_without_files(scene), testing::ExitedWithCode(2), "");
}
#endif

} // namespace
} // namespace palpate
