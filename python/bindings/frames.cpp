// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/frames.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/record/output_files.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/version.h>

namespace palpate::python {
namespace {

/// Where a column's numbers are in a report.
struct Column {
    std::string_view name;
    std::size_t offset;
    char kind; ///< of numpy: d, I (32 bits), L (64 bits)
};

#define PALPATE_COLUMN(field, kind)                                                                \
    Column { #field, offsetof(FrameReport, field), kind }
#define PALPATE_VECTOR(field, unit)                                                                \
    Column{#field "_x_" unit, offsetof(FrameReport, field), 'd'},                                  \
        Column{#field "_y_" unit, offsetof(FrameReport, field) + sizeof(double), 'd'}, Column {    \
#field "_z_" unit, offsetof(FrameReport, field) + 2 * sizeof(double), 'd'                  \
    }

// In the order of frames.csv, then of timing.csv; then of soft surfaces.
constexpr std::array kColumns{
    PALPATE_COLUMN(frame, 'L'),         PALPATE_COLUMN(trial, 'I'),
    PALPATE_COLUMN(time_s, 'd'),        PALPATE_VECTOR(probe, "m"),
    PALPATE_VECTOR(proxy, "m"),         PALPATE_VECTOR(force, "n"),
    PALPATE_COLUMN(sub_steps, 'I'),     PALPATE_COLUMN(evaluations, 'I'),
    PALPATE_COLUMN(contacts, 'I'),      PALPATE_COLUMN(residual_m, 'd'),
    PALPATE_COLUMN(flags, 'I'),         PALPATE_COLUMN(surfaces_felt, 'L'),
    PALPATE_COLUMN(spent_us, 'd'),      PALPATE_COLUMN(estimate_us, 'd'),
    PALPATE_COLUMN(late_us, 'd'),       PALPATE_COLUMN(surface_queries, 'I'),
    PALPATE_COLUMN(field_samples, 'I'), PALPATE_COLUMN(root_queries, 'I'),
    PALPATE_COLUMN(indentation_m, 'd'), PALPATE_COLUMN(stiffness_n_per_m, 'd'),
    PALPATE_VECTOR(front, "m"),         PALPATE_COLUMN(pressed_surface, 'I'),
};
#undef PALPATE_COLUMN
#undef PALPATE_VECTOR

py::dtype type_of(char kind) {
    if (kind == 'd') return py::dtype::of<double>();
    return kind == 'L' ? py::dtype::of<std::uint64_t>() : py::dtype::of<std::uint32_t>();
}

/// A view of a member of all elements, from that of the first on. It keeps `self`, which has them,
/// and nobody may write to it.
template <class Element>
py::array view_of(const py::object& self, const std::vector<Element>& elements, const void* first,
                  const py::dtype& type, py::ssize_t width) {
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(elements.size())};
    std::vector<py::ssize_t> strides{sizeof(Element)};
    if (width > 1) {
        shape.push_back(width);
        strides.push_back(type.itemsize());
    }
    py::array array(type, shape, strides, first, self);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

py::array view(const py::object& self, std::size_t offset, char kind, py::ssize_t width) {
    const std::vector<FrameReport>& reports = self.cast<const Frames&>().run->frames;
    const auto* first = reinterpret_cast<const std::byte*>(reports.data()) + offset;
    return view_of(self, reports, reports.empty() ? nullptr : first, type_of(kind), width);
}

/// A view of a member of all touches.
template <class Number, class Owner, class Member>
py::array touch_view(const py::object& self, Member Owner::*member) {
    const std::vector<RecordedTouch>& touches = self.cast<const Frames&>().run->touches;
    const void* first = touches.empty() ? nullptr : &(touches.front().*member);
    return view_of(self, touches, first, py::dtype::of<Number>(), sizeof(Member) / sizeof(Number));
}

/// With what each touch was: for each an index into a list of texts, each of which is there once.
py::tuple touched_labels(const TracedFrames& frames) {
    const std::vector<RecordedTouch>& touches = frames.run->touches;
    py::array_t<std::uint32_t> indices(static_cast<py::ssize_t>(touches.size()));
    std::uint32_t* index = indices.mutable_data();
    const auto texts = about_long<FileProblem>([&] {
        std::map<std::string, std::uint32_t> known;
        std::vector<std::string> listed;
        for (std::size_t i = 0; i < touches.size(); ++i) {
            const auto [at, is_new] = known.try_emplace(frames.labels->of(touches[i]),
                                                        static_cast<std::uint32_t>(listed.size()));
            if (is_new) listed.push_back(at->first);
            index[i] = at->second;
        }
        return listed;
    });
    return py::make_tuple(indices, texts);
}

py::array column(const py::object& self, const std::string& name) {
    for (const Column& column : kColumns)
        if (column.name == name) return view(self, column.offset, column.kind, 1);
    throw py::key_error(name);
}

std::vector<std::string> column_names() {
    std::vector<std::string> names;
    for (const Column& column : kColumns)
        names.emplace_back(column.name);
    return names;
}

/// What was felt: for each frame an index into a list of texts, each of which is there once.
py::tuple felt(const Frames& frames) {
    const std::vector<FrameReport>& reports = frames.run->frames;
    py::array_t<std::uint32_t> indices(static_cast<py::ssize_t>(reports.size()));
    std::uint32_t* index = indices.mutable_data();
    std::map<std::uint64_t, std::uint32_t> known;
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < reports.size(); ++i) {
        const std::uint64_t bits = reports[i].surfaces_felt;
        if (i > 0 && bits == reports[i - 1].surfaces_felt) {
            index[i] = index[i - 1];
            continue;
        }
        const auto [at, is_new] = known.try_emplace(bits, static_cast<std::uint32_t>(texts.size()));
        if (is_new) texts.push_back(felt_in_words(bits, frames.felt_names));
        index[i] = at->second;
    }
    return py::make_tuple(indices, texts);
}

std::string summary(const TracedFrames& frames) {
    return about_long<SceneProblem>([&] { return summarize(*frames.scene, *frames.trace); });
}

void save(const TracedFrames& frames, const std::string& file, bool force) {
    about_long<FileProblem>([&] {
        const std::vector<std::filesystem::path> outputs{file};
        check_outputs(outputs, input_files(frames.scene->description()),
                      force ? Replace::any : Replace::own);
        write_recording(file, recorded(*frames.scene, frames.overrides, *frames.trace));
    });
}

} // namespace

std::vector<std::string> surface_names(const Scene& scene) {
    std::vector<std::string> names;
    for (const SceneSurface& surface : scene.surfaces())
        names.push_back(surface.name);
    return names;
}

const char* phase_name(Touch::Phase phase) noexcept {
    switch (phase) {
    case Touch::Phase::began:
        return "began";
    case Touch::Phase::goes_on:
        return "goes_on";
    case Touch::Phase::ended:
        break;
    }
    return "ended";
}

TracedFrames traced(std::shared_ptr<const Scene> scene, std::shared_ptr<TouchedLabels> labels,
                    SceneOverrides overrides, Trace trace) {
    TracedFrames frames;
    frames.trace = std::make_shared<const Trace>(std::move(trace));
    frames.run = frames.trace;
    frames.felt_names = felt_names(*scene);
    frames.surfaces = surface_names(*scene);
    frames.labels = std::move(labels);
    frames.version = kVersion;
    frames.scene = std::move(scene);
    frames.overrides = std::move(overrides);
    return frames;
}

void add_frames(py::module_& module) {
    py::class_<Frames>(module, "Frames", "frames as columns; the arrays are views")
        .def("column", column, py::arg("name"))
        .def_property_readonly(
            "probe_m",
            [](const py::object& s) { return view(s, offsetof(FrameReport, probe), 'd', 3); })
        .def_property_readonly(
            "proxy_m",
            [](const py::object& s) { return view(s, offsetof(FrameReport, proxy), 'd', 3); })
        .def_property_readonly(
            "force_n",
            [](const py::object& s) { return view(s, offsetof(FrameReport, force), 'd', 3); })
        .def("felt", felt, "(indices, texts): what was felt is texts[indices]")
        .def(
            "touch_frame",
            [](const py::object& s) { return touch_view<std::uint64_t>(s, &RecordedTouch::frame); })
        .def("touch_surface",
             [](const py::object& s) {
                 return touch_view<std::uint32_t>(s, &RecordedTouch::surface);
             })
        .def("touch_phase",
             [](const py::object& s) { return touch_view<std::uint8_t>(s, &RecordedTouch::phase); })
        .def("touch_point_m",
             [](const py::object& s) { return touch_view<double>(s, &RecordedTouch::point); })
        .def("touch_normal",
             [](const py::object& s) { return touch_view<double>(s, &RecordedTouch::normal); })
        .def("touch_force_n",
             [](const py::object& s) { return touch_view<double>(s, &RecordedTouch::force); })
        .def_property_readonly("surfaces", [](const Frames& s) { return s.surfaces; })
        .def_property_readonly("version", [](const Frames& s) { return s.version; })
        .def("__len__", [](const Frames& s) { return s.run->frames.size(); });
    py::class_<TracedFrames, Frames>(module, "TracedFrames", "frames of a run over a scene")
        .def("summary", summary, "summary.json")
        .def("save", save, py::arg("file"), py::arg("force"), "as recording.h5")
        .def("touched_labels", touched_labels, "(indices, texts), as felt()");
    py::class_<RecordedFrames, Frames>(module, "RecordedFrames", "frames of a recording")
        .def_property_readonly("scene_text",
                               [](const RecordedFrames& s) { return s.recording->scene_text; })
        .def_property_readonly("sources",
                               [](const RecordedFrames& s) {
                                   std::vector<std::pair<py::str, std::string>> sources;
                                   for (const RecordedSource& source : s.recording->sources)
                                       sources.emplace_back(file_name(source.file), source.sha256);
                                   return sources;
                               })
        .def_property_readonly("hand", [](const RecordedFrames& s) { return s.recording->hand; })
        .def_property_readonly("scene_file", [](const RecordedFrames& s) {
            return file_name(s.recording->scene_file);
        });
    module.attr("column_names") = py::tuple(py::cast(column_names()));
    module.attr("phases") =
        py::make_tuple(phase_name(Touch::Phase::began), phase_name(Touch::Phase::goes_on),
                       phase_name(Touch::Phase::ended));
}

} // namespace palpate::python
