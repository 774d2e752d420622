// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <palpate/volume/formats/internal/dicom_image.h>
#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate::internal {

/// A file that cannot be slices, and why.
struct DicomFaultyFile {
    std::filesystem::path file;
    DicomFault fault;
};

/// Images of one series that can be one volume: of one orientation, one pixel grid, one echo ...
struct DicomSeries {
    std::string uid;
    std::string number;
    std::string description;
    std::string modality;
    std::string selector; ///< number, or uid where numbers are not unique; with "/2" for a part
    std::string part;     ///< what tells it from other parts of the series, as "echo time 92"
    std::vector<DicomImage> images;      ///< in no order
    std::vector<DicomFaultyFile> faulty; ///< further files of the series
    std::size_t copies = 0;              ///< files that were left out for being copies

    bool is_volume() const noexcept { return images.size() > 1; }
    std::string text() const; ///< in words, without the selector                          [any]
};

/// What a folder holds.
struct DicomFolder {
    std::vector<DicomSeries> series;     ///< by number
    std::vector<DicomFaultyFile> faulty; ///< files whose series is not known
};

/// Reads the files of a folder (not its sub-folders) that are DICOM by ending, magic number or
/// look, or a single file, and sorts the images.                                        [setup]
/// Throws import_error when the folder cannot be read.
DicomFolder find_dicom_series(const std::filesystem::path& path);

/// Stacks the slices of a series into a volume; `folder` is named in errors that concern no single
/// file. [setup] Throws import_error.
VoxelVolume stack_slices(const std::filesystem::path& folder, const DicomSeries& series,
                         VolumeSelection::Slices policy);

/// The error of a file that is no slice, with what helps.                               [setup]
std::runtime_error fault_error(const DicomFaultyFile& faulty);

/// True for a file that is DICOM by its ending (.dcm, .ima) or its magic number.        [setup]
bool is_dicom_file(const std::filesystem::path& file);

/// True where a folder's reader looks into a file: its ending, magic number or look is of DICOM.
/// [setup]
bool may_be_dicom(const std::filesystem::path& file);

/// Reads the series of a folder, or of an enhanced file, that `selection` chooses.      [setup]
/// Throws import_error as read_volume() does.
VoxelVolume read_dicom_volume(const std::filesystem::path& path, const VolumeSelection& selection);

/// The series of a folder or an enhanced file.                                          [setup]
/// Throws import_error when there is none.
std::vector<VolumeEntry> list_dicom_series(const std::filesystem::path& path);

} // namespace palpate::internal
