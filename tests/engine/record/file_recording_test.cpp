// SPDX-License-Identifier: Apache-2.0
// A recording of a scene of files says by hash what they held: a replay on others is refused, and
// the message names which.
#include <palpate/engine/record/recorded_run.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/memory_scenes.h"
#include "tests/support/same_reports.h"

namespace palpate {
namespace {

class FileRecording : public testing::Test {
protected:
    FileRecording() { write_volume(test::ball_voxels(), ct_); }

    /// Records a scene about the volume "ct" in a file and replays it on the same file.
    Recording record(const std::string& about, const std::string& file = "ct.nrrd") {
        const std::string text = "[volume.ct]\nfile = \"" + file + "\"\n" + about;
        const auto scene =
            std::make_shared<const Scene>(parse_scene(text, folder_ / "scene.toml"), resources_);
        const Trace trace = run_trace(scene, test::around_ball(), clock_);
        Recording recording = recorded(*scene, {}, trace);
        const Trace again = run_again(recorded_scene(recording, "run.h5", resources_), recording);
        int forces = 0;
        for (std::size_t i = 0; i < trace.frames.size(); ++i) {
            EXPECT_EQ(test::difference(again.frames[i], trace.frames[i]), "") << "frame " << i;
            forces += trace.frames[i].force != Vec3{0.0} ? 1 : 0;
        }
        EXPECT_GT(forces, 100) << "the volume is not felt";
        return recording;
    }

    /// Why the recording is not replayed; empty where it is.
    std::string refusal(const Recording& recording) const {
        try {
            recorded_scene(recording, "run.h5", resources_);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return {};
    }

    /// One voxel at the ball's middle, far from what the hand feels.
    void change_a_voxel() const {
        VoxelVolume other = test::ball_voxels();
        other.values[other.index(15, 15, 15)] += 0.5F;
        write_volume(other, ct_);
    }

    /// A recorded source of this name, which must be there.
    static std::string hash_of(const std::vector<RecordedSource>& sources,
                               const std::string& name) {
        for (const RecordedSource& source : sources)
            if (source.file == name) return source.sha256;
        ADD_FAILURE() << "no source " << name;
        return {};
    }

    test::TemporaryFolder folder_;
    const std::filesystem::path ct_ = folder_ / "ct.nrrd";
    const SceneResources resources_ = test::ball_resources();
    test::ScriptedClock clock_;
};

constexpr const char* kSurface =
    "[surface.ball]\nvolume = \"ct\"\niso_value = 500\ncontact = \"volume\"\n"
    "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

TEST_F(FileRecording, OfASurfaceRefusesAChangedVolume) {
    const Recording recording = record(kSurface);
    const std::string source = "volume and settings of surface ball";
    const std::string before = hash_of(recording.sources, source);
    change_a_voxel();
    const std::string why = refusal(recording);
    EXPECT_TRUE(why.starts_with("run.h5: " + source + " is not what it was")) << why;
    EXPECT_NE(why.find("bring back the one with SHA-256 " + before), std::string::npos) << why;
    write_volume(test::ball_voxels(), ct_);
    EXPECT_EQ(refusal(recording), "") << "the old one is back";
}

// An effect samples the volume itself; nothing is baked of it.
TEST_F(FileRecording, OfAnEffectRefusesAChangedVolume) {
    const Recording recording = record("[[effect]]\ntype = \"gradient_force\"\nvolume = \"ct\"\n"
                                       "strength_n = [[0, 0.1], [1000, 0.5]]\n");
    const std::string source = std::filesystem::absolute(ct_).string();
    const std::string before = hash_of(recording.sources, source);
    change_a_voxel();
    const std::string why = refusal(recording);
    EXPECT_TRUE(why.starts_with("run.h5: " + source + " is not what it was")) << why;
    EXPECT_NE(why.find("bring back the one with SHA-256 " + before), std::string::npos) << why;
}

// Where the voxels lie in a file of their own, the header alone says nothing of them, whatever its
// name is.
TEST_F(FileRecording, OfAnEffectRefusesChangedVoxelsBesideTheirHeader) {
    for (const char* name : {"ct.nhdr", "ct.nrrd"}) {
        SCOPED_TRACE(name);
        const VoxelVolume ball = test::ball_voxels();
        test::make_file(folder_ / name, "NRRD0005\ntype: float\ndimension: 3\nsizes: 30 30 30\n"
                                        "space: left-posterior-superior\nspace directions: (1,0,0) "
                                        "(0,1,0) (0,0,1)\nspace origin: (-14.5,-14.5,-14.5)\n"
                                        "encoding: raw\nendian: little\ndata file: ct.raw\n\n");
        std::string voxels(reinterpret_cast<const char*>(ball.values.data()),
                           ball.values.size() * sizeof(float));
        test::make_file(folder_ / "ct.raw", voxels);
        const Recording recording =
            record("[[effect]]\ntype = \"gradient_force\"\nvolume = \"ct\"\n"
                   "strength_n = [[0, 0.1], [1000, 0.5]]\n",
                   name);
        const std::string source = std::filesystem::absolute(folder_ / "ct.raw").string();
        hash_of(recording.sources, source);
        ++voxels[sizeof(float) * ball.index(15, 15, 15)];
        test::make_file(folder_ / "ct.raw", voxels);
        const std::string why = refusal(recording);
        EXPECT_TRUE(why.starts_with("run.h5: " + source + " is not what it was")) << why;
    }
}

} // namespace
} // namespace palpate
