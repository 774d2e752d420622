// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/scene_files.h>

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/baking/internal/baked_field.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/formats/vector_file.h>

namespace palpate {
namespace {

class Reader final : public SceneReader {
public:
    Reader(const SceneDescription& scene, const ResultCache& cache, IsosurfaceExtractor extract,
           Progress progress)
        : scene_(scene), volumes_(scene), cache_(cache), extract_(std::move(extract)),
          progress_(std::move(progress)) {}

    BakedSurface surface(const std::string& name) override {
        return bake_surface(scene_, name, volumes_, cache_, progress_);
    }

    FoundMesh mesh(const std::string& surface, const BakedSurface& baked, ContactKind contact,
                   const std::string& place) override {
        const SurfaceDescription& description = scene_.surfaces.at(surface);
        if (!description.mesh.empty()) {
            MeshFile file = read_mesh(description.mesh, description.mesh_file);
            FoundMesh found;
            found.file = description.mesh;
            found.warnings = std::move(file.warnings);
            found.mesh = std::make_shared<TriangleMesh>(std::move(file.mesh));
            examine_mesh(found, description, baked, contact, place);
            return found;
        }
        try {
            BakedMesh extracted =
                mesh_surface(baked, mesh_settings(description, baked), extract_, cache_, progress_);
            FoundMesh found;
            found.mesh = std::move(extracted.mesh);
            found.from_cache = extracted.from_cache;
            return found;
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(fmt::format("{}: {}", place, error.what()));
        }
    }

    std::shared_ptr<const ScalarField> scalars(const std::string& volume) override {
        const VoxelVolume& voxels = volumes_.volume(volume);
        internal::require_no_names(scene_.volumes.at(volume), voxels,
                                   place_of_volume(scene_, volume));
        warnings_[volume] = voxels.warnings;
        return effect_grid(voxels);
    }

    std::shared_ptr<const VectorField> vectors(const std::string& volume, VectorSense sense,
                                               std::string_view effect) override {
        try {
            const VectorVolume vectors = vectors_of(volume, sense, effect);
            warnings_[volume] = vectors.warnings;
            return std::make_shared<GridVectorField>(vectors, sense);
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(
                fmt::format("{}: {}", place_of_volume(scene_, volume), error.what()));
        }
    }

    const VolumeWarnings& warnings() const noexcept override { return warnings_; }

private:
    VectorVolume vectors_of(const std::string& volume, VectorSense sense,
                            std::string_view effect) const {
        const VolumeDescription& source = scene_.volumes.at(volume);
        if (!holds_vectors(source.file, source.selection))
            throw std::runtime_error(fmt::format(
                "{} holds no vectors, which {} needs; name a volume of vectors or tensors",
                source.file.string(), effect));
        VectorVolume vectors = read_vector_volume(source.file, source.selection);
        if (vectors.kind == VectorVolume::Kind::symmetric_tensor && sense == VectorSense::directed)
            throw std::runtime_error(fmt::format(
                "{} holds tensors, whose directions have no sign, and {} needs one; take "
                "fibre_follow, or name a volume of vectors",
                source.file.string(), effect));
        return vectors;
    }

    const SceneDescription& scene_;
    VolumeReader volumes_;
    const ResultCache& cache_;
    IsosurfaceExtractor extract_;
    Progress progress_;
    VolumeWarnings warnings_; ///< of effects' volumes
};

class Files final : public SceneFiles {
public:
    explicit Files(ResultCache cache) : cache_(std::move(cache)) {}

    std::unique_ptr<SceneReader> reader(const SceneDescription& scene,
                                        const IsosurfaceExtractor& extract,
                                        const Progress& progress) const override {
        return std::make_unique<Reader>(scene, cache_, extract, progress);
    }
    std::vector<DeviceState> recorded_inputs(const std::filesystem::path& file,
                                             const std::string& hand) const override {
        return read_recording(file, hand).inputs;
    }

private:
    ResultCache cache_;
};

} // namespace

std::shared_ptr<const SceneFiles> scene_files(ResultCache cache) {
    return std::make_shared<Files>(std::move(cache));
}

} // namespace palpate
