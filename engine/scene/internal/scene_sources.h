// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <palpate/engine/scene/scene_reader.h>
#include <palpate/engine/scene/scene_resources.h>

namespace palpate::internal {

/// Where a scene that is being built has its fields and meshes from: formulas and what is in memory
/// are here, the rest is read from files, or baked from voxels, by whoever was handed in. All
/// [setup]; throw as SceneReader does, and std::runtime_error where nobody was handed in for that.
class SceneSources {
public:
    /// Both must outlive it.
    SceneSources(const SceneDescription& scene, const SceneResources& resources);

    BakedSurface surface(const std::string& name);
    /// `place` begins messages: "FILE:LINE: [surface.bone]".
    FoundMesh mesh(const std::string& surface, const BakedSurface& baked, ContactKind contact,
                   const std::string& place);
    /// The field of a volume of scalars. One that is not from a file is the same for all who ask.
    std::shared_ptr<const ScalarField> scalars(const std::string& volume);
    std::shared_ptr<const VectorField> vectors(const std::string& volume, VectorSense sense,
                                               std::string_view effect);
    /// Of the volumes that scalars() and vectors() gave so far.
    VolumeWarnings warnings() const;

private:
    std::shared_ptr<const ScalarField> as_it_is(const std::string& volume);
    /// The reader of files, for what is needed at a place: "reads FILE".
    SceneReader& reader(const std::string& place, std::string_view need);
    SceneReader& reader_of_volume(const std::string& volume);

    const SceneDescription& scene_;
    const SceneResources& resources_;
    std::unique_ptr<SceneReader> reader_;
    std::map<std::string, std::shared_ptr<const ScalarField>> made_;
    VolumeWarnings warnings_; ///< of volumes in memory
};

} // namespace palpate::internal
