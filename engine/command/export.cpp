// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/path_files.h>
#include <palpate/engine/report/ros_file.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/view_document.h>

namespace palpate::command {
namespace {

struct ExportOptions {
    std::string recording;
    std::string out;
    std::optional<std::string> surface;
    std::optional<std::string> hand; ///< of several, the one that is written
    std::optional<double> step_ms;   ///< of markups
    Replace replace = Replace::own;
};

std::vector<NamedPlace> named_places(const std::filesystem::path& recording) {
    std::vector<NamedPlace> places;
    for (const ViewMark& mark : read_marks(marks_file(recording)))
        places.push_back({mark.name, mark.at, mark.time_s, mark.felt});
    return places;
}

/// Recordings of before version 4 have no touches, also of what was felt.
void require_touches(const Recording& recording, const std::filesystem::path& file) {
    const bool was_felt = recording.felt_names.empty() || // before version 3
                          std::ranges::any_of(recording.frames, [](const FrameReport& frame) {
                              return frame.surfaces_felt != 0;
                          });
    if (recording.touches.empty() && was_felt)
        throw std::runtime_error(fmt::format(
            "{}: is of a version that recorded no touches; run it again with palpate trace SCENE "
            "--device recording:{}, and export that",
            file.string(), file.string()));
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
        require_touches(recording, file);
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

constexpr double kStep_ms = 20.0; ///< between two points of a curve, where none is asked for

/// What is asked for, by the name of the output.
enum class Format : std::uint8_t { markups, polygons, ros };

Format format_of(const std::string& out) {
    const std::string name = std::filesystem::path(out).filename().string();
    if (name.ends_with(".mrk.json")) return Format::markups;
    if (name.ends_with(".vtp")) return Format::polygons;
    if (name.ends_with(".mcap")) return Format::ros;
    throw UsageError(fmt::format("-o {}: is written as markups, as polygonal data or for ROS 2; "
                                 "name it .mrk.json, .vtp or .mcap",
                                 out));
}

/// All hands, or the one that is named, with at least a frame each.
std::vector<Recording> exported_hands(const std::filesystem::path& file,
                                      const std::optional<std::string>& hand) {
    if (hand) return {read_shown(file, hand)};
    std::vector<Recording> hands = read_recordings(file);
    std::erase_if(hands, [](const Recording& one) { return one.frames.empty(); });
    if (hands.empty())
        throw std::runtime_error(file.string() + ": has no frames to play; record a longer run");
    return hands;
}

std::string for_ros(std::span<const Recording> hands, const std::filesystem::path& file) {
    try {
        return recording_as_mcap(hands);
    } catch (const std::invalid_argument& error) { // it does not know which file that is
        throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
}

int run_export(const ExportOptions& options) {
    const Format format = format_of(options.out);
    if (format != Format::polygons && options.surface)
        throw UsageError("--surface: is a mesh, which only .vtp can hold; name the output .vtp");
    if (format != Format::markups && options.step_ms)
        throw UsageError("--step-ms: is of .mrk.json, and the others have every frame; leave it "
                         "out");
    const std::filesystem::path out(options.out);
    const std::filesystem::path file = named_recording(options.recording);
    const std::vector<Recording> hands =
        format == Format::ros ? exported_hands(file, options.hand)
                              : std::vector<Recording>{read_shown(file, options.hand)};
    const Recording& recording = hands.front();
    std::error_code ignored;
    if (std::filesystem::weakly_canonical(out, ignored) ==
        std::filesystem::weakly_canonical(marks_file(file), ignored))
        throw std::runtime_error(fmt::format("{}: is where the recording's named places are read "
                                             "from; name another output",
                                             options.out));
    std::vector<std::filesystem::path> inputs = input_files(recording, file);
    inputs.push_back(marks_file(file));
    check_outputs(std::array{out}, inputs, options.replace);
    if (format == Format::markups)
        write_whole_file(out, markups_of(recording, named_places(file),
                                         1e-3 * options.step_ms.value_or(kStep_ms)));
    else if (format == Format::ros)
        write_whole_file(out, for_ros(hands, file));
    else
        write_whole_file(out, options.surface ? touched_surface(recording, file, *options.surface)
                                              : paths_as_vtp(recording));
    print(fmt::format("written: {}", plain_text(options.out)));
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
                     ".mrk.json: 3D Slicer's markups; .vtp: VTK's polygonal data; .mcap: poses and "
                     "forces for ROS 2")
        ->required();
    command->add_option("--hand", options->hand,
                        "of several hands this one, by its name; an .mcap has all without it");
    command->add_option("--surface", options->surface,
                        ".vtp: the mesh of that surface, with the time and force of touch of each "
                        "vertex, instead of the paths");
    command
        ->add_option("--step-ms", options->step_ms,
                     ".mrk.json: time between two points of a curve (default: 20)")
        ->check(between(0.01, 1e6));
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return run_export(*options); }; });
}

} // namespace palpate::command
