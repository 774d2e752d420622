// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <palpate/geometry/rigid_pose.h>
#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/vector_volume.h>
#include <palpate/volume/voxel_volume.h>

/// Random scenes with the paths of a probe: how they are made (SceneMaker, make_path), what must
/// hold in every frame of them (Watch), how a failure is made small (shrink) and how it is kept
/// (write_case). docs/stability.md says what is claimed with them.
namespace palpate::stability {

/// A table of a scene file, as it is written: any key may be dropped, any number rounded.
struct SceneTable {
    std::string header;                                    ///< "[surface.a]", "[[effect]]"
    std::vector<std::pair<std::string, std::string>> keys; ///< name, value as TOML spells it
    int id = 0; ///< of this table among those of its case: events name it

    bool is_effect() const { return header == "[[effect]]"; }
    /// "a" of "[surface.a]"; empty where the header has no name.
    std::string name() const;
    /// The value of a key as it is written; empty where there is none.
    std::string value(const std::string& key) const;
};

/// A voxel file of a case.
struct VoxelFile {
    std::shared_ptr<const VoxelVolume> volume;
    bool labels = false; ///< written as whole numbers
};

/// What a program does between two frames.
struct CaseEvent {
    enum class Kind {
        gain,  ///< set_gain() of an effect
        pose,  ///< set_pose() of a surface
        detour ///< the twin saves its state, runs elsewhere and restores it
    };
    int frame = 0; ///< before this one
    Kind kind = Kind::detour;
    int table = -1;    ///< SceneTable::id of the effect or the surface
    double gain = 1.0; ///< [0, 10]
    RigidPose pose;
};

/// A place of the probe, and whether a trial begins with it.
struct CaseStep {
    Vec3 probe{0.0}; ///< m
    bool begins_trial = false;
};

/// A scene, its files, and what happens to it, frame by frame.
struct RandomCase {
    std::uint64_t seed = 0;
    std::vector<SceneTable> tables;
    std::map<std::string, std::shared_ptr<const TriangleMesh>> meshes;  ///< by file name; m
    std::map<std::string, VoxelFile> volumes;                           ///< by file name
    std::map<std::string, std::shared_ptr<const VectorVolume>> vectors; ///< by file name
    std::vector<CaseStep> steps;
    std::vector<CaseStep> second_steps; ///< of a second hand, as many; empty: there is none
    std::vector<CaseEvent> events;
    double size_m = 0.01; ///< of its bodies, about
    Vec3 place{0.0};      ///< where they lie, m
};

/// The scene file of a case, with a device that reads path.csv; of two hands, one more that reads
/// second.csv.
std::string scene_text(const RandomCase& of);

/// Writes a case into a folder: scene.toml, the paths, events.csv and its data.
/// `palpate trace FOLDER/scene.toml` runs all of it but the events;
/// `palpate_stability --replay FOLDER` all of it, with the invariants.
void write_case(const RandomCase& of, const std::filesystem::path& folder);

/// What events.csv says: an event whose table is an index of Scene::description().effects or the
/// name of a surface.
struct FileEvent {
    CaseEvent event;
    std::size_t effect = 0; ///< gain: index of the effect
    std::string surface;    ///< pose: name of the surface
};
std::vector<FileEvent> read_events(const std::filesystem::path& file);
std::vector<CaseStep> read_steps(const std::filesystem::path& file);

} // namespace palpate::stability
