// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/volume_options.h>
#include <palpate/engine/info/segmented_folder.h>
#include <palpate/engine/info/starter_scene.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/volume/formats/label_file.h>

namespace palpate::command {
namespace {

struct NewOptions {
    VolumeOptions volume;
    std::string scene;
    std::optional<double> iso;
    std::vector<std::string> labels;
    MeshOptions mesh;
    Replace replace = Replace::own;
};

/// A scene may have been changed by hand since it was written: it is never taken for our own.
void check_scene_file(const NewOptions& options) {
    const std::filesystem::path scene(options.scene);
    if (scene.extension() != ".toml")
        throw UsageError(fmt::format("-o {}: is written as a scene; name it .toml", options.scene));
    std::error_code ignored;
    if (options.replace == Replace::own &&
        std::filesystem::exists(std::filesystem::symlink_status(scene, ignored)))
        throw std::runtime_error(fmt::format("{}: is there already; name another scene, or let it "
                                             "be replaced with --force",
                                             options.scene));
    SceneDescription read; // no scene, but what there is to be read of a volume
    read.volumes["volume"] = described(options.volume);
    check_outputs(std::array{scene}, input_files(read), options.replace);
}

std::string in_words(const SceneDescription& scene) {
    std::string words;
    for (const auto& [name, surface] : scene.surfaces) {
        words += fmt::format("surface {}", name);
        if (!surface.labels.empty())
            words += fmt::format(": label {}", surface.labels.front());
        else if (!surface.volume.empty())
            words += fmt::format(": iso-value {}", surface.iso_value);
        words += '\n';
    }
    return words;
}

/// The data that are named; of a folder with a segmentation, that with the image beside it, unless
/// an image is asked for.
StarterData seen_data(const NewOptions& options) {
    const std::filesystem::path named(options.volume.file);
    FileInfoSettings settings = read_settings(options.volume, options.mesh);
    std::error_code ignored;
    const bool wants_image = options.iso || !settings.selection.series.empty();
    std::optional<SegmentedFolder> folder;
    if (!wants_image && std::filesystem::is_directory(named, ignored))
        folder = find_segmentation(named);
    if (!folder) return starter_data(read_data_file(named, settings));
    if (needs_reference(folder->labels) && settings.selection.reference.empty())
        settings.selection.reference = folder->image; // its series is the one that it refers to
    const DataFile labels = read_data_file(folder->labels, settings);
    StarterData data = starter_data(labels);
    const auto* const volume = std::get_if<LabelVolume>(&labels.content);
    if (volume == nullptr) return data;
    if (const auto image = image_around(*folder, *volume))
        data.image = starter_image(folder->image, folder->image_selection, *image);
    return data;
}

int make_new(const NewOptions& options) {
    const std::string& file = options.volume.file;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored))
        throw std::runtime_error(file + ": does not exist; check its name");
    check_scene_file(options);
    const StarterData data = seen_data(options);
    std::string text;
    try {
        text = starter_scene(data, {options.iso, options.labels}, options.scene);
    } catch (const std::invalid_argument& error) {
        throw UsageError(fmt::format("{}: {}", file, error.what()));
    }
    write_whole_file(options.scene, text);
    print(in_words(parse_scene(text, options.scene)));
    print(fmt::format("written: {0}; next: palpate trace {1}, or palpate view {1}", options.scene,
                      for_a_shell(options.scene)));
    return kDone;
}

} // namespace

void add_new(CLI::App& app, Action& run) {
    const auto options = std::make_shared<NewOptions>();
    CLI::App* command =
        app.add_subcommand("new", "a commented starter scene of a volume, labels or a mesh");
    command
        ->add_option(
            "VOLUME|LABELS|MESH", options->volume.file,
            "NRRD, NIfTI, MetaImage, DICOM folder, SEG or RT-STRUCT, .vdb; a folder with a "
            "segmentation and its image; .ply, .stl, .obj, .vtp, .vtk")
        ->required();
    command->add_option("-o,--out", options->scene, "scene to write (.toml)")->required();
    command->add_option("--iso", options->iso,
                        "of a volume: value of the surface; without it, Otsu's threshold");
    command->add_option("--label", options->labels,
                        "of labels: names or numbers, a surface each; without it, the 8 largest");
    add_mesh_options(*command, options->mesh);
    add_volume_options(*command, options->volume);
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return make_new(*options); }; });
}

} // namespace palpate::command
