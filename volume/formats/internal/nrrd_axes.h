// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/internal/nrrd_text.h>
#include <palpate/volume/formats/internal/voxel_bytes.h>

namespace palpate::internal {

/// What an NRRD header says of its axes: three in space, and perhaps one of components.
struct NrrdAxes {
    std::array<int, 3> size{0, 0, 0}; ///< along the axes in space
    std::size_t components = 1;
    VoxelSink::Components order = VoxelSink::Components::first;
    std::string kind;               ///< of the component axis, as "vector"; empty: not stated
    AffineTransform index_to_scene; ///< LPS, m
    ComponentAxes component_axes;
    std::vector<std::string> warnings;
};

/// Throws import_error: not three axes in space, a component axis between them, several of them, a
/// space with time, singular directions.                                                [setup]
NrrdAxes read_nrrd_axes(const std::filesystem::path& file, const NrrdText& text);

} // namespace palpate::internal
