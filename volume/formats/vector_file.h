// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/vector_volume.h>

namespace palpate {

/// In which axes the components of vectors or tensors are given in a file.
enum class ComponentFrame {
    as_stated, ///< NRRD: its measurement frame. Where there is none, a warning says what was taken
               ///< by convention: the axes of an NRRD's space; NIfTI of four dimensions:
               ///< image_axes; of five, and MetaImage: LPS (ITK, ANTs); NIfTI displacements (intent
               ///< 1006): RAS
    image_axes, ///< along i, j, k; against i where i, j, k are right-handed (as FSL writes them)
    lps,
    ras
};

/// True when the file's header announces several components per voxel that are a vector or a
/// symmetric tensor; three bytes of which nothing is said are colours. False for formats that hold
/// none, by their names. Of `selection` nifti_transform alone counts. [setup] Throws as
/// read_vector_volume() on an unreadable header.
bool holds_vectors(const std::filesystem::path& file, const VolumeSelection& selection = {});

/// Reads vectors (3 components) or symmetric tensors (6; 7 with a mask in NRRD; 9 when symmetric):
/// NIfTI 5-D, or 4-D with the components last; NRRD with a vector axis, first or last, and its
/// measurement frame; MetaImage with 3 channels.                                         [setup]
/// Six components are the upper triangle by rows (xx xy xz yy yz zz), or in NIfTI of intent 1005
/// the lower one (xx xy yy xz yz zz). Components are turned (not scaled) into LPS, tensors as
/// R T R^T. NaN stays NaN, and a tensor whose mask is 0 becomes NaN. Throws std::runtime_error
/// "FILE: what is wrong; what to do", as read_volume(), also where `selection` names what the file
/// has not.
VectorVolume read_vector_volume(const std::filesystem::path& file,
                                const VolumeSelection& selection = {},
                                ComponentFrame frame = ComponentFrame::as_stated);

} // namespace palpate
