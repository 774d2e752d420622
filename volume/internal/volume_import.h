// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <palpate/volume/voxel_volume.h>

/// What read_volume() asks of a file before it lets a library read the voxels: libraries fill what
/// is missing from a truncated file with zeros or garbage, and keep less of the header than it
/// says.
namespace palpate {

/// The exception "FILE: WHAT", on one line whatever a library's message looked like.   [setup]
std::runtime_error import_error(const std::filesystem::path& file, const std::string& what);

/// Throws import_error unless the map is finite and regular; `what` says where it comes from.
/// [setup]
void require_regular(const std::filesystem::path& file, const Mat3& linear, const Vec3& offset,
                     const std::string& what);

/// Throws import_error unless the sizes are three (longer: trailing ones are dropped), each in
/// [1, INT_MAX], and their bytes countable. Returns them.                               [setup]
std::array<int, 3> require_three_dimensions(const std::filesystem::path& file,
                                            std::vector<std::int64_t> sizes);

/// Throws import_error when `stored_bytes` of deflated data cannot hold `bytes`: deflate never
/// shrinks by more than 1032, so this refuses absurd headers before memory is asked for. [setup]
void require_plausible_deflation(const std::filesystem::path& file, std::uint64_t stored_bytes,
                                 std::uint64_t bytes);

/// Reads a NIfTI-1 volume, plain or gzipped.                                            [setup]
VoxelVolume read_nifti_volume(const std::filesystem::path& file);

/// An NRRD header as far as it matters here.
struct NrrdHeader {
    std::array<int, 3> size{0, 0, 0};
    std::string type;                  ///< as "int16"
    AffineTransform index_to_scene;    ///< LPS, m
    std::vector<std::string> warnings; ///< orientation or spacing not stated
};

/// Reads and checks the text against the length of the data, beside it or detached.     [setup]
NrrdHeader read_nrrd_header(const std::filesystem::path& file);

/// Reads a float grid of an OpenVDB file.                                               [setup]
VoxelVolume read_vdb_volume(const std::filesystem::path& file);

} // namespace palpate
