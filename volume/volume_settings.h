// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace palpate {

/// Which volume of a file or folder that holds several, and how its geometry is to be read.
struct VolumeSelection {
    /// What to do with a DICOM series whose slices are not all sound or not evenly spaced.
    enum class Slices {
        refuse, ///< an error that names the slice
        repair  ///< malformed slices are left out; gaps and uneven spacing are filled by linear
                ///< interpolation between neighbours; each said in a warning
    };
    /// Which of a NIfTI file's two transforms places it.
    enum class NiftiTransform {
        automatic, ///< sform where its code is set, else qform; a warning where they disagree
        sform,
        qform
    };

    std::string series = {}; ///< DICOM folder: a series' number, description or instance UID;
                             ///< empty: the only one
    std::string grid = {};   ///< .vdb: name of a grid; empty: "density", or the only one
    Slices slices = Slices::refuse;                             ///< of a DICOM series
    NiftiTransform nifti_transform = NiftiTransform::automatic; ///< of a NIfTI file
    std::filesystem::path reference = {}; ///< DICOM structure set: the image whose grid its
                                          ///< contours were drawn on; series, grid, slices and
                                          ///< nifti_transform are then of that image
};

/// Which connected parts of the material stay.
struct ComponentPolicy {
    /// All of them; the largest; the `count` largest; those above `volume_mm3`.
    enum class Kind { all, largest, count, volume };
    Kind kind = Kind::all;   ///< decides which of the settings below counts
    std::size_t count = 1;   ///< kind count: this many largest stay, >= 1
    double volume_mm3 = 0.0; ///< kind volume: those larger than this stay, >= 0
};

} // namespace palpate
