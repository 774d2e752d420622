// SPDX-License-Identifier: Apache-2.0
// Arrays of the program as a scene's data. What the arrays have to be, palpate/data.py has checked.
#include <python/bindings/bindings.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <span>

#include <palpate/engine/baking/touched_label.h>
#include <palpate/engine/files/data_hash.h>
#include <palpate/volume/volume_check.h>

namespace palpate::python {
namespace {

using Affine = py::array_t<double, py::array::c_style>;
template <class Number>
using Grid = py::array_t<Number, py::array::f_style>;
using Names = std::map<std::int32_t, std::string>;

/// Keeps a Python object until the last copy of this goes, in whichever thread that happens.
std::shared_ptr<const void> kept(const py::object& object) {
    return {object.inc_ref().ptr(), [](const void* raw) {
                if (!Py_IsInitialized()) return; // the interpreter took it along
                const py::gil_scoped_acquire held;
                Py_DECREF(static_cast<PyObject*>(const_cast<void*>(raw)));
            }};
}

/// A view of the array's own memory.
template <class Number>
VoxelNumbers<Number> view_of(const Grid<Number>& array) {
    return VoxelNumbers<Number>::view({array.data(), static_cast<std::size_t>(array.size())},
                                      kept(array));
}

AffineTransform transform_of(const Affine& affine) {
    const auto cell = affine.unchecked<2>();
    AffineTransform transform;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            transform.linear[column][row] = cell(row, column);
        transform.offset[row] = cell(row, 3);
    }
    return transform;
}

/// Voxels along i, j, k, which are the array's last three axes.
std::array<int, 3> size_of(const py::array& array) {
    const py::ssize_t first = array.ndim() - 3;
    return {static_cast<int>(array.shape(first)), static_cast<int>(array.shape(first + 1)),
            static_cast<int>(array.shape(first + 2))};
}

/// Volumes as the checks of the library have passed them.
template <class Volume>
std::shared_ptr<const Volume> checked(const char* what, Volume volume) {
    return about_long<ArgumentProblem>([&] {
        require_volume(what, volume);
        return std::make_shared<const Volume>(std::move(volume));
    });
}

/// A label for each value that occurs in a layer, by value, as files get them.
void add_labels(LabelVolume& volume, std::size_t layer, const Names& names) {
    std::set<std::int32_t> values;
    std::int32_t last = 0; // voxels beside each other mostly have the same
    for (const std::int32_t value :
         std::span<const std::int32_t>(std::as_const(volume.layers[layer])))
        if (value != last) values.insert(last = value);
    values.erase(0);
    for (const std::int32_t value : values) {
        const auto name = names.find(value);
        volume.labels.push_back(
            {name == names.end() ? std::to_string(value) : name->second, value, layer, {}});
    }
}

VolumeData voxels_of(const Grid<float>& values, const Affine& index_to_scene) {
    VoxelVolume volume;
    volume.size = size_of(values);
    volume.values = view_of(values);
    volume.index_to_scene = transform_of(index_to_scene);
    VolumeData data;
    data.description.voxels = checked("Voxels", std::move(volume));
    return data;
}

VolumeData labels_of(const std::vector<Grid<std::int32_t>>& layers, const Affine& index_to_scene,
                     const std::vector<Names>& names) {
    LabelVolume volume;
    volume.size = size_of(layers.at(0));
    for (const Grid<std::int32_t>& layer : layers)
        volume.layers.push_back(view_of(layer));
    volume.index_to_scene = transform_of(index_to_scene);
    about_long<ArgumentProblem>([&] {
        for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
            add_labels(volume, layer, names.at(layer));
    });
    VolumeData data;
    data.description.label_volume = checked("Labels", std::move(volume));
    return data;
}

VolumeData vectors_of(const Grid<float>& values, const Affine& index_to_scene) {
    VectorVolume volume;
    volume.size = size_of(values);
    volume.components = static_cast<int>(values.shape(0));
    volume.kind =
        volume.components == 6 ? VectorVolume::Kind::symmetric_tensor : VectorVolume::Kind::vector;
    volume.values = view_of(values);
    volume.index_to_scene = transform_of(index_to_scene);
    VolumeData data;
    data.description.vector_volume = checked("Vectors", std::move(volume));
    return data;
}

std::string sha256_of(const VolumeData& data) {
    return about_long<ArgumentProblem>([&] { return sha256_of_data(data.description); });
}

} // namespace

std::shared_ptr<const TriangleMesh> mesh_of_arrays(const MeshArrays& arrays) {
    const auto& [vertices, triangles] = arrays;
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->vertices.resize(static_cast<std::size_t>(vertices.shape(0)));
    mesh->triangles.resize(static_cast<std::size_t>(triangles.shape(0)));
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    const auto bytes = [](const auto& array) { return static_cast<std::size_t>(array.nbytes()); };
    if (vertices.size() > 0) std::memcpy(mesh->vertices.data(), vertices.data(), bytes(vertices));
    if (triangles.size() > 0)
        std::memcpy(mesh->triangles.data(), triangles.data(), bytes(triangles));
    return mesh;
}

std::string TouchedLabels::of(const Touch& touch) {
    std::call_once(read_, [this] { probe_ = std::make_unique<LabelProbe>(*scene_); });
    return std::string(touched_label(*probe_, touch));
}

void add_data(py::module_& module) {
    py::class_<VolumeData>(module, "VolumeData", "a volume in memory")
        .def_static("voxels", voxels_of, py::arg("values").noconvert(), py::arg("index_to_scene"),
                    "(I, J, K)")
        .def_static("labels", labels_of, py::arg("layers").noconvert(), py::arg("index_to_scene"),
                    py::arg("names"), "a list of (I, J, K), and names by value of each")
        .def_static("vectors", vectors_of, py::arg("values").noconvert(), py::arg("index_to_scene"),
                    "(3, I, J, K), or (6, I, J, K) of tensors")
        .def_property_readonly("sha256", sha256_of);
}

} // namespace palpate::python
