// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/report_page.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
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

/// Method and contact of a summary, as "adaptive, volume".
std::string method_of(const std::string& summary, const std::filesystem::path& folder) {
    try {
        const nlohmann::json json = nlohmann::json::parse(summary);
        return json.value("method", "?") + ", " + json.value("contact", "?");
    } catch (const nlohmann::json::exception&) {
        throw std::runtime_error((folder / "summary.json").string() +
                                 ": is damaged; trace the scene again");
    }
}

/// Before meshes are extracted and pictures drawn.
void check_output(const std::vector<std::string>& folders, const std::string& out,
                  Replace replace) {
    std::vector<std::filesystem::path> inputs;
    for (const std::filesystem::path folder : folders) {
        const std::filesystem::path file = folder / "recording.h5";
        const std::vector<std::filesystem::path> read = input_files(read_recording(file), file);
        inputs.insert(inputs.end(), read.begin(), read.end());
        // The tables are not read, but they are the same trace: a page in their place would lose
        // it.
        for (const char* const of_trace : {"summary.json", "frames.csv", "timing.csv"})
            inputs.push_back(folder / of_trace);
    }
    const std::array<std::filesystem::path, 1> outputs{out};
    check_outputs(outputs, inputs, replace);
}

/// Traces over the same scene are one subject: its first surface gives the picture.
int report(const std::vector<std::string>& folders, const std::string& out,
           const std::vector<std::string>& notes, Replace replace) {
    check_output(folders, out, replace);
    std::vector<ReportSubject> subjects;
    std::map<std::string, std::size_t> subject_of;
    for (const std::filesystem::path folder : folders) {
        const Recording recording = read_recording(folder / "recording.h5");
        if (!subject_of.contains(recording.scene_file)) {
            const auto scene = recorded_scene(recording, folder / "recording.h5", resources());
            if (scene->surfaces().empty())
                throw std::runtime_error(folder.string() +
                                         ": the scene has no surface that could be drawn");
            subject_of[recording.scene_file] = subjects.size();
            subjects.push_back({title_of(*scene), drawn_meshes(*scene), {}});
        }
        const std::string summary =
            read_text_file(folder / "summary.json", "a summary of palpate trace");
        ReportSubject& subject = subjects[subject_of[recording.scene_file]];
        subject.traces.push_back(
            {fmt::format("{}, {}", std::filesystem::path(recording.scene_file).stem().string(),
                         method_of(summary, folder)),
             summary, recording.frames});
    }
    print(report_table(subjects));
    write_report_page(out, subjects, notes);
    print("report: " + std::filesystem::absolute(out).string());
    return kDone;
}

} // namespace

void add_report(CLI::App& app, Action& run) {
    struct Options {
        std::vector<std::string> folders;
        std::string out = "report.html";
        std::vector<std::string> notes;
        Replace replace = Replace::own;
    };
    const auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("report", "a page with table, pictures and charts of traces");
    command->add_option("FOLDER", options->folders, "folders that palpate trace wrote")->required();
    command->add_option("-o,--out", options->out, "HTML file to write");
    command->add_option("--note", options->notes, "a paragraph of text above the table");
    add_force(*command, options->replace);
    command->callback([options, &run] {
        run = [options] {
            return report(options->folders, options->out, options->notes, options->replace);
        };
    });
}

} // namespace palpate::command
