// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace palpate::internal {

/// What a table says of one value.
struct LabelName {
    std::string name;                                 ///< never empty
    std::optional<std::array<std::uint8_t, 3>> color; ///< sRGB
};

/// Names by value; 0, the background, may be among them.
using LabelNames = std::map<std::int32_t, LabelName>;

/// Reads a table of names in UTF-8, whatever its ending says; blank lines and those that begin with
/// '#' (but below column names) are passed over, values beyond 32 bits too. Each line is one of
/// [setup]
///     value name [numbers ...]         AAL; a name with blanks in quotes or between tabs, or with
///                                      a word after the first that is no number
///     value name r g b a               FreeSurfer, 3D Slicer's .ctbl: four numbers from 0 to 255
///     value r g b a vis mesh "name"    ITK-SNAP
///     tabs below a line of column names, with "index", "name" and perhaps "color" (#rrggbb): BIDS
/// Throws std::runtime_error "FILE:LINE: what is wrong; what to do": no value, no name, a value
/// with two names; "FILE: ..." when the file cannot be read, is too large or names nothing.
LabelNames read_label_names(const std::filesystem::path& file);

} // namespace palpate::internal
