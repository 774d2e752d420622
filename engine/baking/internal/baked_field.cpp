// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/internal/baked_field.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/progress.h>
#include <palpate/volume/filters/label_filters.h>
#include <palpate/volume/filters/volume_filters.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/label_volume.h>

namespace palpate::internal {
namespace {

using IsoAfterSmoothing = SurfaceDescription::IsoAfterSmoothing;

// The continuous gradient's stencil needs two voxels of background (contact.md 1.1).
constexpr int kPadding = 2;
constexpr double kLabelLevel = 0.5; // of an occupancy: half way between voxel centres
constexpr double kMm3PerM3 = 1e9;

void require_level_in_range(const VoxelVolume& volume, double level, const std::string& place) {
    const auto [low, high] = value_range(volume);
    if (level > low && level <= high) return;
    if (!(low < high))
        throw std::runtime_error(fmt::format(
            "{}: iso_value {} is reached by no voxel, as {}; give another volume", place, level,
            low == high ? fmt::format("all of them have the value {}", low)
                        : std::string("none of them has a value that is a finite number")));
    throw std::runtime_error(
        fmt::format("{}: iso_value {} is reached by no voxel; choose one above {} and up to {}",
                    place, level, low, high));
}

/// What messages call a volume.
std::string called(const VolumeDescription& source) {
    return source.file.empty() ? "in memory" : source.file.string();
}

/// Two values are a mask, whose surface lies between them; more are names, which nothing lies
/// between. A table of names beside it makes either a label map.
bool is_label_map(const std::filesystem::path& file, const VoxelVolume& volume) {
    const LabelMark mark = label_mark(file);
    if (mark == LabelMark::name) return true;
    if (!looks_like_labels(volume)) return false;
    const auto [low, high] = value_range(volume);
    const bool is_mask =
        std::all_of(volume.values.begin(), volume.values.end(), [low = low, high = high](float v) {
            return static_cast<double>(v) == low || static_cast<double>(v) == high;
        });
    return !is_mask || mark == LabelMark::table;
}

void require_no_label_map(const VolumeDescription& source, const VoxelVolume& volume, double level,
                          const std::string& place) {
    if (!is_label_map(source.file, volume)) return;
    throw std::runtime_error(fmt::format(
        "{}: iso_value {} is of the label map {}, whose values are names and not to be "
        "interpolated; {}",
        place, level, called(source),
        source.file.empty() ? "give it as label_volume, and the surface its labels"
                            : "give label = \"NAME\" or a number (`palpate info` lists them)"));
}

/// Measured images have hundreds of values; a label map of so many comes with names, or its regions
/// are larger than single voxels.
void require_label_map(const VolumeDescription& source, const LabelVolume& volume,
                       const std::string& place) {
    constexpr std::size_t most_unseen = 64; // so few labels are believed without a look
    const bool is_named =
        std::any_of(volume.labels.begin(), volume.labels.end(),
                    [](const Label& label) { return label.name != std::to_string(label.value); });
    if (volume.labels.size() <= most_unseen || is_named || volume.layers.size() != 1) return;
    VoxelVolume image;
    image.size = volume.size;
    // Negative values are labels here, as those of a file; they tell images apart elsewhere.
    const auto lowest =
        std::min_element(volume.layers.front().begin(), volume.layers.front().end());
    const std::int64_t shift = std::min<std::int64_t>(0, *lowest);
    image.values.reserve(volume.layers.front().size());
    for (const auto value : volume.layers.front())
        image.values.push_back(static_cast<float>(value - shift));
    if (looks_like_labels(image)) return;
    throw std::runtime_error(fmt::format(
        "{}: label is of {}, which is no label map: it has {} values, most of them beside others; "
        "give iso_value = ..., or name a label volume",
        place, called(source), volume.labels.size()));
}

VoxelVolume region_of(const VoxelVolume& volume, const SurfaceDescription& surface,
                      const std::string& place) {
    const Box region_m{1e-3 * surface.region_mm->lower, 1e-3 * surface.region_mm->upper};
    try {
        return cropped(volume, region_m);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: region_mm: {}; correct it", place, error.what()));
    }
}

/// What is infinite is no measurement, and no material: there are no data, as where it is NaN.
void empty_what_is_infinite(VoxelVolume& volume) {
    std::replace_if(
        volume.values.begin(), volume.values.end(), [](float value) { return std::isinf(value); },
        std::numeric_limits<float>::quiet_NaN());
}

/// What is not finite is background: a Gaussian would take it to each voxel around.
void fill_what_is_not_finite(VoxelVolume& volume, float background) {
    std::replace_if(
        volume.values.begin(), volume.values.end(),
        [](float value) { return !std::isfinite(value); }, background);
}

/// The level of the smoothed field, as the scene wants it chosen, and how far that moves the
/// surface.
KeptLevel level_after_smoothing(const VoxelVolume& before, double level,
                                const VoxelVolume& smoothed, IsoAfterSmoothing rule,
                                double label_volume_mm3, const std::string& place) {
    double chosen = level;
    try {
        if (rule == IsoAfterSmoothing::keep_position)
            return level_keeping_position(before, level, smoothed);
        if (rule == IsoAfterSmoothing::keep_volume)
            chosen = level_keeping_volume(smoothed, label_volume_mm3 / kMm3PerM3);
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(fmt::format("{}: smooth_voxels: {}", place, error.what()));
    }
    return {chosen, surface_shift(before, level, smoothed, chosen)};
}

/// The chosen labels and those of `alike` that exist: a surface refuses its own that do not.
std::vector<std::size_t> joined_labels(const LabelVolume& volume,
                                       const std::vector<std::size_t>& chosen,
                                       std::span<const std::string> alike) {
    std::vector<std::size_t> joined = chosen;
    for (const std::string& label : alike) {
        try {
            for (const std::size_t found : find_labels(volume, {&label, 1}))
                if (std::find(joined.begin(), joined.end(), found) == joined.end())
                    joined.push_back(found);
        } catch (const std::invalid_argument&) {
            continue;
        }
    }
    return joined;
}

/// Components, and the grid: the same for levels and labels. `field` is smoothed already.
void finish(VoxelVolume&& field, float background, double margin, const SurfaceDescription& surface,
            const std::string& place, const Progress& progress, BakedSurface& baked) {
    report(progress, 0.7, "finding components");
    baked.components = remove_components(field, baked.level, surface.keep, margin);
    if (std::none_of(baked.components.begin(), baked.components.end(),
                     [](const VolumeComponent& component) { return component.kept; }))
        throw std::runtime_error(place +
                                 ": keep leaves no component; lower the volume that it asks for");
    baked.volume_mm3 = kMm3PerM3 * volume_above(field, baked.level);
    report(progress, 0.9, "building the grid");
    clear_far_from_level(field, baked.level, background);
    baked.grid = std::make_shared<GridField>(field, background);
    baked.field = baked.grid;
}

} // namespace

LabelMark label_mark(const std::filesystem::path& file) {
    if (is_named_segmentation(file)) return LabelMark::name;
    return is_name_table(find_name_table(file)) ? LabelMark::table : LabelMark::none;
}

void require_no_names(const VolumeDescription& source, const VoxelVolume& volume,
                      const std::string& place) {
    const LabelMark mark = label_mark(source.file);
    if (mark == LabelMark::none) return;
    if (mark == LabelMark::table && !looks_like_labels(volume)) return;
    throw std::runtime_error(
        fmt::format("{}: {} is a label map, whose values are names and not to be interpolated; "
                    "give a volume of measured values, or surfaces of its labels with a material "
                    "each",
                    place, called(source)));
}

BakedSurface bake_level(const VolumeDescription& source, const VoxelVolume& volume,
                        const SurfaceDescription& surface, const std::string& place,
                        const Progress& progress) {
    require_no_label_map(source, volume, surface.iso_value, place);
    require_level_in_range(volume, surface.iso_value, place);
    const auto [low, high] = value_range(volume);
    const float background = static_cast<float>(low);
    VoxelVolume field = surface.region_mm
                            ? padded(region_of(volume, surface, place), kPadding, background)
                            : padded(volume, kPadding, background);
    if (surface.region_mm) require_level_in_range(field, surface.iso_value, place);
    empty_what_is_infinite(field);
    BakedSurface baked;
    baked.level = surface.iso_value;
    baked.warnings = volume.warnings;
    baked.volume_before_mm3 = kMm3PerM3 * volume_above(field, surface.iso_value);
    if (smoothing_of(surface) > 0.0) {
        report(progress, 0.1, "smoothing");
        fill_what_is_not_finite(field, background);
        const VoxelVolume before = field;
        smooth(field, smoothing_of(surface));
        report(progress, 0.4, "choosing the level again");
        const KeptLevel kept = level_after_smoothing(before, surface.iso_value, field,
                                                     iso_rule_of(surface), 0.0, place);
        baked.level = kept.level;
        baked.shift = kept.shift;
        require_level_in_range(field, baked.level, place);
    }
    const double margin = 1e-3 * (high - low); // as 1 HU of about 4000
    finish(std::move(field), background, margin, surface, place, progress, baked);
    return baked;
}

BakedSurface bake_labels(const VolumeDescription& source, const LabelVolume& volume,
                         const SurfaceDescription& surface, std::span<const std::string> alike,
                         const std::string& place, const Progress& progress) {
    require_label_map(source, volume, place);
    // The Gaussian's kernel ends at about four sigma.
    const int margin = kPadding + static_cast<int>(std::ceil(4.0 * smoothing_of(surface)));
    std::vector<std::size_t> chosen;
    VoxelVolume before;
    try {
        chosen = find_labels(volume, surface.labels);
        before = label_occupancy(volume, chosen, margin);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", place, error.what()));
    }
    if (surface.region_mm) before = padded(region_of(before, surface, place), margin, 0.0F);

    BakedSurface baked;
    baked.level = kLabelLevel;
    baked.warnings = volume.warnings;
    for (const std::size_t label : chosen)
        baked.labels.push_back(volume.labels[label].name);
    const double voxel_mm3 = kMm3PerM3 * std::abs(glm::determinant(before.index_to_scene.linear));
    baked.volume_before_mm3 =
        voxel_mm3 *
        static_cast<double>(std::count(before.values.begin(), before.values.end(), 1.0F));
    if (baked.volume_before_mm3 == 0.0)
        throw std::runtime_error(
            fmt::format("{}: region_mm: the label has no voxel in it; correct it", place));
    VoxelVolume field = before;
    if (smoothing_of(surface) > 0.0) {
        report(progress, 0.1, "smoothing");
        field = smooth_against_neighbours(volume, chosen, before, smoothing_of(surface));
        report(progress, 0.4, "choosing the level again");
        const KeptLevel kept = level_after_smoothing(
            before, kLabelLevel, field, iso_rule_of(surface), baked.volume_before_mm3, place);
        baked.level = kept.level;
        baked.shift = kept.shift;
        baked.thin_parts = thin_parts(before, field, baked.level);
    }
    const double own_mm3 = kMm3PerM3 * volume_above(field, baked.level);
    if (const std::vector<std::size_t> joined = joined_labels(volume, chosen, alike);
        joined.size() > chosen.size()) {
        report(progress, 0.5, "closing grooves");
        VoxelVolume closed = without_grooves(volume, chosen, joined, field, smoothing_of(surface));
        baked.joined = closed.values != field.values;
        field = std::move(closed);
    }
    constexpr double margin_of_removed = 1e-3; // of an occupancy in [0, 1]
    finish(std::move(field), 0.0F, margin_of_removed, surface, place, progress, baked);
    if (baked.joined) baked.volume_mm3 = own_mm3;
    return baked;
}

} // namespace palpate::internal
