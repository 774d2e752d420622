// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <palpate/volume/vector_field.h>
#include <palpate/volume/vector_volume.h>

namespace palpate {

/// Whether v and -v are the same.
enum class VectorSense {
    directed, ///< velocities, gradients: interpolated component by component
    axial,    ///< fibres: interpolated as v v^T, so that no sign in the image matters
};

/// A vector field on a dense grid, trilinear between its voxels; no data outside of them and in
/// cells with a corner that is not finite.
///
/// Vectors with a sense are interpolated as they are; value and derivative are in the image's unit.
/// Axial ones and tensors are interpolated as tensors, of which the principal direction is taken:
/// the value's length is then the root of the mean squared length of the vectors (axial), or the
/// fractional anisotropy in [0, 1] (tensors). Where no direction stands out, there is no data.
class GridVectorField final : public VectorField {
public:
    /// Throws std::invalid_argument on fewer than two voxels along an axis, on a number of values
    /// that does not fit, on a singular affine, and on tensors that are to be directed.   [setup]
    GridVectorField(const VectorVolume& volume, VectorSense sense);

    std::unique_ptr<VectorSampler> make_sampler() const override;
    Box bounds() const override;
    double feature_size_m() const noexcept override; ///< smallest spacing

private:
    friend class GridVectorSampler;
    enum class Kind { directed, axial, tensor };

    Kind kind_;
    std::array<int, 3> size_;
    int components_;            // of a voxel: 3, or 6 (xx, xy, xz, yy, yz, zz)
    std::vector<float> values_; // component fastest, then i
    AffineTransform index_to_scene_;
    AffineTransform scene_to_index_;
};

} // namespace palpate
