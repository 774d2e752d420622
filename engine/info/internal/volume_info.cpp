// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/internal/file_info_kinds.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/picture/internal/principal_direction.h>
#include <palpate/engine/picture/overview_picture.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/vector_volume.h>

namespace palpate::internal {
namespace {

using nlohmann::json;
using Picture = FileInfoSettings::Picture;

// --- What all images have

struct Image {
    std::array<int, 3> size;
    AffineTransform index_to_scene;
    std::string type;
    std::size_t bytes; ///< in memory
    const std::vector<std::string>& warnings;
};

/// Size and place without voxels, for functions that ask for no more.
VoxelVolume frame_of(const Image& image) {
    VoxelVolume frame;
    frame.size = image.size;
    frame.index_to_scene = image.index_to_scene;
    return frame;
}

json millimetres(const Vec3& m) { return {1e3 * m.x, 1e3 * m.y, 1e3 * m.z}; }
json millimetres(const Box& m) { return {millimetres(m.lower), millimetres(m.upper)}; }

/// Rows of the matrix whose columns are the directions of i, j, k.
json direction_rows(const AffineTransform& index_to_scene) {
    json rows = json::array();
    for (int row = 0; row < 3; ++row) {
        json line = json::array();
        for (int column = 0; column < 3; ++column)
            line.push_back(glm::normalize(index_to_scene.linear[column])[row] + 0.0); // no -0
        rows.push_back(line);
    }
    return rows;
}

json image_document(const char* kind, const Image& image) {
    const VoxelVolume frame = frame_of(image);
    return {{"kind", kind},
            {"size", image.size},
            {"spacing_mm", millimetres(frame.spacing_m())},
            {"origin_mm", millimetres(image.index_to_scene.offset)},
            {"directions", direction_rows(image.index_to_scene)},
            {"type", image.type},
            {"orientation", orientation_in_words(frame)},
            {"memory_bytes", image.bytes},
            {"warnings", image.warnings}};
}

std::string bytes_in_words(std::size_t bytes) {
    const double mb = 1e-6 * static_cast<double>(bytes);
    if (mb < 0.1) return fmt::format("{} bytes", bytes);
    return mb < 1000.0 ? fmt::format("{:.1f} MB", mb) : fmt::format("{:.2f} GB", 1e-3 * mb);
}

/// The first lines: what it is, where it lies, what it takes. `values` is said after the type.
std::string image_words(std::string_view what, const Image& image, const std::string& values) {
    const VoxelVolume frame = frame_of(image);
    const Vec3 mm = 1e3 * frame.spacing_m();
    const Vec3 origin = 1e3 * image.index_to_scene.offset;
    return fmt::format("{} of {} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm, {}, {}\n"
                       "{}, at {:.3f} {:.3f} {:.3f} mm (LPS)\n"
                       "takes {} in memory\n",
                       what, image.size[0], image.size[1], image.size[2], mm.x, mm.y, mm.z,
                       image.type, values, orientation_in_words(frame), origin.x, origin.y,
                       origin.z, bytes_in_words(image.bytes));
}

std::string warning_words(const std::vector<std::string>& warnings) {
    std::string text;
    for (const std::string& warning : warnings)
        text += "warning: " + warning + "\n";
    return text;
}

/// A level is of measured values.
void refuse_iso(const FileInfoSettings& settings, std::string_view what) {
    if (settings.iso)
        throw std::invalid_argument(fmt::format(
            "iso: is the level of a measured volume in its picture, and this is a {}; leave it out",
            what));
}

// --- Scalar volumes

/// The picture's surface and what to say of it.
void draw_volume(const std::filesystem::path& file, const VoxelVolume& volume,
                 const FileInfoSettings& settings, FileInfo& info, json& document) {
    const std::optional<double> level = settings.iso ? settings.iso : otsu_threshold(volume);
    try {
        info.picture = overview_png(volume, level);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {} with --iso", file.string(), error.what()));
    }
    if (!level)
        info.words += "the picture shows no surface: all values are equal\n";
    else if (settings.iso)
        info.words += fmt::format("the picture's surface is at {:.6g}, as asked\n", *level);
    else
        info.words += fmt::format("the picture's surface is at {:.6g}, Otsu's threshold of the "
                                  "values; --iso chooses another\n",
                                  *level);
    document["picture_iso"] = level ? json(*level) : json(nullptr);
}

FileInfo scalar_info(const std::filesystem::path& file, const VoxelVolume& volume,
                     const FileInfoSettings& settings) {
    const auto [low, high] = value_range(volume);
    const auto not_finite = std::count_if(volume.values.begin(), volume.values.end(),
                                          [](float value) { return !std::isfinite(value); });
    const Image image{volume.size, volume.index_to_scene, volume.source_type,
                      volume.values.size() * sizeof(float), volume.warnings};
    FileInfo info;
    info.words = image_words("volume", image, fmt::format("values {:.6g} to {:.6g}", low, high));
    if (not_finite > 0) info.words += fmt::format("{} values are not finite\n", not_finite);
    info.words += warning_words(volume.warnings);
    json document = image_document("volume", image);
    document["range"] = {low, high};
    document["not_finite"] = not_finite;
    if (settings.picture == Picture::overview) draw_volume(file, volume, settings, info, document);
    info.json = json_text(document);
    return info;
}

// --- Labels

json label_document(const LabelVolume& volume, const std::vector<LabelExtent>& extents) {
    json list = json::array();
    for (std::size_t i = 0; i < volume.labels.size(); ++i) {
        const Label& label = volume.labels[i];
        json entry = {{"value", label.value},
                      {"name", label.name},
                      {"voxels", extents[i].voxels},
                      {"volume_mm3", extents[i].volume_mm3},
                      {"bounds_mm", millimetres(extents[i].bounds)}};
        if (label.color) entry["color"] = *label.color;
        if (volume.layers.size() > 1) entry["layer"] = label.layer;
        list.push_back(entry);
    }
    return list;
}

std::string label_table(const LabelVolume& volume, const std::vector<LabelExtent>& extents) {
    constexpr std::size_t kMostLines = 40;
    const std::size_t lines = std::min(volume.labels.size(), kMostLines);
    std::size_t widest = std::string_view("name").size();
    for (std::size_t i = 0; i < lines; ++i)
        widest = std::max(widest, volume.labels[i].name.size());
    std::string text = fmt::format("{:>7}  {:<{}} {:>10} {:>12}  {}\n", "value", "name", widest,
                                   "voxels", "mm3", "bounds, mm LPS");
    for (std::size_t i = 0; i < lines; ++i) {
        const Vec3 lower = 1e3 * extents[i].bounds.lower, upper = 1e3 * extents[i].bounds.upper;
        text += fmt::format("{:>7}  {:<{}} {:>10} {:>12.1f}  {:.1f} {:.1f} {:.1f} to {:.1f} {:.1f} "
                            "{:.1f}\n",
                            volume.labels[i].value, volume.labels[i].name, widest,
                            extents[i].voxels, extents[i].volume_mm3, lower.x, lower.y, lower.z,
                            upper.x, upper.y, upper.z);
    }
    if (lines < volume.labels.size())
        text += fmt::format("and {} more; --json lists all\n", volume.labels.size() - lines);
    return text;
}

/// Smallest and largest value, the background among them.
std::array<std::int32_t, 2> label_range(const LabelVolume& volume) {
    std::array<std::int32_t, 2> range{std::numeric_limits<std::int32_t>::max(),
                                      std::numeric_limits<std::int32_t>::min()};
    for (const VoxelNumbers<std::int32_t>& layer : volume.layers)
        for (const std::int32_t value : layer)
            range = {std::min(range[0], value), std::max(range[1], value)};
    return range;
}

FileInfo label_info(const LabelVolume& volume, const FileInfoSettings& settings) {
    refuse_iso(settings, "label volume");
    const Image image{volume.size, volume.index_to_scene, volume.source_type,
                      volume.layers.size() * volume.voxels() * sizeof(std::int32_t),
                      volume.warnings};
    const std::vector<LabelExtent> extents = label_extents(volume);
    const auto range = label_range(volume);
    std::string values =
        fmt::format("values {} to {}, {} labels", range[0], range[1], volume.labels.size());
    if (volume.layers.size() > 1) values += fmt::format(" in {} layers", volume.layers.size());
    FileInfo info;
    info.words = image_words("label volume", image, values) + warning_words(volume.warnings) +
                 label_table(volume, extents);
    json document = image_document("volume", image);
    document["range"] = range;
    document["layers"] = volume.layers.size();
    document["labels"] = label_document(volume, extents);
    info.json = json_text(document);
    if (settings.picture == Picture::none) return info;
    info.picture = overview_png(volume);
    return info;
}

// --- Vectors

struct Magnitudes {
    double low = 0.0;
    double high = 0.0;
    std::size_t not_zero = 0;
    std::size_t not_finite = 0;
};

/// Lengths of the vectors, Frobenius norms of the tensors.
Magnitudes magnitudes_of(const VectorVolume& volume) {
    const bool is_tensor = volume.kind == VectorVolume::Kind::symmetric_tensor;
    Magnitudes result;
    bool found = false;
    for (std::size_t voxel = 0; voxel < volume.voxels(); ++voxel) {
        const float* v = &volume.values[voxel * static_cast<std::size_t>(volume.components)];
        const double magnitude = is_tensor ? frobenius_norm({v[0], v[1], v[2], v[3], v[4], v[5]})
                                           : glm::length(Vec3(v[0], v[1], v[2]));
        if (!std::isfinite(magnitude)) {
            ++result.not_finite;
            continue;
        }
        result.low = found ? std::min(result.low, magnitude) : magnitude;
        result.high = found ? std::max(result.high, magnitude) : magnitude;
        result.not_zero += magnitude > 0.0 ? 1 : 0;
        found = true;
    }
    return result;
}

FileInfo vector_info(const VectorVolume& volume, const FileInfoSettings& settings) {
    const bool is_tensor = volume.kind == VectorVolume::Kind::symmetric_tensor;
    refuse_iso(settings, "volume of vectors");
    const Image image{volume.size, volume.index_to_scene, volume.source_type,
                      volume.values.size() * sizeof(float), volume.warnings};
    const Magnitudes magnitudes = magnitudes_of(volume);
    const double not_zero_share =
        static_cast<double>(magnitudes.not_zero) / static_cast<double>(volume.voxels());
    FileInfo info;
    info.words = image_words(is_tensor ? "tensor volume" : "vector volume", image,
                             fmt::format("{} components", volume.components));
    info.words +=
        fmt::format("components {}: {}\n{} {:.6g} to {:.6g}, {:.1f} % of the voxels are not zero\n",
                    is_tensor ? "xx, xy, xz, yy, yz, zz" : "x, y, z", volume.frame,
                    is_tensor ? "Frobenius norm" : "length", magnitudes.low, magnitudes.high,
                    100.0 * not_zero_share);
    if (magnitudes.not_finite > 0)
        info.words += fmt::format("{} voxels are not finite\n", magnitudes.not_finite);
    info.words += warning_words(volume.warnings);
    json document = image_document("vectors", image);
    document["components"] = volume.components;
    document["content"] = is_tensor ? "symmetric_tensor" : "vector";
    document["frame"] = volume.frame;
    document["magnitude_range"] = {magnitudes.low, magnitudes.high};
    document["nonzero_share"] = not_zero_share;
    document["not_finite"] = magnitudes.not_finite;
    info.json = json_text(document);
    if (settings.picture == Picture::none) return info;
    info.picture = overview_png(volume);
    return info;
}

// --- Several volumes

/// The volumes of a DICOM folder or .vdb with several of which none is chosen; else empty.
std::vector<VolumeEntry> unchosen(const std::filesystem::path& file,
                                  const VolumeSelection& selection) {
    std::error_code ignored;
    const bool is_folder = std::filesystem::is_directory(file, ignored);
    const bool is_chosen = is_folder ? !selection.series.empty() : !selection.grid.empty();
    if (is_chosen || (!is_folder && file.extension() != ".vdb")) return {};
    std::vector<VolumeEntry> entries = list_volumes(file);
    if (entries.size() < 2) entries.clear();
    return entries;
}

FileInfo list_info(const std::vector<VolumeEntry>& entries, bool is_folder) {
    json list = json::array();
    std::string words = fmt::format("holds {} volumes; choose one with {}:\n", entries.size(),
                                    is_folder ? "--series" : "--grid");
    std::size_t widest = 0;
    for (const VolumeEntry& entry : entries)
        widest = std::max(widest, entry.selector.size());
    for (const VolumeEntry& entry : entries) {
        words += fmt::format("  {:<{}}  {}{}\n", entry.selector, widest, entry.text,
                             entry.readable ? "" : " (cannot be read as a scalar volume)");
        list.push_back(
            {{"selector", entry.selector}, {"text", entry.text}, {"readable", entry.readable}});
    }
    return {words, json_text({{"kind", "volumes"}, {"entries", list}}), {}};
}

} // namespace

FileInfo volume_info(const std::filesystem::path& file, const FileInfoSettings& settings) {
    std::error_code ignored;
    const bool is_folder = std::filesystem::is_directory(file, ignored);
    if (const auto entries = unchosen(file, settings.selection); !entries.empty())
        return list_info(entries, is_folder);
    if (!holds_labels(file) && settings.labels.empty() && !is_folder &&
        holds_vectors(file, settings.selection))
        return vector_info(read_vector_volume(file, settings.selection), settings);
    const ValuesOrLabels read = read_values_or_labels(file, settings);
    const auto* volume = std::get_if<VoxelVolume>(&read);
    return volume != nullptr ? scalar_info(file, *volume, settings)
                             : label_info(std::get<LabelVolume>(read), settings);
}

} // namespace palpate::internal
