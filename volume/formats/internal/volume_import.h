// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/voxel_volume.h>

/// What read_volume() asks of a file before it lets a library read the voxels: libraries fill what
/// is missing from a truncated file with zeros or garbage, and keep less of the header than it
/// says.
namespace palpate::internal {

/// The exception "FILE: WHAT", on one line whatever a library's message or a name found in a file
/// looked like.                                                                         [setup]
std::runtime_error import_error(const std::filesystem::path& file, const std::string& what);

/// A number for a message, of four digits.                                               [setup]
std::string short_number(double value);

/// A file's words for a message: what is not printable becomes a question mark, and the end of what
/// is longer than 60 characters three dots.                                              [setup]
std::string short_text(const std::string& text);

/// "a, b, c"; of more than eight the first ones: "a, b, ... and 3 more".                  [setup]
std::string short_list(const std::vector<std::string>& names);

/// The finite number that a text is, whole and with "." in any locale; nothing for anything else.
/// [any]
std::optional<double> parsed_number(std::string_view text) noexcept;

/// Throws import_error unless the map is finite and regular; `what` says where it comes from.
/// [setup]
void require_regular(const std::filesystem::path& file, const Mat3& linear, const Vec3& offset,
                     const std::string& what);

/// Throws import_error unless a volume of that size and place (m) is regular and one that a patient
/// can have (implausible_grid()). `what` says where the place comes from; in a text header the
/// message names the line of `keys`: those of the spacing first, those of the origin second. Comes
/// before memory is asked for.                                                           [setup]
struct HeaderKeys {
    std::vector<std::string_view> spacing; ///< in lower case, without blanks
    std::vector<std::string_view> origin;
};
void require_plausible(const std::filesystem::path& file, const std::array<int, 3>& size,
                       const AffineTransform& index_to_scene, const std::string& what,
                       const HeaderKeys& keys = {});

/// Throws import_error where `numbers` floats are more than this machine has memory for: asked for,
/// they would be given, and the program killed when it fills them.                       [setup]
void require_memory(const std::filesystem::path& file, double numbers);

/// Throws import_error unless the sizes are three (longer: trailing ones are dropped), each in
/// [1, INT_MAX], and their bytes countable. Returns them.                               [setup]
std::array<int, 3> require_three_dimensions(const std::filesystem::path& file,
                                            std::vector<std::int64_t> sizes);

/// Throws import_error when `stored_bytes` of deflated data cannot hold `bytes`: deflate never
/// shrinks by more than 1032, so this refuses absurd headers before memory is asked for. [setup]
void require_plausible_deflation(const std::filesystem::path& file, std::uint64_t stored_bytes,
                                 std::uint64_t bytes);

/// Throws import_error where a choice is not one that the file offers: it was meant for another, or
/// would have no effect.                                                                 [setup]
void require_choices(const std::filesystem::path& file, const VolumeSelection& selection);

/// Reads a scalar grid of an OpenVDB file: the one of that name, or when `name` is empty the one
/// named "density", or the only one.                                                    [setup]
VoxelVolume read_vdb_volume(const std::filesystem::path& file, const std::string& name);

/// The grids of an OpenVDB file.                                                        [setup]
std::vector<VolumeEntry> list_vdb_grids(const std::filesystem::path& file);

} // namespace palpate::internal
