// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/bindings.h>

#include <cstring>

#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/version.h>

namespace palpate::python {
namespace {

/// Raises an exception of palpate/errors.py.
void raise(const char* name, const char* message) {
    const py::object kind = py::module_::import("palpate.errors").attr(name);
    PyErr_SetObject(kind.ptr(), words(plain_text(message)).ptr()); // one line, whatever it names
}

void translate(std::exception_ptr thrown) {
    try {
        if (thrown) std::rethrow_exception(thrown);
    } catch (const SceneProblem& problem) {
        raise("SceneError", problem.what());
    } catch (const FileProblem& problem) {
        raise("FileError", problem.what());
    } catch (const ArgumentProblem& problem) {
        raise("ArgumentError", problem.what());
    }
}

py::tuple read_mesh_arrays(const std::string& file) {
    const MeshFile mesh = about_long<FileProblem>([&file] { return read_mesh(file); });
    return py::make_tuple(arrays_of(mesh.mesh), mesh.warnings);
}

std::vector<std::string> flag_names(std::uint32_t flags) {
    std::vector<std::string> names;
    for (const FrameFlagText& text : kFrameFlagTexts)
        if (flags & text.flag) names.emplace_back(text.name);
    return names;
}

} // namespace

py::tuple arrays_of(const TriangleMesh& mesh) {
    py::array_t<double> vertices({mesh.vertices.size(), std::size_t{3}});
    auto corner = vertices.mutable_unchecked<2>();
    for (py::ssize_t i = 0; i < corner.shape(0); ++i)
        for (int k = 0; k < 3; ++k)
            corner(i, k) = mesh.vertices[static_cast<std::size_t>(i)][k];
    py::array_t<std::uint32_t> triangles({mesh.triangles.size(), std::size_t{3}});
    auto index = triangles.mutable_unchecked<2>();
    for (py::ssize_t i = 0; i < index.shape(0); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            index(i, static_cast<py::ssize_t>(k)) = mesh.triangles[static_cast<std::size_t>(i)][k];
    return py::make_tuple(vertices, triangles);
}

} // namespace palpate::python

PYBIND11_MODULE(_palpate, module) {
    using namespace palpate::python;
    module.doc() = "What the package palpate has in C++; use the package.";
    module.attr("version") = palpate::kVersion;
    py::register_exception_translator(translate);
    add_data(module);
    add_scene(module);
    add_distance(module);
    add_frames(module);
    add_runs(module);
    add_loop(module);
    py::module_::import("atexit").attr("register")(py::cpp_function(&LongWork::end));
    module.def("read_mesh", read_mesh_arrays, py::arg("file"),
               "((V, F), warnings) of a mesh file, m, LPS");
    module.def("flag_names", flag_names, py::arg("flags"), "names of the bits of a frame's flags");
    module.def(
        "usual_cache_folder", [] { return file_name(palpate::usual_cache_folder().string()); },
        "the command's cache folder");
}
