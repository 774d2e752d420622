// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/volume_options.h>

#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/internal/lower_case.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::command {
namespace {

[[noreturn]] void refuse(const char* option, const char* kind, const std::string& file) {
    throw UsageError(
        fmt::format("{}: is for {}, and {} is none; leave it out", option, kind, file));
}

} // namespace

void add_volume_options(CLI::App& command, VolumeOptions& options) {
    command.add_option("--labels", options.labels,
                       "table that names the values of a label volume: \"value name\" a line");
    command.add_option("--series", options.series,
                       "DICOM folder: number, description or instance UID of a series");
    command.add_option("--grid", options.grid, ".vdb: name of a grid");
    command
        .add_option("--slices", options.slices,
                    "DICOM slices that are malformed or not evenly spaced: refuse, or repair by "
                    "interpolation")
        ->check(CLI::IsMember({"refuse", "repair"}));
    command
        .add_option("--nifti-transform", options.nifti_transform,
                    "which transform of a NIfTI places it: automatic, sform or qform")
        ->check(CLI::IsMember({"automatic", "sform", "qform"}));
    command.add_option("--reference", options.reference,
                       "DICOM structure set: image whose grid its contours were drawn on; --series "
                       "and the like are then of that");
}

VolumeDescription described(const VolumeOptions& options) {
    VolumeDescription volume;
    volume.file = options.file;
    volume.labels = options.labels;
    std::error_code ignored;
    if (!options.labels.empty() && !std::filesystem::exists(volume.labels, ignored))
        throw std::runtime_error(
            fmt::format("--labels {}: does not exist; check its name", options.labels));
    volume.selection.reference = options.reference;
    if (!options.reference.empty() && !std::filesystem::exists(options.reference, ignored))
        throw std::runtime_error(
            fmt::format("--reference {}: does not exist; check its name", options.reference));
    volume.selection.series = options.series;
    volume.selection.grid = options.grid;
    if (options.slices == "repair") volume.selection.slices = VolumeSelection::Slices::repair;
    using Transform = VolumeSelection::NiftiTransform;
    if (options.nifti_transform == "sform") volume.selection.nifti_transform = Transform::sform;
    if (options.nifti_transform == "qform") volume.selection.nifti_transform = Transform::qform;
    return volume;
}

void add_mesh_options(CLI::App& command, MeshOptions& options) {
    command
        .add_option("--mesh-frame", options.frame,
                    "axes of a mesh's coordinates, whatever the file says: LPS or RAS")
        ->check(CLI::IsMember({"LPS", "RAS"}));
    command
        .add_option("--mesh-unit", options.unit,
                    "unit of a mesh's coordinates, whatever the file says: mm or m")
        ->check(CLI::IsMember({"mm", "m"}));
}

void require_volume(const VolumeOptions& volume, const char* option, bool is_given) {
    const std::string ending = internal::lower_case_ending(volume.file);
    if (is_given && (is_mesh_name(volume.file) || ending == ".toml" || ending == ".h5"))
        refuse(option, "a volume", volume.file);
}

FileInfoSettings read_settings(const VolumeOptions& volume, const MeshOptions& mesh) {
    if (!is_mesh_name(volume.file)) {
        if (!mesh.frame.empty()) refuse("--mesh-frame", "a mesh", volume.file);
        if (!mesh.unit.empty()) refuse("--mesh-unit", "a mesh", volume.file);
    }
    require_volume(volume, "--labels", !volume.labels.empty());
    require_volume(volume, "--series", !volume.series.empty());
    require_volume(volume, "--grid", !volume.grid.empty());
    require_volume(volume, "--slices", volume.slices != "refuse");
    require_volume(volume, "--nifti-transform", volume.nifti_transform != "automatic");
    require_volume(volume, "--reference", !volume.reference.empty());
    const VolumeDescription read = described(volume);
    FileInfoSettings settings;
    settings.selection = read.selection;
    settings.labels = read.labels;
    if (mesh.frame == "LPS") settings.mesh.frame = MeshFrame::lps;
    if (mesh.frame == "RAS") settings.mesh.frame = MeshFrame::ras;
    if (mesh.unit == "mm") settings.mesh.unit = MeshUnit::millimetre;
    if (mesh.unit == "m") settings.mesh.unit = MeshUnit::metre;
    return settings;
}

} // namespace palpate::command
