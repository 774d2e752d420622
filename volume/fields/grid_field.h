// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// A scalar field on an OpenVDB grid: trilinear value, slope of the trilinear value, gradient of
/// interpolated central differences and its derivative, all from one gather of 32 nodes
/// (numerics 3.3, contact.md 1.2); exact first roots.
///
/// Outside the nodes the field is the background, which must be free: below every level that is
/// asked for. Between the outermost nodes and the layer around them it falls to the background, so
/// a structure that the scan cuts is closed there.
class GridField final : public ScalarField {
public:
    /// Pads by two voxels of background (the gradient's stencil needs them) and moves the voxels
    /// into OpenVDB.     [setup] NaN and infinite voxels become background and are counted; a cell
    /// of nothing else has no data (valid = false). Throws std::invalid_argument on an empty
    /// volume, a background that is not finite, a singular affine.
    explicit GridField(const VoxelVolume& volume, float background);
    ~GridField() override;

    std::unique_ptr<FieldSampler> make_sampler() const override;
    Box bounds() const override;
    double feature_size_m() const noexcept override; ///< smallest spacing
    double patch_cosine() const noexcept override;   ///< 0.9 (contact.md 1.6)
    double typical_slope(double level) const override;

    const AffineTransform& index_to_scene() const noexcept; ///< node index -> scene, m
    std::size_t replaced_voxels() const noexcept;           ///< NaN or infinite ones

    /// Mesh of the level by OpenVDB, projected onto it by Newton steps, oriented towards free
    /// space: quick, complete in its components, poor in its angles; a few triangles in a thousand
    /// may be turned over by the projection. Seeds and reference for the extraction. Throws
    /// std::invalid_argument when the level is not above the background.      [setup]
    TriangleMesh preview(double level) const;

    /// The grid as .vdb (millimetres, LPS; metadata strings beside it), complete or not at all; and
    /// back.         [setup] A field read back has the same bits. Only files of write_vdb() are
    /// read; others are volumes, see read_volume(). Throw std::runtime_error naming the file.
    void write_vdb(const std::filesystem::path& file,
                   const std::map<std::string, std::string>& metadata) const;
    /// Reads what write_vdb() wrote, and its metadata.                                      [setup]
    static std::unique_ptr<GridField> read_vdb(const std::filesystem::path& file,
                                               std::map<std::string, std::string>& metadata);

private:
    struct Grid;
    explicit GridField(std::unique_ptr<Grid> grid);
    std::unique_ptr<Grid> grid_;
};

/// The field of a volume that effects sample: what no scan covers is as its smallest value.
/// [setup] Throws as GridField.
std::shared_ptr<const GridField> effect_grid(const VoxelVolume& volume);

} // namespace palpate
