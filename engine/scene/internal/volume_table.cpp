// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <span>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/scene_tables.h>

namespace palpate::internal {
namespace {

constexpr std::array<std::string_view, 2> kSlicesNames{"refuse", "repair"};
constexpr std::array<std::string_view, 3> kTransformNames{"automatic", "sform", "qform"};

double formula_parameter(const TomlTable& table, std::string_view key) {
    const double value = table.number(key, parameter_range(key), 0.0);
    if (key == "angle_deg" && value == 180.0)
        table.fail(table.line_of(key), fmt::format("{} = 180 {} has no edge", key, table.where()),
                   "give an angle in (0, 180) or (180, 360)");
    return value;
}

void read_formula(const TomlTable& table, VolumeDescription& volume) {
    Names names;
    for (const Formula& formula : kFormulas)
        names.push_back(formula.name);
    const Formula& formula = kFormulas[table.choice("analytic", names)];
    const std::span<const std::string_view> parameters(formula.keys.data(), formula.key_count);

    volume.analytic = formula.name;
    Names keys(parameters.begin(), parameters.end());
    const std::string takes = fmt::format("analytic = \"{}\" takes {}", formula.name, joined(keys));
    keys.push_back("analytic");
    table.allow_only(keys, fmt::format("with analytic = \"{}\"", formula.name));
    for (const std::string_view key : parameters) {
        table.require(key, takes);
        volume.parameters[std::string(key)] = formula_parameter(table, key);
    }
    if (volume.analytic == "torus" &&
        volume.parameters.at("tube_mm") >= volume.parameters.at("radius_mm"))
        table.fail(table.line_of("tube_mm"),
                   fmt::format("tube_mm = {} {} is out of range", volume.parameters.at("tube_mm"),
                               table.where()),
                   fmt::format("give a number in (0, {}), below radius_mm",
                               volume.parameters.at("radius_mm")));
}

} // namespace

/// An existing file, relative to the scene's folder.
std::filesystem::path existing_file(const TomlTable& table, std::string_view key,
                                    const std::filesystem::path& scene_file) {
    const std::string text = table.text(key);
    // Where ".." stands behind a link the system goes to another folder than the letters say.
    std::filesystem::path file = scene_file.parent_path() / text;
    const std::filesystem::path by_letters = file.lexically_normal();
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored) ||
        std::filesystem::equivalent(file, by_letters, ignored))
        file = by_letters;
    if (!std::filesystem::exists(file, ignored))
        table.fail(table.line_of(key),
                   fmt::format("{} = \"{}\" {} does not exist", key, text, table.where()),
                   fmt::format("put it at {} or correct the path", file.string()));
    return file;
}

VolumeDescription read_volume_table(const TomlTable& table, const std::filesystem::path& scene_file,
                                    const VolumeDescription* data) {
    VolumeDescription volume;
    volume.line = table.line();
    if (data != nullptr) {
        for (const std::string_view key : {"file", "analytic"})
            if (table.has(key))
                table.fail(
                    table.line_of(key),
                    fmt::format("{} {} and data in memory exclude each other", key, table.where()),
                    "keep one of them");
        table.allow_only({}, "beside data in memory");
        volume = *data;
        volume.line = table.line();
        return volume;
    }
    if (table.has("file") && table.has("analytic"))
        table.fail(table.line_of("file"),
                   fmt::format("file and analytic {} exclude each other", table.where()),
                   "keep one of them");
    if (table.has("analytic")) {
        read_formula(table, volume);
        return volume;
    }
    constexpr std::array<std::string_view, 8> keys{
        "file", "analytic", "labels", "series", "grid", "slices", "nifti_transform", "reference"};
    constexpr std::array<std::string_view, 7> file_keys{
        "file", "labels", "series", "grid", "slices", "nifti_transform", "reference"};
    if (table.has("file"))
        table.allow_only(file_keys, "with file");
    else
        table.allow_only(keys);
    table.require("file", "name a volume file, or a formula with analytic = \"...\"");
    volume.file = existing_file(table, "file", scene_file);
    if (table.has("labels")) volume.labels = existing_file(table, "labels", scene_file);
    if (table.has("series")) volume.selection.series = table.text("series");
    if (table.has("grid")) volume.selection.grid = table.text("grid");
    if (table.has("slices"))
        volume.selection.slices =
            static_cast<VolumeSelection::Slices>(table.choice("slices", kSlicesNames));
    if (table.has("nifti_transform"))
        volume.selection.nifti_transform = static_cast<VolumeSelection::NiftiTransform>(
            table.choice("nifti_transform", kTransformNames));
    if (table.has("reference"))
        volume.selection.reference = existing_file(table, "reference", scene_file);
    return volume;
}

} // namespace palpate::internal
