// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include <palpate/volume/voxel_volume.h>

/// DICOM slices written by hand, so that malformed ones can be made as well.
namespace palpate::test {

/// How a data set is laid out in bytes.
struct DicomEncoding {
    bool explicit_vr = true;
    bool big_endian = false;
    bool undefined_lengths = false; ///< of sequences and items
};

/// Elements by tag (group << 16 | element), which a test may change before it writes them.
class DicomDataSet {
public:
    struct Element {
        std::string vr;
        std::string bytes;                  ///< little-endian
        std::vector<DicomDataSet> items;    ///< of a sequence ("SQ")
        std::vector<std::string> fragments; ///< of compressed pixels; the first: offset table
    };

    void text(std::uint32_t tag, const std::string& vr, const std::string& value);
    /// Decimal strings of at most 16 characters, as the standard demands, 10 digits or more.
    void decimals(std::uint32_t tag, std::initializer_list<double> values);
    void us(std::uint32_t tag, std::initializer_list<unsigned> values);
    void fd(std::uint32_t tag, std::initializer_list<double> values);
    void sequence(std::uint32_t tag, std::vector<DicomDataSet> items);
    void remove(std::uint32_t tag) { elements.erase(tag); }

    std::string bytes(const DicomEncoding& encoding = {}) const;

    std::map<std::uint32_t, Element> elements;
};

/// Preamble, magic number, file meta information and the data set. The transfer syntax is that of
/// the encoding unless one is given (which describes `bytes` to the reader, true or not).
std::string dicom_file(const DicomDataSet& data_set, const DicomEncoding& encoding = {},
                       const std::string& transfer_syntax = {});

/// What write_dicom_series() needs beside the volume.
struct DicomSeriesOptions {
    std::string series_uid = "1.2.826.0.1.3680043.10.54.1";
    int number = 1;
    std::string description = "generated";
    std::string modality = "CT";
    std::string prefix = "slice_"; ///< names are prefix, number of four digits, ending
    std::string ending = ".dcm";
    bool names_in_reverse = false; ///< slice 0 has the last name
    int bits_allocated = 16;       ///< 8, 16 or 32
    bool is_signed = true;
    double slope = 1.0;     ///< value = slope * stored + intercept; what is stored is rounded
    double intercept = 0.0; ///< and must fit the type
    DicomEncoding encoding;
};

/// Slice k of a volume: rows along j, columns along i, millimetres LPS. The columns of
/// index_to_scene for i and j must be perpendicular; that for k may lean (gantry tilt) and may run
/// against i x j (a reader is free to turn it back).
DicomDataSet dicom_slice(const VoxelVolume& volume, int k, const DicomSeriesOptions& options = {});

/// An enhanced file of all slices, its frames in that order of k: position and rescaling for each
/// frame, orientation and spacing shared.
DicomDataSet dicom_enhanced(const VoxelVolume& volume, const std::vector<int>& order,
                            const DicomSeriesOptions& options = {});

/// A file for each slice along k, named by number.
std::vector<std::filesystem::path> write_dicom_series(const std::filesystem::path& folder,
                                                      const VoxelVolume& volume,
                                                      const DicomSeriesOptions& options = {});

} // namespace palpate::test
