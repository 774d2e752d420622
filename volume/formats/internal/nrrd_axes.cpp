// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/nrrd_axes.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <palpate/geometry/internal/lower_case.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

constexpr double kMetresPerMm = 1e-3;
constexpr std::size_t kMaxDimensions = 16;       // of the format's own library
constexpr std::int64_t kMaxComponents = 1 << 16; // layers of a segmentation stay far below

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// An axis as the fields describe it.
struct Axis {
    std::int64_t size = 0;
    std::string kind;
    NrrdVector direction;
    double spacing = 1.0;
    std::string unit;
    double least = kNothing, most = kNothing; ///< of "axis mins" and "axis maxs"
    bool in_space = true;
};

std::vector<Axis> parse_sizes(const std::filesystem::path& file, const NrrdText& text) {
    std::vector<Axis> axes;
    for (const std::string& word : nrrd_words(text.field("sizes"))) {
        const auto size = nrrd_integer(word);
        if (!size) throw import_error(file, "states no readable sizes; correct its header");
        axes.emplace_back().size = *size;
    }
    if (axes.empty()) throw import_error(file, "states no readable sizes; correct its header");
    if (text.field("dimension") != std::to_string(axes.size()) || axes.size() > kMaxDimensions)
        throw import_error(file, "states dimension " + short_text(text.field("dimension")) +
                                     " but " + std::to_string(axes.size()) +
                                     " sizes; correct its header");
    return axes;
}

/// True for the kinds of axes that lie in space, and for those that say nothing.
bool is_space_kind(const std::string& written) {
    const std::string kind = lower_case(written);
    return kind == "space" || kind == "domain" || kind == "???" || kind == "none" || kind.empty();
}

/// Spreads a per-axis field's entries over the axes.
template <class Entries, class Set>
void per_axis(const std::filesystem::path& file, const char* name, const Entries& entries,
              std::vector<Axis>& axes, const Set& set) {
    if (entries.size() != axes.size())
        throw import_error(file, "states " + std::to_string(entries.size()) + " " + name +
                                     " for its " + std::to_string(axes.size()) +
                                     " dimensions; correct its header");
    for (std::size_t axis = 0; axis < axes.size(); ++axis)
        set(axes[axis], entries[axis]);
}

/// Which axes lie in space: those with a direction, else by their kinds, else those with a spacing.
std::vector<Axis> parse_axes(const std::filesystem::path& file, const NrrdText& text) {
    std::vector<Axis> axes = parse_sizes(file, text);
    if (text.has("spacings")) {
        per_axis(file, "spacings", nrrd_words(text.field("spacings")), axes,
                 [](Axis& axis, const std::string& word) {
                     axis.spacing = nrrd_number(word);
                     axis.in_space = !std::isnan(axis.spacing);
                 });
    }
    if (text.has("kinds")) {
        per_axis(file, "kinds", nrrd_words(text.field("kinds")), axes,
                 [](Axis& axis, const std::string& kind) {
                     axis.kind = kind;
                     axis.in_space = axis.in_space && is_space_kind(kind);
                 });
    }
    const auto read_if_there = [&](const char* field, const char* name, const auto& set) {
        if (text.has(field) && !text.has("spacedirections"))
            per_axis(file, name, nrrd_words(text.field(field)), axes, set);
    };
    read_if_there("units", "units", [](Axis& axis, const std::string& word) { axis.unit = word; });
    read_if_there("axismins", "axis mins",
                  [](Axis& axis, const std::string& word) { axis.least = nrrd_number(word); });
    read_if_there("axismaxs", "axis maxs",
                  [](Axis& axis, const std::string& word) { axis.most = nrrd_number(word); });
    if (text.has("spacedirections")) {
        std::vector<NrrdVector> directions = nrrd_vectors(text.field("spacedirections"));
        // Some writers leave out the directions of axes that hold nothing.
        for (std::size_t axis = directions.size(); axis < axes.size() && axes[axis].size == 1;
             ++axis)
            directions.emplace_back();
        per_axis(file, "space directions", directions, axes,
                 [](Axis& axis, const NrrdVector& direction) {
                     axis.direction = direction;
                     axis.in_space = direction.has_value();
                 });
    }
    return axes;
}

/// Separates the component axis from those in space.
std::vector<Axis> take_components(const std::filesystem::path& file, std::vector<Axis> axes,
                                  NrrdAxes& result) {
    // An axis of length 1 that is not in space holds nothing, unless it is the only such axis.
    const auto outside = [](const Axis& axis) { return !axis.in_space; };
    if (std::count_if(axes.begin(), axes.end(), outside) > 1)
        std::erase_if(axes, [](const Axis& axis) { return !axis.in_space && axis.size == 1; });
    const auto component = std::find_if(axes.begin(), axes.end(), outside);
    if (component == axes.end()) return axes;
    if (std::count_if(axes.begin(), axes.end(), outside) > 1)
        throw import_error(file, "has several axes that do not lie in space; save one volume of "
                                 "it");
    const bool first = component == axes.begin();
    if (!first && component + 1 != axes.end() && component->size != 1)
        throw import_error(file, "has its components on an axis between those in space; make it "
                                 "the first axis (unu permute)");
    if (component->size < 1 || component->size > kMaxComponents)
        throw import_error(file, "states " + std::to_string(component->size) +
                                     " numbers per voxel; correct its header");
    result.components = static_cast<std::size_t>(component->size);
    result.order = first ? VoxelSink::Components::first : VoxelSink::Components::last;
    result.kind = component->kind;
    axes.erase(component);
    return axes;
}

/// Turns the axes of a patient space into LPS by the signs of x and y; nothing for another space.
std::optional<Vec3> lps_from_space(const std::string& space) {
    static const std::map<std::string, Vec3> spaces{
        {"left-posterior-superior", {1, 1, 1}},   {"lps", {1, 1, 1}},
        {"left-anterior-superior", {1, -1, 1}},   {"las", {1, -1, 1}},
        {"right-anterior-superior", {-1, -1, 1}}, {"ras", {-1, -1, 1}}};
    const auto found = spaces.find(space);
    return found == spaces.end() ? std::nullopt : std::optional(found->second);
}

bool has_time(const std::string& space) {
    return space.find("time") != std::string::npos || space == "rast" || space == "last" ||
           space == "lpst";
}

void check_unit(const std::filesystem::path& file, const NrrdText& text, const char* field,
                const std::string& name, const std::string& unit) {
    if (unit == "mm" || unit.empty()) return;
    throw import_error(file, "has " + name + " " + short_text(text.field(field)) +
                                 ", of which only \"mm\" is known; state it in \"mm\"");
}

/// Of the space, or of axes that have a spacing instead.
void check_units(const std::filesystem::path& file, const NrrdText& text,
                 const std::vector<Axis>& axes) {
    for (const std::string& unit : nrrd_words(text.field("spaceunits")))
        check_unit(file, text, "spaceunits", "space units", unit);
    for (const Axis& axis : axes)
        if (axis.in_space) check_unit(file, text, "units", "units", axis.unit);
}

/// Where an axis begins and ends is another way to state a place and a spacing, which is not read.
void require_no_other_place(const std::filesystem::path& file, const NrrdText& text,
                            const std::vector<Axis>& axes) {
    for (const Axis& axis : axes) {
        if (!axis.in_space) continue;
        const bool begins_elsewhere = std::isfinite(axis.least) && axis.least != 0.0;
        const bool ends = std::isfinite(axis.most) && !text.has("spacings");
        if (begins_elsewhere || ends)
            throw import_error(file, "states the place of its voxels by axis mins or axis maxs, "
                                     "which are not read; state spacings and a space origin");
    }
}

Vec3 three_numbers(const std::filesystem::path& file, const NrrdVector& vector, const char* what) {
    if (!vector || vector->size() != 3)
        throw import_error(file, std::string("does not state ") + what +
                                     " of three numbers; correct its header");
    return {(*vector)[0], (*vector)[1], (*vector)[2]};
}

/// Columns and origin as the header states them, mm, in its own space.
AffineTransform stated_frame(const std::filesystem::path& file, const NrrdText& text,
                             const std::vector<Axis>& axes) {
    AffineTransform frame;
    for (int axis = 0; axis < 3; ++axis) {
        const Axis& stated = axes[static_cast<std::size_t>(axis)];
        if (text.has("spacedirections"))
            frame.linear[axis] = three_numbers(file, stated.direction, "three space directions");
        else
            frame.linear[axis][axis] = stated.spacing;
    }
    if (text.has("spaceorigin")) {
        const auto vectors = nrrd_vectors(text.field("spaceorigin"));
        frame.offset =
            three_numbers(file, vectors.size() == 1 ? vectors[0] : NrrdVector(), "a space origin");
    }
    return frame;
}

/// Done here rather than by ITK, which (5.2) turns a left-anterior-superior space into the wrong
/// one: it mirrors x where y has to be.
void place(const std::filesystem::path& file, const NrrdText& text, const std::vector<Axis>& axes,
           NrrdAxes& result) {
    const auto lps = lps_from_space(text.lower_field("space"));
    if (!lps)
        result.warnings.emplace_back(
            (text.has("space")
                 ? "its space \"" + short_text(text.field("space")) + "\" is no patient space"
                 : std::string("states no patient space")) +
            ": x is taken to run to the patient's left, y posterior, z superior; left and right "
            "may be wrong");
    if (!text.has("spacedirections") && !text.has("spacings"))
        result.warnings.emplace_back("states no spacing: 1 mm is assumed");
    const AffineTransform frame = stated_frame(file, text, axes);
    const Vec3 signs = lps.value_or(Vec3(1.0));
    for (int axis = 0; axis < 3; ++axis) {
        result.component_axes.to_lps[axis][axis] = signs[axis];
        result.index_to_scene.linear[axis] = kMetresPerMm * signs * frame.linear[axis];
    }
    result.index_to_scene.offset = kMetresPerMm * signs * frame.offset;
    require_plausible(file, result.size, result.index_to_scene, "its space directions",
                      {{"spacedirections", "spacings"}, {"spaceorigin"}});
    result.component_axes.words =
        "the axes of its space" + (lps ? " (" + text.field("space") + ")" : std::string());
}

/// The vectors of the field are the columns of the matrix that turns components into the space.
void read_measurement_frame(const std::filesystem::path& file, const NrrdText& text,
                            NrrdAxes& result) {
    const std::vector<NrrdVector> vectors = nrrd_vectors(text.field("measurementframe"));
    const bool stated = std::any_of(vectors.begin(), vectors.end(),
                                    [](const NrrdVector& vector) { return vector.has_value(); });
    if (!stated) return;
    if (vectors.size() != 3)
        throw import_error(file, "does not state a measurement frame of three vectors; correct its "
                                 "header");
    Mat3 frame(1.0);
    for (int column = 0; column < 3; ++column)
        frame[column] = three_numbers(file, vectors[static_cast<std::size_t>(column)],
                                      "a measurement frame with vectors");
    require_regular(file, frame, Vec3(0.0), "its measurement frame");
    result.component_axes.to_lps = result.component_axes.to_lps * frame;
    result.component_axes.stated = true;
    result.component_axes.words = "the file's measurement frame";
}

} // namespace

NrrdAxes read_nrrd_axes(const std::filesystem::path& file, const NrrdText& text) {
    if (has_time(text.lower_field("space")))
        throw import_error(file, "has a space with time, \"" + short_text(text.field("space")) +
                                     "\"; save one volume of it, in a space of three dimensions");
    NrrdAxes result;
    const std::vector<Axis> axes = take_components(file, parse_axes(file, text), result);
    std::vector<std::int64_t> sizes;
    sizes.reserve(axes.size());
    for (const Axis& axis : axes)
        sizes.push_back(axis.size);
    result.size = require_three_dimensions(file, sizes);
    check_units(file, text, axes);
    require_no_other_place(file, text, axes);
    place(file, text, axes, result);
    read_measurement_frame(file, text, result);
    return result;
}

} // namespace palpate::internal
