// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/files/sha256.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/report_page.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/engine/text/text_file.h>

namespace palpate::command {
namespace {

/// The mesh to draw: the surface's own, else extracted, or the preview in a build without CGAL;
/// none for a formula.
std::shared_ptr<const TriangleMesh> drawn_mesh(const Scene& scene, const SceneSurface& surface) {
    if (surface.mesh.scene) return {surface.mesh.scene, &surface.mesh.scene->mesh()};
    if (!surface.baked.grid) return nullptr;
    const SceneResources with = resources();
    if (!with.extract)
        return std::make_shared<TriangleMesh>(surface.baked.grid->preview(surface.baked.level));
    const IsosurfaceSettings settings =
        mesh_settings(scene.description().surfaces.at(surface.name), surface.baked);
    return mesh_surface(surface.baked, settings, with.extract, cache(), with.progress).mesh;
}

/// All surfaces of a scene in one mesh; none where no surface has one.
std::shared_ptr<const TriangleMesh> drawn_meshes(const Scene& scene) {
    if (scene.surfaces().size() == 1) return drawn_mesh(scene, scene.surfaces().front());
    const auto all = std::make_shared<TriangleMesh>();
    for (const SceneSurface& surface : scene.surfaces()) {
        const auto mesh = drawn_mesh(scene, surface);
        if (!mesh) continue;
        const auto first = static_cast<std::uint32_t>(all->vertices.size());
        all->vertices.insert(all->vertices.end(), mesh->vertices.begin(), mesh->vertices.end());
        for (const auto& t : mesh->triangles)
            all->triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
    return all->triangles.empty() ? nullptr : all;
}

/// "skull: bone", or "aal: 8 surfaces".
std::string title_of(const Scene& scene) {
    const std::string stem = scene.description().file.stem().string();
    const std::size_t count = scene.surfaces().size();
    return count == 1 ? fmt::format("{}: {}", stem, scene.surfaces().front().name)
                      : fmt::format("{}: {} surfaces", stem, count);
}

/// What `take` finds in a summary; throws std::runtime_error where it is not as it was written.
template <class Take>
auto taken_from(const std::string& summary, const std::filesystem::path& folder, const Take& take) {
    try {
        return take(nlohmann::json::parse(summary));
    } catch (const nlohmann::json::exception&) {
        throw std::runtime_error((folder / "summary.json").string() +
                                 ": is damaged; trace the scene again");
    }
}

/// Method and contact of a summary, as "adaptive, volume".
std::string method_of(const std::string& summary, const std::filesystem::path& folder) {
    return taken_from(summary, folder, [](const nlohmann::json& json) -> std::string {
        return json.value("method", "?") + ", " + json.value("contact", "?");
    });
}

/// Whether a summary is of this recording: as many frames of the same scene, which took the same
/// time. No two runs do.
bool is_of(const std::string& summary, const Recording& hand, const std::filesystem::path& folder) {
    return taken_from(summary, folder, [&hand](const nlohmann::json& json) {
        using Pointer = nlohmann::json::json_pointer;
        const std::string scene = sha256_of_text(hand.scene_text);
        double longest_us = 0.0;
        for (const FrameReport& frame : hand.frames)
            longest_us = std::max(longest_us, static_cast<double>(frame.spent_us));
        return json.value("frames", hand.frames.size()) == hand.frames.size() &&
               json.value(Pointer("/scene/sha256"), scene) == scene &&
               json.value(Pointer("/spent_us/max"), longest_us) == longest_us;
    });
}

/// What the command line said.
struct ReportOptions {
    std::vector<std::string> folders; ///< that a trace wrote; with `interactive` also a recording
    std::string out;                 ///< page to write; empty: report.html, or the recording's name
    std::vector<std::string> notes;  ///< paragraphs above the table
    std::vector<std::string> played; ///< those of the folders that get a page that plays them
    bool interactive = false;        ///< the page that plays one recording, and no report
    Replace replace = Replace::own;  ///< what of files that are there
};

/// The page that plays a trace, beside the report: report-FOLDER.html of report.html.
std::filesystem::path playback_of(std::filesystem::path folder, const std::string& out) {
    folder = std::filesystem::absolute(folder).lexically_normal();
    if (!folder.has_filename()) folder = folder.parent_path();
    const std::filesystem::path report = out;
    return report.parent_path() /
           fmt::format("{}-{}.html", report.stem().string(), folder.filename().string());
}

/// The report and the pages beside it.
std::vector<std::filesystem::path> outputs_of(const ReportOptions& options) {
    std::vector<std::filesystem::path> outputs{options.out};
    outputs.reserve(1 + options.played.size());
    for (const std::string& folder : options.played) {
        const auto is_same = [&](const std::string& one) {
            std::error_code ignored;
            return std::filesystem::equivalent(one, folder, ignored);
        };
        if (std::none_of(options.folders.begin(), options.folders.end(), is_same))
            throw UsageError(fmt::format("--playback {}: is none of the FOLDERs of this report; "
                                         "name it there, too",
                                         folder));
        outputs.push_back(playback_of(folder, options.out));
        if (std::count(outputs.begin(), outputs.end(), outputs.back()) > 1)
            throw UsageError(fmt::format("--playback {}: another page is {} already; give the "
                                         "folders different names",
                                         folder, outputs.back().string()));
    }
    return outputs;
}

/// Before meshes are extracted and pictures drawn.
void check_output(const ReportOptions& options) {
    std::vector<std::filesystem::path> inputs;
    for (const std::filesystem::path folder : options.folders) {
        const std::filesystem::path file = folder / "recording.h5";
        const std::vector<Recording> hands = read_recordings(file);
        const std::vector<std::filesystem::path> read = input_files(hands.front(), file);
        inputs.insert(inputs.end(), read.begin(), read.end());
        // The tables are not read, but they are the same trace: a page in their place would lose
        // it.
        inputs.push_back(folder / "summary.json");
        for (const Recording& hand : hands)
            for (const char* const of_hand : {"frames.csv", "timing.csv"})
                inputs.push_back(folder / hand.hand / of_hand);
    }
    check_outputs(outputs_of(options), inputs, options.replace);
    check_page_name(options.out);
    std::error_code ignored;
    for (const std::string& note : options.notes)
        if (std::filesystem::exists(std::filesystem::path(note) / "recording.h5", ignored))
            throw UsageError(fmt::format("--note {}: is the folder of a run, and no text; name "
                                         "the FOLDERs before --note",
                                         note));
}

/// Writes the page that plays a trace where that is asked for: its name in the report's folder.
std::string playback(const ReportOptions& options, const std::filesystem::path& folder,
                     const Recording& recording) {
    for (const std::string& played : options.played) {
        if (!std::filesystem::equivalent(played, folder)) continue;
        if (!recording.hand.empty())
            throw UsageError(fmt::format("--playback {}: has several hands, and a page plays one; "
                                         "leave it out, and write each with palpate view {} "
                                         "--hand {}",
                                         played, folder.string(), recording.hand));
        const std::filesystem::path out = playback_of(folder, options.out);
        write_playback(recording, folder / "recording.h5", out, {});
        return out.filename().string();
    }
    return {};
}

/// The summary of each hand that was recorded, alone.
std::vector<std::string> summaries_in(const std::filesystem::path& folder,
                                      const std::vector<Recording>& hands) {
    if (!std::filesystem::exists(folder / "summary.json"))
        throw std::runtime_error(fmt::format(
            "{}: has no summary.json, which trace writes, and serve and view do not; palpate view "
            "{} shows its recording",
            folder.string(), (folder / "recording.h5").string()));
    std::vector<std::string> summaries =
        summaries_of_hands(read_text_file(folder / "summary.json", "a summary of palpate trace"));
    bool is_of_these = summaries.size() == hands.size();
    for (std::size_t i = 0; is_of_these && i < hands.size(); ++i)
        is_of_these = hands[i].hand.empty() || hand_of_summary(summaries[i]) == hands[i].hand;
    if (!is_of_these)
        throw std::runtime_error((folder / "summary.json").string() +
                                 ": has other hands than recording.h5; trace the scene again");
    for (std::size_t i = 0; i < hands.size(); ++i)
        if (!is_of(summaries[i], hands[i], folder))
            throw std::runtime_error(
                (folder / "summary.json").string() +
                ": is of another run than recording.h5; trace the scene again");
    return summaries;
}

/// "skull, left, adaptive, volume".
std::string title_of(const Recording& recording, const std::string& summary,
                     const std::filesystem::path& folder) {
    const std::string hand = recording.hand.empty() ? hand_of_summary(summary) : recording.hand;
    return fmt::format("{}, {}{}{}", std::filesystem::path(recording.scene_file).stem().string(),
                       hand, hand.empty() ? "" : ", ", method_of(summary, folder));
}

/// Tells rows apart that have the same title, as of runs of one scene: each gets its folder's name.
/// `folders`: of all traces, in their order.
void tell_apart(std::vector<ReportSubject>& subjects,
                const std::vector<std::vector<std::string>>& folders) {
    std::map<std::string, int> times;
    for (const ReportSubject& subject : subjects)
        for (const auto& trace : subject.traces)
            ++times[trace.title];
    for (std::size_t i = 0; i < subjects.size(); ++i)
        for (std::size_t k = 0; k < subjects[i].traces.size(); ++k)
            if (std::string& title = subjects[i].traces[k].title; times[title] > 1)
                title += ", " + folders[i][k];
}

/// The folder of a run by that of its recording.
std::string folder_of(const std::string& given) {
    const std::filesystem::path file = given;
    std::error_code ignored;
    if (file.filename() != "recording.h5" || !std::filesystem::is_regular_file(file, ignored))
        return given;
    return file.has_parent_path() ? file.parent_path().string() : ".";
}

/// Of what was overridden, that which decides what is drawn.
std::string drawn_overrides(const Recording& recording) {
    const SceneOverrides all = overrides_from_json(recording.overrides);
    SceneOverrides drawn;
    drawn.hand = all.hand;
    drawn.contact = all.contact;
    drawn.preview = all.preview;
    return to_json(drawn);
}

/// Traces over the same scene are one subject: its first surface gives the picture.
int report(const ReportOptions& options) {
    check_output(options);
    std::vector<ReportSubject> subjects;
    std::vector<std::vector<std::string>> folders; // of each trace of a subject
    std::map<std::string, std::size_t> subject_of;
    for (const std::filesystem::path folder : options.folders) {
        const std::vector<Recording> hands = read_recordings(folder / "recording.h5");
        const Recording& recording = hands.front();
        const std::string felt = fmt::format("{}\n{}\n{}", recording.scene_file,
                                             drawn_overrides(recording), recording.scene_text);
        if (!subject_of.contains(felt)) {
            const auto scene = felt_scene(recording, folder / "recording.h5");
            if (scene->surfaces().empty())
                throw std::runtime_error(folder.string() +
                                         ": the scene has no surface that could be drawn");
            subject_of[felt] = subjects.size();
            subjects.push_back({title_of(*scene), drawn_meshes(*scene), {}});
            folders.emplace_back();
        }
        const std::vector<std::string> summaries = summaries_in(folder, hands);
        ReportSubject& subject = subjects[subject_of[felt]];
        folders[subject_of[felt]].insert(folders[subject_of[felt]].end(), hands.size(),
                                         plain_text(folder.string()));
        for (std::size_t i = 0; i < hands.size(); ++i)
            subject.traces.push_back({title_of(hands[i], summaries[i], folder), summaries[i],
                                      hands[i].frames, playback(options, folder, hands[i])});
    }
    tell_apart(subjects, folders);
    write_report_page(options.out, subjects, options.notes); // also where nobody reads the table
    print(report_table(subjects));
    print("report: " + std::filesystem::absolute(options.out).string());
    return kDone;
}

/// The page of `palpate view`, by this command's name for it.
int play(const ReportOptions& options) {
    if (options.folders.size() != 1)
        throw UsageError("--interactive: the page is of one recording; name one, or let a report "
                         "link to such pages with --playback");
    if (!options.notes.empty() || !options.played.empty())
        throw UsageError("--note, --playback: they are of a report, and --interactive writes none; "
                         "leave them out");
    const std::filesystem::path given = options.folders.front();
    ViewOptions view;
    view.volume.file =
        std::filesystem::is_directory(given) ? (given / "recording.h5").string() : given.string();
    view.out = options.out;
    view.replace = options.replace;
    return view_recording(view);
}

} // namespace

void add_report(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ReportOptions>();
    CLI::App* command =
        app.add_subcommand("report", "a page with table, pictures and charts of traces");
    command->add_option("FOLDER", options->folders, "folders that palpate trace wrote")->required();
    command->add_option("-o,--out", options->out, "HTML file to write");
    command->add_option("--note", options->notes, "a paragraph of text above the table");
    command->add_option("--playback", options->played,
                        "those of the folders that get a page that plays them, beside the report, "
                        "which links to it");
    command->add_flag(
        "--interactive", options->interactive,
        "writes the page that plays one recording instead: as palpate view RECORDING");
    add_force(*command, options->replace);
    command->callback([options, &run] {
        run = [options] {
            if (options->interactive) return play(*options);
            if (options->out.empty()) options->out = "report.html";
            for (std::vector<std::string>* const given : {&options->folders, &options->played})
                for (std::string& folder : *given)
                    folder = folder_of(folder);
            return report(*options);
        };
    });
}

} // namespace palpate::command
