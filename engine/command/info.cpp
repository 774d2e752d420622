// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/volume_options.h>
#include <palpate/engine/info/file_info.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/geometry/mesh_intersections.h>

namespace palpate::command {
namespace {

struct InfoOptions {
    VolumeOptions volume;
    bool json = false;
    std::string picture;
    std::optional<double> iso;
    MeshOptions mesh;
    Replace replace = Replace::own;
};

/// Said now rather than after a large volume was read.
void check_picture(const InfoOptions& options) {
    if (options.iso && options.picture.empty())
        throw UsageError("--iso: is the surface in the picture; give --picture OUT.png too");
    if (options.replace == Replace::any && options.picture.empty())
        throw UsageError("--force: nothing is written without --picture; leave it out");
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
    FileInfoSettings settings = read_settings(options.volume, options.mesh);
#ifdef PALPATE_WITH_CGAL
    settings.count_intersections = count_self_intersections;
#endif
    if (!options.picture.empty()) settings.picture = FileInfoSettings::Picture::overview;
    settings.iso = options.iso;
    return settings;
}

int info(const InfoOptions& options) {
    const std::string& file = options.volume.file;
    const FileInfoSettings settings = settings_of(options);
    require_volume(options.volume, "--iso", options.iso.has_value());
    check_picture(options);
    FileInfo info = [&] {
        try {
            return file_info(file, settings);
        } catch (const std::invalid_argument& error) {
            throw UsageError(fmt::format("--{}", error.what()));
        }
    }();
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
                     "NRRD, NIfTI, MetaImage, DICOM folder, SEG or RT-STRUCT, .vdb; .ply, .stl, "
                     ".obj, .vtp, .vtk; .toml; .h5")
        ->required();
    command->add_flag("--json", options->json, "as JSON");
    command->add_option("--picture", options->picture,
                        "PNG to write: slices and surface of a volume, four views of a mesh");
    command->add_option("--iso", options->iso,
                        "surface in the picture, in the volume's own unit; without it, Otsu's "
                        "threshold");
    add_mesh_options(*command, options->mesh);
    add_volume_options(*command, options->volume);
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return info(*options); }; });
}

} // namespace palpate::command
