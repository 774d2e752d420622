// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <palpate/volume/volume_settings.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// Reads a scalar volume: NRRD (.nrrd, detached .nhdr; raw, gzip), NIfTI-1 (.nii, .nii.gz),
/// MetaImage (.mha, .mhd), a folder of DICOM slices, .vdb through OpenVDB (millimetres LPS).
/// Millimetres become metres, axes LPS.  [setup] Where a NIfTI's sform and qform differ, a warning
/// says by how much. Throws std::runtime_error "FILE: what is wrong; what to do": missing,
/// truncated, wrong size, not scalar, not 3-D, singular affine; several series or grids and no
/// selection (all are listed); a malformed slice (named).
VoxelVolume read_volume(const std::filesystem::path& file, const VolumeSelection& selection = {});

/// One volume of a file or folder that may hold several.
struct VolumeEntry {
    std::string selector; ///< what VolumeSelection::series or ::grid takes to choose it
    std::string text;     ///< in words: DICOM number, description, modality, slices; grid and type
    bool readable = true; ///< as a scalar volume
};

/// The series of a DICOM folder or the grids of a .vdb; one entry for any other file.   [setup]
/// Throws as read_volume() for what cannot be read at all.
std::vector<VolumeEntry> list_volumes(const std::filesystem::path& file);

/// Whether a file is of write_volume(), which marks what it writes.                        [setup]
bool is_written_volume(const std::filesystem::path& file);

/// Writes a volume as .nrrd, .nii or .nii.gz (millimetres, LPS directions), float32; complete or
/// not at all.      [setup] Throws std::runtime_error naming the file.
void write_volume(const VoxelVolume& volume, const std::filesystem::path& file);

} // namespace palpate
