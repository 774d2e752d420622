// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/surface_mesh.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/fields/grid_vector_field.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// Reads what one scene has in files, and bakes voxels of files and of memory, while that scene is
/// built: each file is read once. All [setup]; all throw std::runtime_error "FILE[:LINE]: what is
/// wrong; what to do".
class SceneReader {
public:
    virtual ~SceneReader() = default;

    /// A surface of a volume that is a file or voxels in memory: its field, made ready.
    virtual BakedSurface surface(const std::string& name) = 0;
    /// The mesh of a surface, from its file or extracted from the field that was made ready.
    /// `place` begins messages about the scene: "FILE:LINE: [surface.bone]".
    virtual FoundMesh mesh(const std::string& surface, const BakedSurface& baked,
                           ContactKind contact, const std::string& place) = 0;
    /// The field of a volume of scalars that is a file.
    virtual std::shared_ptr<const ScalarField> scalars(const std::string& volume) = 0;
    /// The field of a volume of vectors that is a file; `effect` is who needs it, for messages.
    virtual std::shared_ptr<const VectorField> vectors(const std::string& volume, VectorSense sense,
                                                       std::string_view effect) = 0;
    /// Of the volumes that scalars() and vectors() have read.
    virtual const VolumeWarnings& warnings() const noexcept = 0;
};

/// What reads the files of scenes: scene_files() of palpate::files. The run time itself links none
/// of the libraries that this takes.
class SceneFiles {
public:
    virtual ~SceneFiles() = default;

    /// A reader for one scene, which must outlive it. `extract` may be empty.          [setup]
    virtual std::unique_ptr<SceneReader> reader(const SceneDescription& scene,
                                                const IsosurfaceExtractor& extract,
                                                const Progress& progress) const = 0;
    /// What a device said in a recording, scene frame; of several hands that of `hand`, else empty.
    /// [setup] Throws std::runtime_error "FILE: what is wrong; what to do".
    virtual std::vector<DeviceState> recorded_inputs(const std::filesystem::path& file,
                                                     const std::string& hand) const = 0;
};

/// Throws std::runtime_error where there is nothing that reads files and bakes voxels: `place` has
/// this `need` ("reads skull.nrrd"), and what to link and to pass. [setup]
const SceneFiles& require_files(const SceneFiles* files, const std::string& place,
                                std::string_view need);

} // namespace palpate
