// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/segmentation.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/printable.h>

// Keys of a header: slicer.readthedocs.io, Developer guide, Segmentations.
namespace palpate::internal {
namespace {

constexpr float kUnsafe = 16777216.0F; // 2^24: from here on 2^24 + 1 reads as 2^24

/// A segment as the header describes it.
struct Segment {
    std::string name;
    std::int32_t value = 1;
    std::size_t layer = 0;
    std::optional<std::array<std::uint8_t, 3>> color;
};

std::string place_of(const std::array<int, 3>& size, std::size_t voxel) {
    const auto width = static_cast<std::size_t>(size[0]);
    const auto height = static_cast<std::size_t>(size[1]);
    return std::to_string(voxel % width) + "," + std::to_string(voxel / width % height) + "," +
           std::to_string(voxel / (width * height));
}

std::optional<std::int64_t> integer(const std::string& text) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

/// "red green blue" from 0 to 1; nothing where it is something else, as a colour is not worth a
/// refusal.
std::optional<std::array<std::uint8_t, 3>> color_of(const std::string& text) {
    std::istringstream input(text);
    std::array<std::uint8_t, 3> color{};
    for (std::uint8_t& channel : color) {
        double share = -1.0;
        if (!(input >> share) || !(share >= 0.0 && share <= 1.0)) return std::nullopt;
        channel = static_cast<std::uint8_t>(std::lround(255.0 * share));
    }
    return color;
}

/// Keys of one segment: "Name", "LabelValue" ...
using SegmentKeys = std::map<std::string, std::string>;

/// By the number in "Segment12_Name".
std::map<std::int64_t, SegmentKeys> segment_keys(const ComponentImage& image) {
    constexpr std::string_view kPrefix = "Segment";
    constexpr std::int64_t kMostSegments = 1'000'000'000; // other keys are no segment's
    std::map<std::int64_t, SegmentKeys> segments;
    for (const auto& [key, value] : image.key_values) {
        const auto end = key.find('_');
        if (!key.starts_with(kPrefix) || end == std::string::npos) continue;
        const auto number = integer(key.substr(kPrefix.size(), end - kPrefix.size()));
        if (number && *number >= 0 && *number < kMostSegments)
            segments[*number][key.substr(end + 1)] = value;
    }
    return segments;
}

std::string value_or(const SegmentKeys& keys, const char* key, std::string otherwise) {
    const auto found = keys.find(key);
    if (found != keys.end()) return found->second;
    return otherwise;
}

[[noreturn]] void refuse(const std::filesystem::path& file, std::int64_t segment,
                         const std::string& what) {
    throw import_error(file, "Segment" + std::to_string(segment) + " of its header " + what +
                                 "; correct the header");
}

/// A number that the header states for a segment, in [first, last].
std::int64_t stated(const std::filesystem::path& file, std::int64_t segment,
                    const std::string& text, const char* what, std::int64_t first,
                    std::int64_t last) {
    const auto value = integer(text);
    if (!value || *value < first || *value > last)
        refuse(file, segment,
               std::string("has the ") + what + " \"" + printable(text.substr(0, 40)) +
                   "\", which is no whole number from " + std::to_string(first) + " to " +
                   std::to_string(last));
    return *value;
}

/// Where neither value nor layer is stated, as in files of before 2020, each segment has the layer
/// of its number and the value 1; in a file of one layer, its number + 1 as value.
Segment described(const std::filesystem::path& file, std::int64_t number, const SegmentKeys& keys,
                  int layers) {
    Segment segment;
    segment.name = printable(value_or(keys, "Name", value_or(keys, "ID", {})));
    segment.color = color_of(value_or(keys, "Color", {}));
    const std::string value =
        value_or(keys, "LabelValue", layers > 1 ? "1" : std::to_string(number + 1));
    const std::string layer = value_or(keys, "Layer", layers > 1 ? std::to_string(number) : "0");
    segment.value = static_cast<std::int32_t>(
        stated(file, number, value, "label value", 1, static_cast<std::int64_t>(kUnsafe) - 1));
    segment.layer = static_cast<std::size_t>(stated(file, number, layer, "layer", 0, layers - 1));
    if (segment.name.empty()) segment.name = std::to_string(segment.value);
    return segment;
}

using LayerAndValue = std::pair<std::size_t, std::int32_t>;

std::map<LayerAndValue, Segment> described_segments(const std::filesystem::path& file,
                                                    const ComponentImage& image) {
    std::map<LayerAndValue, Segment> segments;
    for (const auto& [number, keys] : segment_keys(image)) {
        const Segment segment = described(file, number, keys, image.components);
        const auto [place, is_new] = segments.try_emplace({segment.layer, segment.value}, segment);
        if (!is_new)
            refuse(file, number,
                   "has value " + std::to_string(segment.value) + " of layer " +
                       std::to_string(segment.layer) + ", as has \"" + place->second.name + "\"");
    }
    return segments;
}

void refuse_fractional(const std::filesystem::path& file, const ComponentImage& image) {
    for (const char* key :
         {"Segmentation_SourceRepresentation", "Segmentation_MasterRepresentation"}) {
        const auto found = image.key_values.find(key);
        if (found != image.key_values.end() && found->second == "Fractional labelmap")
            throw import_error(file,
                               "holds shares of segments (a fractional labelmap), not labels; "
                               "save it as a binary labelmap");
    }
}

/// Segments without voxels, and voxels without a segment.
void warn_of_segments(LabelVolume& volume, std::map<LayerAndValue, Segment> segments) {
    std::vector<std::string> unnamed;
    for (const Label& label : volume.labels)
        if (segments.erase({label.layer, label.value}) == 0)
            unnamed.push_back(std::to_string(label.value) + " in layer " +
                              std::to_string(label.layer));
    std::vector<std::string> empty;
    empty.reserve(segments.size());
    for (const auto& [place, segment] : segments)
        empty.push_back(segment.name);
    if (!empty.empty())
        volume.warnings.push_back("segments without voxels are left out: " + short_list(empty));
    if (!unnamed.empty())
        volume.warnings.push_back("values that no segment describes: " + short_list(unnamed));
}

} // namespace

std::vector<std::int32_t> whole_numbers(const std::filesystem::path& file,
                                        const std::array<int, 3>& size,
                                        std::span<const float> values, std::size_t component,
                                        std::size_t components) {
    std::vector<std::int32_t> result(values.size() / components);
    for (std::size_t voxel = 0; voxel < result.size(); ++voxel) {
        const float value = values[component + components * voxel];
        if (std::abs(value) < kUnsafe && value == std::trunc(value)) {
            result[voxel] = static_cast<std::int32_t>(value);
            continue;
        }
        std::ostringstream text;
        text << "has the value " << value << " at voxel " << place_of(size, voxel);
        throw import_error(file, text.str() +
                                     (std::abs(value) >= kUnsafe && std::isfinite(value)
                                          ? ", beyond the labels that can be read; renumber them "
                                            "below 16777216"
                                          : ", which is no whole number: it is no label volume; "
                                            "name another file, or use an iso value"));
    }
    return result;
}

void add_labels(LabelVolume& volume, std::size_t layer, const LabelNames& names) {
    const VoxelNumbers<std::int32_t>& values = volume.layers[layer];
    if (values.empty()) return;
    const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
    std::vector<bool> occurs(static_cast<std::size_t>(*highest - *lowest) + 1); // < 2^25
    for (const std::int32_t value : values)
        occurs[static_cast<std::size_t>(value - *lowest)] = true;

    for (std::size_t n = 0; n < occurs.size(); ++n) {
        if (!occurs[n]) continue;
        Label label;
        label.value = *lowest + static_cast<std::int32_t>(n);
        label.layer = layer;
        if (label.value == 0) continue;
        label.name = std::to_string(label.value);
        if (const auto named = names.find(label.value); named != names.end()) {
            label.name = named->second.name;
            label.color = named->second.color;
        }
        volume.labels.push_back(std::move(label));
    }
    if (*lowest < 0)
        volume.warnings.push_back("has negative values, from " + std::to_string(*lowest) +
                                  " on, which are taken for labels as well");
}

bool is_segmentation(const ComponentImage& image) {
    return image.components > 1 ? image.kind == "list" || !segment_keys(image).empty()
                                : !segment_keys(image).empty();
}

LabelVolume read_segmentation(const std::filesystem::path& file, ComponentImage&& image,
                              const LabelNames& names) {
    refuse_fractional(file, image);
    const auto segments = described_segments(file, image);
    LabelVolume volume;
    volume.size = image.size;
    volume.index_to_scene = image.index_to_scene;
    volume.source_type = std::move(image.source_type);
    volume.warnings = std::move(image.warnings);
    const auto components = static_cast<std::size_t>(image.components);
    for (std::size_t layer = 0; layer < components; ++layer) {
        volume.layers.push_back(whole_numbers(file, image.size, image.values, layer, components));
        LabelNames of_layer = names;
        for (const auto& [place, segment] : segments)
            if (place.first == layer)
                of_layer.try_emplace(segment.value, LabelName{segment.name, segment.color});
        add_labels(volume, layer, of_layer);
    }
    warn_of_segments(volume, segments);
    return volume;
}

} // namespace palpate::internal
