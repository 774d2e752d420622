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

// In the order of frames.csv, then of timing.csv.
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
};
#undef PALPATE_COLUMN
#undef PALPATE_VECTOR

py::dtype type_of(char kind) {
    if (kind == 'd') return py::dtype::of<double>();
    return kind == 'L' ? py::dtype::of<std::uint64_t>() : py::dtype::of<std::uint32_t>();
}

/// A view of the reports, which lives as long as any view of it does; nobody may write to it.
py::array view(const py::object& self, std::size_t offset, char kind, py::ssize_t width) {
    const std::vector<FrameReport>& reports = self.cast<const Frames&>().run->frames;
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(reports.size())};
    std::vector<py::ssize_t> strides{sizeof(FrameReport)};
    if (width > 1) {
        shape.push_back(width);
        strides.push_back(sizeof(double));
    }
    const auto* first = reinterpret_cast<const std::byte*>(reports.data()) + offset;
    py::array array(type_of(kind), shape, strides, reports.empty() ? nullptr : first, self);
    array.attr("setflags")(py::arg("write") = false);
    return array;
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

bool save(const TracedFrames& frames, const std::string& file, bool force) {
    return about_long<FileProblem>([&] {
        const std::vector<std::filesystem::path> outputs{file};
        check_outputs(outputs, input_files(frames.scene->description()),
                      force ? Replace::any : Replace::own);
        write_recording(file, recorded(*frames.scene, frames.overrides, *frames.trace));
        return true;
    });
}

} // namespace

TracedFrames traced(std::shared_ptr<const Scene> scene, SceneOverrides overrides, Trace trace) {
    TracedFrames frames;
    frames.trace = std::make_shared<const Trace>(std::move(trace));
    frames.run = frames.trace;
    frames.felt_names = felt_names(*scene);
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
        .def_property_readonly("version", [](const Frames& s) { return s.version; })
        .def("__len__", [](const Frames& s) { return s.run->frames.size(); });
    py::class_<TracedFrames, Frames>(module, "TracedFrames", "frames of a run over a scene")
        .def("summary", summary, "summary.json")
        .def("save", save, py::arg("file"), py::arg("force"), "as recording.h5");
    py::class_<RecordedFrames, Frames>(module, "RecordedFrames", "frames of a recording")
        .def_property_readonly("scene_text",
                               [](const RecordedFrames& s) { return s.recording->scene_text; })
        .def_property_readonly("scene_file",
                               [](const RecordedFrames& s) { return s.recording->scene_file; });
    module.attr("column_names") = py::tuple(py::cast(column_names()));
}

} // namespace palpate::python
