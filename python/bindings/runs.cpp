// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/frames.h>

#include <span>
#include <type_traits>

#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/study/study.h>

namespace palpate::python {
namespace {

using Rows = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// What a probe says on a path: rows (N, 4), the file of such rows, or the scene's own device.
std::vector<DeviceState> states_of(const Scene& scene, const py::object& path, int every) {
    const double rate_hz = scene.description().loop.rate_hz;
    if (path.is_none()) return own_states(scene, every);
    if (py::isinstance<py::bytes>(path)) {
        const auto file = path.cast<std::string>();
        return about_long<FileProblem>([&] { return read_probe_path(file, rate_hz, every); });
    }
    const auto rows = path.cast<Rows>();
    if (rows.ndim() != 2 || rows.shape(1) != 4) throw ArgumentProblem("path: is not (N, 4)");
    static_assert(std::is_standard_layout_v<ProbeRow> && sizeof(ProbeRow) == 4 * sizeof(double));
    const std::span list(reinterpret_cast<const ProbeRow*>(rows.data()),
                         static_cast<std::size_t>(rows.shape(0)));
    return about<ArgumentProblem>([&] { return probe_states(list, rate_hz, every); });
}

TracedFrames trace(const PyScene& scene, const py::object& path, int every,
                   const std::optional<std::string>& method, std::optional<int> sub_steps,
                   std::optional<double> tolerance_um, std::optional<double> budget_us) {
    const SceneOverrides overrides = overrides_of(method, sub_steps, tolerance_um, budget_us);
    const LoopDescription loop = changed_loop(*scene.scene, overrides);
    std::vector<DeviceState> states = states_of(*scene.scene, path, every);
    SteadyClock clock;
    return about_long<SceneProblem>([&] {
        return traced(scene.scene, scene.labels, overrides,
                      run_trace(scene.scene, loop, std::move(states), clock, interruptible()));
    });
}

std::string study(const PyScene& scene, const py::object& path, int every, bool baselines) {
    const std::vector<DeviceState> states = states_of(*scene.scene, path, every);
    SteadyClock clock;
    return about_long<SceneProblem>([&] {
        check_study(*scene.scene);
        Study result =
            run_study(scene.scene, states, study_settings(*scene.scene), clock, interruptible());
        if (baselines)
            for (StudyRun& run : run_baselines(*scene.scene, states, clock, interruptible()))
                result.runs.push_back(std::move(run));
        return study_csv(result);
    });
}

RecordedFrames read_recorded(const std::string& named, const std::string& hand) {
    return about_long<FileProblem>([&] {
        RecordedFrames frames;
        frames.file = found_recording(named);
        frames.recording = std::make_shared<const Recording>(read_recording(frames.file, hand));
        frames.run = frames.recording;
        frames.felt_names = frames.recording->felt_names;
        frames.surfaces = frames.felt_names;
        frames.version = frames.recording->version;
        return frames;
    });
}

/// Names of the hands that a recording has; none where it has one run without a name.
std::vector<std::string> recorded_hands(const std::string& named) {
    return about_long<FileProblem>([&] {
        std::vector<std::string> names;
        for (const Recording& hand : read_recordings(named))
            if (!hand.hand.empty()) names.push_back(hand.hand);
        return names;
    });
}

/// `made_of`: the scene that was recorded, with its data; or null, where the recording has it.
TracedFrames replay(const RecordedFrames& frames, const PyScene* made_of, const std::string& cache,
                    const py::object& extractor) {
    const auto ignored = std::make_shared<std::vector<std::string>>();
    const SceneResources resources = resources_of(cache, extractor, ignored);
    return about_long<FileProblem>([&] {
        const Recording& recording = *frames.recording;
        const SceneOverrides overrides = overrides_from_json(recording.overrides);
        std::shared_ptr<const Scene> scene;
        if (made_of == nullptr) {
            scene = recorded_scene(recording, frames.file, resources);
        } else {
            SceneDescription description = made_of->scene->description();
            apply(overrides, description);
            scene = recorded_scene(recording, frames.file, std::move(description), resources);
        }
        Trace trace = run_again(scene, recording, interruptible());
        return traced(scene, std::make_shared<TouchedLabels>(scene), overrides, std::move(trace));
    });
}

} // namespace

void add_runs(py::module_& module) {
    module.def("trace", trace, py::arg("scene"), py::arg("path"), py::arg("every"),
               py::arg("method"), py::arg("sub_steps"), py::arg("tolerance_um"),
               py::arg("budget_us"), "path: (N, 4) rows, a file as bytes, or None");
    module.def("study", study, py::arg("scene"), py::arg("path"), py::arg("every"),
               py::arg("baselines"), "study.csv as text");
    module.def("read_recording", read_recorded, py::arg("file"), py::arg("hand"));
    module.def("recorded_hands", recorded_hands, py::arg("file"));
    module.def("replay", replay, py::arg("frames"), py::arg("scene"), py::arg("cache"),
               py::arg("extractor"));
}

} // namespace palpate::python
