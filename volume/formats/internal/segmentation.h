// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/internal/label_names.h>
#include <palpate/volume/label_volume.h>

namespace palpate::internal {

/// One of the interleaved components of an image of that size, as integers.              [setup]
/// Throws import_error at a value that is not finite, no whole number, or 2^24 and beyond, where
/// floats no longer tell all of them apart.
std::vector<std::int32_t> whole_numbers(const std::filesystem::path& file,
                                        const std::array<int, 3>& size,
                                        std::span<const float> values, std::size_t component = 0,
                                        std::size_t components = 1);

/// Appends a Label for every value but 0 that occurs in `layer`, by value, named by the table or
/// else by its digits. [setup]
void add_labels(LabelVolume& volume, std::size_t layer, const LabelNames& names);

/// True when the header describes segments, or the image has layers ("list").             [any]
bool is_segmentation(const ComponentImage& image);

/// A segmentation as 3D Slicer writes it: one layer, or several as components. What `names` says
/// goes before what the header says.                                                     [setup]
/// Throws import_error as whole_numbers(); a segment whose number, value or layer cannot be, or
/// that shares both with another; a fractional one.
LabelVolume read_segmentation(const std::filesystem::path& file, ComponentImage&& image,
                              const LabelNames& names);

} // namespace palpate::internal
