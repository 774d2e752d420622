// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/formats/internal/dicom_data_set.h>

/// What one DICOM image (a slice file, or a frame of an enhanced file) says about itself. Nothing
/// that identifies a patient is read.
namespace palpate::internal {

/// How the numbers of an image are stored (DICOM PS3.3 C.7.6.3).
struct DicomPixelFormat {
    int rows = 0;
    int columns = 0;
    int bits_allocated = 16; ///< 8, 16 or 32
    int bits_stored = 16;
    int high_bit = 15;
    bool is_signed = false;
    int frames = 1; ///< in the file

    std::size_t pixels() const noexcept {
        return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    }
    std::size_t frame_bytes() const noexcept {
        return pixels() * static_cast<std::size_t>(bits_allocated / 8);
    }
};

/// What tells images at one position apart, in the order in which it is looked at.
enum class DicomDistinction {
    stack,
    echo_time,
    temporal_position,
    trigger_time,
    b_value,
    acquisition,
    image_type
};
constexpr std::size_t kDicomDistinctions = 7;

/// The distinction in words, as "echo time".                                            [any]
const char* distinction_in_words(DicomDistinction distinction) noexcept;

struct DicomImage {
    std::filesystem::path file;
    int frame = 0; ///< within the file
    DicomPixelFormat format;
    Vec3 position{0.0};        ///< centre of the first pixel, LPS, mm
    Vec3 along_row{1.0, 0, 0}; ///< unit; columns are counted along it: i
    Vec3 along_column{0, 1.0, 0};
    double column_spacing = 1.0; ///< mm along i
    double row_spacing = 1.0;    ///< mm along j
    double slope = 1.0;          ///< value = slope * stored + intercept
    double intercept = 0.0;
    std::array<std::string, kDicomDistinctions> distinctions;
    std::size_t content = 0; ///< hash of instance UID and stored pixels: equal for copies of a file
    bool inverted = false;   ///< MONOCHROME1: large values are dark
    bool lossy = false;      ///< was compressed with loss once
    bool has_lookup = false; ///< a modality lookup table that is not applied
};

/// What makes a file unfit to be slices of a volume.
struct DicomFault {
    enum class Kind {
        none,
        no_image,   ///< sound, but nothing to look at: a report, a directory
        unsuitable, ///< a sound image that is no slice: colour, without a position
        damaged     ///< truncated, out of order, contradicts itself
    };
    Kind kind = Kind::none;
    std::string what; ///< as "is truncated: ..."; with its remedy where there is a better one than
                      ///< getting the file again
};

/// Where a frame's attributes stand: in its own functional groups, in the shared ones, or in the
/// data set itself where there are no such groups. Refers to the data set.
class DicomFrameAttributes {
public:
    /// Of the frame with that number, from 0.                                          [any]
    DicomFrameAttributes(const DicomDataSet& data, int frame);

    /// Of several frames, each must have one.                                          [any]
    bool has_own_position(int frames) const noexcept { return frames == 1 || own_ != nullptr; }

    /// Where to look for attributes of that sequence.                                  [any]
    const DicomDataSet& in(DicomTag sequence) const;

private:
    const DicomDataSet& data_;
    const DicomDataSet* shared_;
    const DicomDataSet* own_ = nullptr;
};

/// Reads position, directions and spacing of a frame into `image`, whose number of frames is
/// known. [any]
DicomFault read_dicom_place(const DicomFrameAttributes& frame, DicomImage& image);

/// Images of one file and the series they are of.
struct DicomContents {
    std::filesystem::path file;
    std::string series_uid; ///< empty: not stated, or not reached before the damage
    std::string number;
    std::string description;
    std::string modality;
    DicomFault fault;
    std::vector<DicomImage> images; ///< none where there is a fault
};

/// Reads a file's description; pixels are counted, not decoded.                         [setup]
/// Throws import_error when the file cannot be opened or does not fit into memory.
DicomContents read_dicom_contents(const std::filesystem::path& path);

/// Decodes images, one after the other; images of one file are best asked for in succession.
class DicomPixels {
public:
    DicomPixels();
    ~DicomPixels();
    DicomPixels(const DicomPixels&) = delete;
    DicomPixels& operator=(const DicomPixels&) = delete;

    /// Its values, rescaled, row by row.                                               [setup]
    /// Throws import_error when the pixels cannot be decoded.
    std::vector<float> values(const DicomImage& image);

private:
    std::filesystem::path file_;
    std::unique_ptr<DicomFile> open_; ///< the file of the last image
};

} // namespace palpate::internal
