// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// Reads a scalar volume: NRRD (.nrrd, detached .nhdr; raw, gzip) through ITK, NIfTI-1 (.nii,
/// .nii.gz), .vdb through OpenVDB (its only float grid, or the one named "density"; millimetres
/// LPS). Millimetres become metres, axes LPS.           [setup] Where a NIfTI's sform and qform
/// differ, the sform is taken when its code is set, with a warning that says by how much. Throws
/// std::runtime_error "FILE: what is wrong; what to do": missing, truncated, wrong size, not
/// scalar, not 3-D, singular affine.
VoxelVolume read_volume(const std::filesystem::path& file);

/// Writes a volume as .nrrd, .nii or .nii.gz (millimetres, LPS directions), float32; complete or
/// not at all.      [setup] Throws std::runtime_error naming the file.
void write_volume(const VoxelVolume& volume, const std::filesystem::path& file);

} // namespace palpate
