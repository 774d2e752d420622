// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/frames.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/scene_warnings.h>
#include <palpate/engine/record/output_files.h>
#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/run/effect_prices.h>
#include <palpate/engine/scene/felt_stiffness.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/validation.h>
#include <palpate/engine/text/text_file.h>

namespace palpate::python {
namespace {

PyScene build(SceneDescription description, const std::string& cache, const py::object& extractor) {
    const auto warnings = std::make_shared<std::vector<std::string>>();
    const SceneResources resources = resources_of(cache, extractor, warnings);
    PyScene built;
    built.scene = about_long<SceneProblem>(
        [&] { return std::make_shared<const Scene>(std::move(description), resources); });
    built.warnings = *warnings;
    built.labels = std::make_shared<TouchedLabels>(built.scene);
    return built;
}

PyScene from_text(const std::string& text, const std::string& file, const std::string& cache,
                  const py::object& extractor, const std::map<std::string, VolumeData>& volumes,
                  const std::map<std::string, MeshArrays>& meshes) {
    SceneData data;
    for (const auto& [name, volume] : volumes)
        data.volumes[name] = volume.description;
    for (const auto& [name, arrays] : meshes)
        data.meshes[name] = mesh_of_arrays(arrays);
    SceneDescription description =
        about_long<SceneProblem>([&] { return parse_scene(text, file, data); });
    return build(std::move(description), cache, extractor);
}

PyScene from_file(const std::string& file, const std::string& cache, const py::object& extractor) {
    const std::string text =
        about<FileProblem>([&] { return read_text_file(file, "a scene file (TOML)"); });
    return from_text(text, file, cache, extractor, {}, {});
}

std::vector<py::str> warnings_of(const PyScene& scene) {
    std::vector<py::str> lines;
    for (const auto& more :
         {scene.warnings, source_warnings(*scene.scene), scene_warnings(*scene.scene)})
        for (const std::string& line : more)
            lines.push_back(words(line));
    return lines;
}

std::vector<std::string> effects_of(const PyScene& scene) {
    std::vector<std::string> names;
    for (const EffectDescription& effect : scene.scene->description().effects)
        names.emplace_back(name(effect));
    return names;
}

std::vector<std::string> surfaces_of(const PyScene& scene) { return surface_names(*scene.scene); }

py::str in_words(const PyScene& scene, bool json) {
    return words(about_long<SceneProblem>([&] {
        const std::vector<double> prices = measure_prices(*scene.scene);
        return json ? scene_as_json(*scene.scene, prices) : scene_in_words(*scene.scene, prices);
    }));
}

py::object mesh_of(const PyScene& scene, const std::string& surface) {
    for (const SceneSurface& felt : scene.scene->surfaces())
        if (felt.name == surface)
            return felt.mesh.scene ? py::object(arrays_of(felt.mesh.scene->mesh())) : py::none();
    throw py::key_error(surface);
}

/// For each of the points, m, the stiffness in N/m that is felt of a surface there.
py::array_t<double> stiffness_of(const PyScene& scene, const std::string& surface,
                                 const Points& points) {
    for (const SceneSurface& felt : scene.scene->surfaces()) {
        if (felt.name != surface) continue;
        py::array_t<double> stiffness(points.shape(0));
        const auto from = points.unchecked<2>();
        auto to = stiffness.mutable_unchecked<1>();
        for (py::ssize_t i = 0; i < from.shape(0); ++i)
            to(i) = stiffness_at(*scene.scene, felt, {from(i, 0), from(i, 1), from(i, 2)});
        return stiffness;
    }
    throw py::key_error(surface);
}

/// Every file that a scene is read from, but its own.
std::vector<py::bytes> files_of(const std::string& text, const std::string& file) {
    const auto files = about_long<SceneProblem>([&] {
        SceneDescription scene = parse_scene(text, file);
        scene.file.clear();
        return input_files(scene);
    });
    std::vector<py::bytes> names; // which need not be text
    for (const std::filesystem::path& input : files)
        names.emplace_back(input.string());
    return names;
}

} // namespace

namespace {

/// What is said of a scene from a dict or a text, whose file is nowhere: without the folder.
std::string without_folder(std::string message, const std::filesystem::path& file) {
    const std::string whole = file.string();
    std::error_code ignored;
    if (!whole.empty() && message.starts_with(whole) && !std::filesystem::exists(file, ignored))
        message.replace(0, whole.size(), file.filename().string());
    return message;
}

} // namespace

std::vector<DeviceState> own_states(const Scene& scene, int every) {
    std::vector<std::string> notes;
    std::string refused;
    std::vector<DeviceState> states = about_long<SceneProblem>([&] {
        try {
            return device_states(scene, every, &notes);
        } catch (const std::invalid_argument& error) {
            refused = error.what();
            return std::vector<DeviceState>();
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(without_folder(error.what(), scene.description().file));
        }
    });
    if (!refused.empty()) throw ArgumentProblem(refused);
    constexpr py::ssize_t kCaller = 2; // of the package's function
    for (const std::string& note : notes)
        if (PyErr_WarnEx(PyExc_UserWarning, note.c_str(), kCaller) != 0)
            throw py::error_already_set();
    return states;
}

namespace {

/// The rows of the scene's own path, orbit, tour or recording, as a probe path has them.
py::array_t<double> path_of(const PyScene& scene, int every) {
    const std::vector<DeviceState> states = own_states(*scene.scene, every);
    const double rate_hz = scene.scene->description().loop.rate_hz;
    py::array_t<double> rows({states.size(), std::size_t{4}});
    auto cell = rows.mutable_unchecked<2>();
    std::size_t begin = 0; // of the trial
    for (std::size_t i = 0; i < states.size(); ++i) {
        if (states[i].trial != states[begin].trial) begin = i;
        const auto row = static_cast<py::ssize_t>(i);
        cell(row, 0) = static_cast<double>(i - begin) / rate_hz;
        for (int k = 0; k < 3; ++k)
            cell(row, 1 + k) = states[i].position[k];
    }
    return rows;
}

PyScene of_hand(const PyScene& scene, const std::string& hand) {
    PyScene of = scene;
    of.scene = about<ArgumentProblem>([&] { return scene.scene->of_hand(hand); });
    return of;
}

} // namespace

SceneOverrides overrides_of(const std::optional<std::string>& method, std::optional<int> sub_steps,
                            std::optional<double> tolerance_um, std::optional<double> budget_us) {
    SceneOverrides overrides;
    overrides.method = method;
    overrides.sub_steps = sub_steps;
    overrides.tolerance_um = tolerance_um;
    overrides.budget_us = budget_us;
    return overrides;
}

LoopDescription changed_loop(const Scene& scene, const SceneOverrides& overrides) {
    return about<ArgumentProblem>([&] {
        SceneDescription changed = scene.description();
        apply(overrides, changed);
        check_used(overrides, changed);
        validate(changed.loop);
        return changed.loop;
    });
}

SceneResources resources_of(const std::filesystem::path& cache, const py::object& extractor,
                            std::shared_ptr<std::vector<std::string>> warnings) {
    SceneResources resources;
    resources.files = scene_files(
        ResultCache(cache, [warnings = std::move(warnings)](const std::string& warning) {
            warnings->push_back(warning);
        }));
    if (!extractor.is_none())
        resources.extract = *extractor.cast<py::capsule>().get_pointer<const IsosurfaceExtractor>();
    resources.progress = interruptible();
    return resources;
}

void add_scene(py::module_& module) {
    py::class_<PyScene>(module, "Scene", "a scene, loaded; it never changes")
        .def_static("from_file", from_file, py::arg("file"), py::arg("cache"), py::arg("extractor"),
                    "a scene file (TOML)")
        .def_static("from_text", from_text, py::arg("text"), py::arg("file"), py::arg("cache"),
                    py::arg("extractor"), py::arg("volumes"), py::arg("meshes").noconvert(),
                    "TOML; `file` names it in messages and anchors relative paths; `volumes` and "
                    "`meshes` are in memory, by name")
        .def_property_readonly("file", [](const PyScene& s) { return s.scene->description().file; })
        .def_property_readonly("text", [](const PyScene& s) { return s.scene->description().text; })
        .def_property_readonly("rate_hz",
                               [](const PyScene& s) { return s.scene->description().loop.rate_hz; })
        .def_property_readonly(
            "method",
            [](const PyScene& s) { return std::string(name(s.scene->description().loop.method)); })
        .def_property_readonly("surfaces", surfaces_of)
        .def_property_readonly("effects", effects_of)
        .def_property_readonly("hands",
                               [](const PyScene& s) { return hand_names(s.scene->description()); })
        .def("of_hand", of_hand, py::arg("hand"), "as one of its hands has it; shares all data")
        .def_property_readonly("warnings", warnings_of)
        .def("in_words", in_words, py::arg("json"), "what `palpate explain` prints")
        .def_static("files", files_of, py::arg("text"), py::arg("file"),
                    "what a scene's text is read from, as bytes")
        .def("mesh", mesh_of, py::arg("surface"), "(V, F), or None where its contact needs none")
        .def("stiffness", stiffness_of, py::arg("surface"), py::arg("points"), "(N,), N/m")
        .def("path", path_of, py::arg("every"), "(N, 4) rows of the scene's own device");
}

} // namespace palpate::python
