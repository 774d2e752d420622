// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/volume_options.h>
#include <palpate/engine/info/file_info.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/geometry/internal/lower_case.h>
#include <palpate/geometry/mesh_intersections.h>

namespace palpate::command {
namespace {

struct InfoOptions {
    VolumeOptions volume;
    bool json = false;
    std::string picture;
    std::optional<double> iso;
    std::string mesh_frame;
    std::string mesh_unit;
    Replace replace = Replace::own;
};

/// Refuses options of meshes for volumes, and those of volumes for meshes, scenes and recordings.
void check_kind(const InfoOptions& options) {
    const std::string ending = internal::lower_case_ending(options.volume.file);
    const bool is_mesh = ending == ".ply" || ending == ".stl" || ending == ".obj";
    const bool is_volume = !is_mesh && ending != ".toml" && ending != ".h5";
    const auto refuse = [&](const char* option, bool is_given, const char* kind) {
        if (is_given)
            throw UsageError(fmt::format("{}: is for {}, and {} is none; leave it out", option,
                                         kind, options.volume.file));
    };
    if (!is_mesh) {
        refuse("--mesh-frame", !options.mesh_frame.empty(), "a mesh");
        refuse("--mesh-unit", !options.mesh_unit.empty(), "a mesh");
    }
    if (!is_volume) {
        refuse("--labels", !options.volume.labels.empty(), "a volume");
        refuse("--series", !options.volume.series.empty(), "a volume");
        refuse("--grid", !options.volume.grid.empty(), "a volume");
        refuse("--slices", options.volume.slices != "refuse", "a volume");
        refuse("--nifti-transform", options.volume.nifti_transform != "automatic", "a volume");
        refuse("--iso", options.iso.has_value(), "a volume");
    }
}

/// Said now rather than after a large volume was read.
void check_picture(const InfoOptions& options) {
    if (options.iso && options.picture.empty())
        throw UsageError("--iso: is the surface in the picture; give --picture OUT.png too");
    if (options.picture.empty()) return;
    const std::filesystem::path picture(options.picture);
    if (picture.extension() != ".png")
        throw UsageError(
            fmt::format("--picture {}: is written as PNG; name it .png", options.picture));
    SceneDescription read; // no scene, but what there is to be read of a volume
    read.volumes["volume"] = described(options.volume);
    check_outputs(std::array{picture}, input_files(read), options.replace);
}

FileInfoSettings settings_of(const InfoOptions& options) {
    const VolumeDescription volume = described(options.volume);
    FileInfoSettings settings;
    settings.selection = volume.selection;
    settings.labels = volume.labels;
    if (options.mesh_frame == "LPS") settings.mesh.frame = MeshFrame::lps;
    if (options.mesh_frame == "RAS") settings.mesh.frame = MeshFrame::ras;
    if (options.mesh_unit == "mm") settings.mesh.unit = MeshUnit::millimetre;
    if (options.mesh_unit == "m") settings.mesh.unit = MeshUnit::metre;
#ifdef PALPATE_WITH_CGAL
    settings.count_intersections = count_self_intersections;
#endif
    if (!options.picture.empty()) settings.picture = FileInfoSettings::Picture::overview;
    settings.iso = options.iso;
    return settings;
}

int info(const InfoOptions& options) {
    const std::string& file = options.volume.file;
    check_kind(options);
    check_picture(options);
    FileInfo info = file_info(file, settings_of(options));
    if (!options.picture.empty() && info.picture.empty())
        throw UsageError(fmt::format("--picture: there is no picture of {}; give a volume or a "
                                     "mesh, of several volumes one by --series or --grid",
                                     file));
    if (!options.picture.empty()) {
        write_whole_file(options.picture, info.picture);
        info.words += "picture: " + options.picture + "\n";
    }
    print(options.json ? info.json : fmt::format("{}: {}", file, info.words));
    return kDone;
}

} // namespace

void add_info(CLI::App& app, Action& run) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App* command = app.add_subcommand(
        "info", "what a volume, labels, vectors, a mesh, a scene or a recording is, in words");
    command
        ->add_option("FILE", options->volume.file,
                     "NRRD, NIfTI, MetaImage, DICOM folder, .vdb; .ply, .stl, .obj; .toml; .h5")
        ->required();
    command->add_flag("--json", options->json, "as JSON");
    command->add_option("--picture", options->picture,
                        "PNG to write: slices and surface of a volume, four views of a mesh");
    command->add_option("--iso", options->iso,
                        "surface in the picture, in the volume's own unit; without it, Otsu's "
                        "threshold");
    command
        ->add_option("--mesh-frame", options->mesh_frame,
                     "axes of a mesh's coordinates, whatever the file says: LPS or RAS")
        ->check(CLI::IsMember({"LPS", "RAS"}));
    command
        ->add_option("--mesh-unit", options->mesh_unit,
                     "unit of a mesh's coordinates, whatever the file says: mm or m")
        ->check(CLI::IsMember({"mm", "m"}));
    add_volume_options(*command, options->volume);
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return info(*options); }; });
}

} // namespace palpate::command
