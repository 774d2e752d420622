// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate::internal {

/// How much of a file is read.
enum class ImagePart {
    header, ///< everything but the values, which stay empty; that they are all there is checked as
            ///< far as the file's length tells
    scalar, ///< everything, but throws as require_scalar() before the values of another are read
    all
};

/// The axes along which a file gives the components of vectors and tensors.
struct ComponentAxes {
    Mat3 to_lps{1.0};          ///< as stated; a rotation or reflection but for rounding
    bool stated = false;       ///< by the file itself; else its format's convention
    std::string words = "LPS"; ///< as "the file's measurement frame"
};

/// An image as its file holds it, with one or more numbers per voxel.
struct ComponentImage {
    std::array<int, 3> size{0, 0, 0};
    int components = 1;
    std::vector<float> values;      ///< component fastest, then i; scaled where the file says so
    AffineTransform index_to_scene; ///< voxel index -> LPS, m
    std::string source_type;        ///< as "int16"
    std::string kind;   ///< what the file calls its components: NRRD kind ("list", "vector",
                        ///< "3D-symmetric-matrix" ...), NIfTI intent ("vector", "symmetric-matrix",
                        ///< "label"); empty: nothing
    ComponentAxes axes; ///< of vectors and tensors
    std::map<std::string, std::string> key_values; ///< NRRD key/value pairs ("Segment0_Name" ...)
    std::vector<std::string> warnings;
};

/// NRRD, attached or detached, with at most one axis that is no space axis (first or last). [setup]
/// Throws import_error as read_volume() does.
ComponentImage read_nrrd_image(const std::filesystem::path& file, ImagePart part = ImagePart::all);

/// NIfTI-1 of up to five dimensions: 3-D, 4-D with the components last, 5-D with time of length 1.
/// [setup] Throws import_error as read_volume() does.
ComponentImage read_nifti_image(const std::filesystem::path& file,
                                VolumeSelection::NiftiTransform transform,
                                ImagePart part = ImagePart::all);

/// The axes i, j, k without their lengths, i reversed where they are right-handed, as FSL has them
/// in NIfTI: what ComponentFrame::image_axes means. Sheared axes: the nearest rotation. [any]
Mat3 image_axes(const AffineTransform& index_to_scene);

/// The orthogonal matrix nearest to a regular one (the factor of its polar decomposition). [any]
Mat3 nearest_rotation(const Mat3& matrix);

/// MetaImage, .mha or .mhd.                                                              [setup]
/// Throws import_error as read_volume() does.
ComponentImage read_meta_image(const std::filesystem::path& file, ImagePart part = ImagePart::all);

/// The image of a file by its name: NRRD, NIfTI or MetaImage; nothing for any other ending. [setup]
/// Throws import_error as the reader does.
std::optional<ComponentImage> read_component_image(const std::filesystem::path& file,
                                                   VolumeSelection::NiftiTransform transform,
                                                   ImagePart part = ImagePart::all);

/// Throws import_error where the image has several components, saying what to do with vectors,
/// layers and time series instead. A header is enough.                                   [setup]
void require_scalar(const std::filesystem::path& file, const ComponentImage& image);

/// The image as a scalar volume; throws as require_scalar().                             [setup]
VoxelVolume as_scalar_volume(const std::filesystem::path& file, ComponentImage&& image);

} // namespace palpate::internal
