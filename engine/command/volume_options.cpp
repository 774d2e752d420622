// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/volume_options.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::command {

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
}

VolumeDescription described(const VolumeOptions& options) {
    VolumeDescription volume;
    volume.file = options.file;
    volume.labels = options.labels;
    std::error_code ignored;
    if (!options.labels.empty() && !std::filesystem::exists(volume.labels, ignored))
        throw UsageError(fmt::format("--labels {}: does not exist", options.labels));
    volume.selection.series = options.series;
    volume.selection.grid = options.grid;
    if (options.slices == "repair") volume.selection.slices = VolumeSelection::Slices::repair;
    using Transform = VolumeSelection::NiftiTransform;
    if (options.nifti_transform == "sform") volume.selection.nifti_transform = Transform::sform;
    if (options.nifti_transform == "qform") volume.selection.nifti_transform = Transform::qform;
    return volume;
}

} // namespace palpate::command
