// SPDX-License-Identifier: Apache-2.0
// A recording of a scene made in code says by hash what it needs; the program gives it again.
#include <palpate/engine/record/recorded_run.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/files/data_hash.h>
#include <palpate/engine/run/trace.h>

#include "tests/support/host_fields.h"
#include "tests/support/memory_scenes.h"
#include "tests/support/same_reports.h"

namespace palpate {
namespace {

template <class T>
std::shared_ptr<const T> shared(T data) {
    return std::make_shared<const T>(std::move(data));
}

class MemoryRecording : public testing::Test {
protected:
    /// Records a scene, writes it and reads it back.
    Recording record(const SceneDescription& description) {
        const auto scene = std::make_shared<const Scene>(description, test::ball_resources());
        trace_ = run_trace(scene, test::around_ball(), clock_);
        write_recording(file_, recorded(*scene, {}, trace_));
        return read_recording(file_);
    }

    std::string refusal(const std::function<void()>& replay) const {
        try {
            replay();
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_TRUE(message.starts_with(file_.string() + ": ")) << message;
            return message.substr(std::min(message.size(), file_.string().size() + 2));
        }
        ADD_FAILURE() << "it was accepted";
        return {};
    }

    std::string refusal(const Recording& recording, const SceneDescription& scene) const {
        return refusal([&] { recorded_scene(recording, file_, scene, test::ball_resources()); });
    }

    void expect_the_same_again(const Recording& recording, const SceneDescription& scene) {
        const Trace again =
            run_again(recorded_scene(recording, file_, scene, test::ball_resources()), recording);
        ASSERT_EQ(again.frames.size(), trace_.frames.size());
        std::size_t in_contact = 0;
        for (std::size_t i = 0; i < again.frames.size(); ++i) {
            ASSERT_EQ(test::difference(again.frames[i], trace_.frames[i]), "") << "frame " << i;
            in_contact += again.frames[i].contacts;
        }
        EXPECT_GT(in_contact, 100u);
    }

    test::TemporaryFolder folder_;
    std::filesystem::path file_ = folder_ / "recording.h5";
    test::ScriptedClock clock_;
    Trace trace_;
};

SceneDescription scene_of_voxels() {
    SceneDescription scene = test::ball_scene();
    scene.volumes["ct"].voxels = shared(test::ball_voxels());
    return scene;
}

TEST_F(MemoryRecording, OfVoxelsIsReplayedWithTheSameAndRefusesOthers) {
    SceneDescription scene = scene_of_voxels();
    const Recording recording = record(scene);
    ASSERT_FALSE(recording.sources.empty());
    EXPECT_EQ(recording.sources[0].file, "volumes[\"ct\"].voxels, 30 x 30 x 30");
    EXPECT_EQ(recording.sources[0].sha256, sha256_of_data(scene.volumes["ct"]));
    scene.volumes["ct"].voxels = shared(test::ball_voxels()); // elsewhere in memory
    expect_the_same_again(recording, scene);

    VoxelVolume other = test::ball_voxels();
    other.values[other.index(15, 15, 15)] += 0.5F;
    scene.volumes["ct"].voxels = shared(other);
    EXPECT_EQ(refusal(recording, scene),
              "volumes[\"ct\"].voxels, 30 x 30 x 30 is not what it was when this was recorded; "
              "bring back the one with SHA-256 " +
                  recording.sources[0].sha256 + " (this one has " +
                  sha256_of_data(scene.volumes["ct"]) + ")");
}

TEST_F(MemoryRecording, RefusesOtherSettingsOfItsSurfaces) {
    SceneDescription scene = scene_of_voxels();
    const Recording recording = record(scene);
    scene.surfaces["ball"].iso_value = 510.0;
    EXPECT_TRUE(
        refusal(recording, scene).starts_with("volume and settings of surface ball is not"));
}

TEST_F(MemoryRecording, OfAFieldAndAMeshOfTheProgramIsReplayed) {
    SceneDescription scene = test::ball_scene();
    scene.surfaces["ball"].iso_value = 0.0;
    scene.surfaces["ball"].triangle_mesh = shared(test::ball_mesh());
    scene.volumes["ct"].scalar_field = std::make_shared<test::HostBall>(test::kBall_m);
    const Recording recording = record(scene);
    EXPECT_EQ(recording.sources.at(0).file, "volumes[\"ct\"].scalar_field");
    scene.volumes["ct"].scalar_field = std::make_shared<test::HostBall>(test::kBall_m);
    expect_the_same_again(recording, scene);

    scene.volumes["ct"].scalar_field = std::make_shared<test::HostBall>(test::kBall_m + 1e-6);
    EXPECT_TRUE(refusal(recording, scene).starts_with("volumes[\"ct\"].scalar_field is not what"));
    scene.volumes["ct"].scalar_field = std::make_shared<test::HostBall>(test::kBall_m);
    TriangleMesh other = test::ball_mesh();
    other.vertices[3].x += 1e-9;
    scene.surfaces["ball"].triangle_mesh = shared(other);
    EXPECT_TRUE(refusal(recording, scene).starts_with("mesh of surface ball is not what it was"));
}

TEST_F(MemoryRecording, OfAFormulaMadeInCodeIsReplayed) {
    SceneDescription scene = test::ball_scene();
    scene.surfaces["ball"].iso_value = 0.0;
    scene.volumes["ct"].analytic = "solid_sphere";
    scene.volumes["ct"].parameters["radius_mm"] = 1e3 * test::kBall_m;
    expect_the_same_again(record(scene), scene);
}

TEST_F(MemoryRecording, WithoutItsProgramIsRefusedWithWhatToDo) {
    const Recording recording = record(scene_of_voxels());
    const std::string message =
        refusal([&] { recorded_scene(recording, file_, test::ball_resources()); });
    EXPECT_TRUE(message.starts_with("a program made its scene, or gave it data in memory"))
        << message;
    EXPECT_NE(message.find("recorded_scene() that takes a description"), std::string::npos);
}

TEST(DataHash, IsOfTheContentAloneAndOfAllOfIt) {
    VolumeDescription volume;
    volume.voxels = shared(test::ball_voxels());
    const std::string hash = sha256_of_data(volume);
    EXPECT_EQ(hash.size(), 64u);
    const auto changed = [](const std::function<void(VoxelVolume&)>& change) {
        VoxelVolume voxels = test::ball_voxels();
        change(voxels);
        VolumeDescription other;
        other.voxels = shared(std::move(voxels));
        return sha256_of_data(other);
    };
    EXPECT_EQ(changed([](VoxelVolume&) {}), hash);
    EXPECT_EQ(changed([](VoxelVolume& v) { v.source_type = "int16"; }), hash);
    EXPECT_EQ(changed([](VoxelVolume& v) { v.warnings = {"was read"}; }), hash);
    EXPECT_NE(changed([](VoxelVolume& v) { v.values.back() += 1.0F; }), hash);
    EXPECT_NE(changed([](VoxelVolume& v) { v.size = {900, 30, 1}; }), hash);
    EXPECT_NE(changed([](VoxelVolume& v) { v.index_to_scene.linear[2].z = -1e-3; }), hash);
    EXPECT_THROW(sha256_of_data(VolumeDescription{}), std::invalid_argument);
}

} // namespace
} // namespace palpate
