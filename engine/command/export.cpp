// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/path_files.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/view_document.h>

namespace palpate::command {
namespace {

struct ExportOptions {
    std::string recording;
    std::string out;
    std::string surface;
    std::optional<std::string> hand; ///< of several, the one that is written
    double step_ms = 20.0;
    Replace replace = Replace::own;
};

/// The file, or the one in a folder of `palpate trace`.
std::filesystem::path named_recording(const std::string& named) {
    const std::filesystem::path file(named);
    std::error_code ignored;
    return found_recording(std::filesystem::is_directory(file, ignored) ? file / "recording.h5"
                                                                        : file);
}

std::vector<NamedPlace> named_places(const std::filesystem::path& recording) {
    std::vector<NamedPlace> places;
    for (const ViewMark& mark : read_marks(marks_file(recording)))
        places.push_back({mark.name, mark.at, mark.time_s, mark.felt});
    return places;
}

/// The mesh of a surface as it was felt or, where no mesh was, as it is shown; its touches on it.
std::string touched_surface(const Recording& recording, const std::filesystem::path& file,
                            const std::string& surface) {
    const std::shared_ptr<const Scene> scene = felt_scene(recording, file);
    std::string names;
    for (std::uint32_t n = 0; n < scene->surfaces().size(); ++n) {
        const std::string& name = scene->surfaces()[n].name;
        names += (names.empty() ? "" : ", ") + name;
        if (name != surface) continue;
        const ViewDocument document = view_document(*scene, ViewMode::playback);
        for (const auto& structure : document.structures)
            if (structure.name == name && structure.mesh)
                return touched_mesh_as_vtp(recording, n, *structure.mesh);
        throw std::runtime_error(
            fmt::format("{}: surface {} has no mesh to show; export the paths, without --surface",
                        file.string(), name));
    }
    throw UsageError(fmt::format("--surface {}: the recording's surfaces are: {}; name one of them",
                                 surface, names));
}

int run_export(const ExportOptions& options) {
    const std::filesystem::path out(options.out);
    const std::string name = out.filename().string();
    const bool is_markups = name.ends_with(".mrk.json"), is_vtp = name.ends_with(".vtp");
    if (!is_markups && !is_vtp)
        throw UsageError(fmt::format("-o {}: is written as markups or as polygonal data; name it "
                                     ".mrk.json or .vtp",
                                     options.out));
    if (is_markups && !options.surface.empty())
        throw UsageError("--surface: is a mesh, which markups cannot hold; name the output .vtp");
    const std::filesystem::path file = named_recording(options.recording);
    const Recording recording = read_shown(file, options.hand);
    std::vector<std::filesystem::path> inputs = input_files(recording, file);
    inputs.push_back(marks_file(file));
    check_outputs(std::array{out}, inputs, options.replace);
    if (is_markups)
        write_whole_file(out, markups_of(recording, named_places(file), 1e-3 * options.step_ms));
    else
        write_whole_file(out, options.surface.empty()
                                  ? paths_as_vtp(recording)
                                  : touched_surface(recording, file, options.surface));
    print(fmt::format("written: {}", options.out));
    return kDone;
}

} // namespace

void add_export(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ExportOptions>();
    CLI::App* command = app.add_subcommand(
        "export", "a recording for other programs: paths, touches and named places, or a touched "
                  "mesh");
    command
        ->add_option("RECORDING|FOLDER", options->recording,
                     "recording.h5, or the folder of a trace that it is in")
        ->required();
    command
        ->add_option("-o,--out", options->out,
                     ".mrk.json: 3D Slicer's markups; .vtp: VTK's polygonal data")
        ->required();
    command->add_option("--hand", options->hand, "of several hands this one, by its name");
    command->add_option("--surface", options->surface,
                        ".vtp: the mesh of that surface, with the time and force of touch of each "
                        "vertex, instead of the paths");
    command
        ->add_option("--step-ms", options->step_ms, ".mrk.json: time between two points of a curve")
        ->check(between(0.01, 1e6));
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return run_export(*options); }; });
}

} // namespace palpate::command
