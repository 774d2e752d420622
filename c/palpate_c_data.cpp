// SPDX-License-Identifier: Apache-2.0
// Data in memory: copied, or, where it is a function, borrowed; checked where it is added.
#include <palpate/palpate_c.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <palpate/c/internal/call.h>
#include <palpate/c/internal/handles.h>
#include <palpate/geometry/mesh_check.h>
#include <palpate/volume/fields/function_field.h>
#include <palpate/volume/volume_check.h>

namespace {

using namespace palpate::c;
using palpate::AffineTransform;

constexpr std::size_t kFirstVoxels = sizeof(palpate_voxels);
constexpr std::size_t kFirstLabel = sizeof(palpate_label);
constexpr std::size_t kFirstLabels = sizeof(palpate_labels);
constexpr std::size_t kFirstVectors = sizeof(palpate_vectors);
constexpr std::size_t kFirstMesh = sizeof(palpate_mesh);
constexpr std::size_t kFirstScalarField = sizeof(palpate_scalar_field);
constexpr std::size_t kFirstVectorField = sizeof(palpate_vector_field);

/// Refuses what a function cannot work with.
void require_all(const palpate_data* data, const char* name, const void* given,
                 const char* function) {
    require(data != nullptr && name != nullptr && given != nullptr,
            std::string(function) + ": data, name or what is added is NULL");
    require(*name != '\0', std::string(function) + ": the name is empty; give it one");
}

/// As messages of scenes made in code name it.
std::string volume_named(const char* name, const char* kind) {
    return "volumes[\"" + std::string(name) + "\"]." + kind;
}

/// Refuses a name that has data already.
template <class Map>
void require_fresh(const Map& map, const char* name) {
    require(!map.contains(name),
            "\"" + std::string(name) + "\" has data already; give this one another name");
}

AffineTransform transform_of(const double (&rows)[3][4]) noexcept {
    AffineTransform transform;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            transform.linear[column][row] = rows[row][column];
        transform.offset[row] = rows[row][3];
    }
    return transform;
}

std::array<int, 3> size_of(const std::int32_t (&voxels)[3]) noexcept {
    return {voxels[0], voxels[1], voxels[2]};
}

/// How many numbers a grid takes; nothing where no grid has such a size, which its check then says.
std::optional<std::size_t> numbers_of(const std::array<int, 3>& size, std::size_t of_each) {
    constexpr double kMost = 1e15; // counted exactly, and more than any check lets through
    double voxels = static_cast<double>(of_each);
    for (const int n : size) {
        if (n < 1) return std::nullopt;
        voxels *= n;
    }
    if (voxels > kMost) return std::nullopt;
    return static_cast<std::size_t>(voxels);
}

/// Copies the numbers of a grid. Nothing is read where their count is not what the size takes.
template <class Number>
std::vector<Number> numbers(const char* name, const Number* values, std::size_t count,
                            const std::array<int, 3>& size, std::size_t of_each) {
    const std::optional<std::size_t> wanted = numbers_of(size, of_each);
    if (!wanted) return {};
    require(count == *wanted, std::string(name) + ": value_count = " + std::to_string(count) +
                                  ", and its voxels take " + std::to_string(*wanted) +
                                  "; give the count of the values that there are");
    require(values != nullptr, std::string(name) + ": values is NULL");
    return {values, values + count};
}

std::shared_ptr<const palpate::VoxelVolume> voxels_of(const palpate_voxels& given,
                                                      const std::string& what) {
    palpate::VoxelVolume volume;
    volume.size = size_of(given.voxels);
    volume.index_to_scene = transform_of(given.index_to_scene);
    volume.values = numbers("palpate_voxels", given.values, given.value_count, volume.size, 1);
    palpate::require_volume(what, volume);
    return std::make_shared<const palpate::VoxelVolume>(std::move(volume));
}

std::vector<palpate::Label> names_of(const palpate_labels& given) {
    std::vector<palpate::Label> names;
    if (given.label_count == 0) return names;
    require(is_array(given.labels, kFirstLabel),
            "palpate_labels: labels is NULL, or size of the first is wrong; set it to "
            "sizeof(palpate_label)");
    for (std::size_t i = 0; i < given.label_count; ++i) {
        const palpate_label& label = entry(given.labels, given.labels[0].size, i);
        const std::string place = "palpate_labels: labels[" + std::to_string(i) + "]";
        require(label.name != nullptr, place + ".name is NULL");
        require(label.layer >= 0, place + ".layer is below 0; count layers from 0");
        names.push_back({label.name, label.value, static_cast<std::size_t>(label.layer), {}});
    }
    return names;
}

std::shared_ptr<const palpate::LabelVolume> labels_of(const palpate_labels& given,
                                                      const std::string& what) {
    constexpr std::int32_t kMostLayers = 1024;
    require(given.layer_count >= 0 && given.layer_count <= kMostLayers,
            "palpate_labels: layer_count = " + std::to_string(given.layer_count) +
                " is out of range; give an integer in [0, 1024]");
    const auto layers = static_cast<std::size_t>(std::max(given.layer_count, 1));
    palpate::LabelVolume volume;
    volume.size = size_of(given.voxels);
    volume.index_to_scene = transform_of(given.index_to_scene);
    volume.labels = names_of(given);
    const std::vector<std::int32_t> all =
        numbers("palpate_labels", given.values, given.value_count, volume.size, layers);
    const auto of_layer = static_cast<std::ptrdiff_t>(all.size() / layers);
    for (auto begin = all.begin(); volume.layers.size() < layers; begin += of_layer)
        volume.layers.push_back(std::vector<std::int32_t>(begin, begin + of_layer));
    palpate::match_labels_to_voxels(volume);
    palpate::require_volume(what, volume);
    return std::make_shared<const palpate::LabelVolume>(std::move(volume));
}

std::shared_ptr<const palpate::VectorVolume> vectors_of(const palpate_vectors& given,
                                                        const std::string& what) {
    require(given.kind == PALPATE_VECTORS || given.kind == PALPATE_TENSORS,
            "palpate_vectors: kind is no palpate_vector_kind");
    palpate::VectorVolume volume;
    if (given.kind == PALPATE_TENSORS) {
        volume.kind = palpate::VectorVolume::Kind::symmetric_tensor;
        volume.components = 6;
    }
    volume.size = size_of(given.voxels);
    volume.index_to_scene = transform_of(given.index_to_scene);
    volume.values = numbers("palpate_vectors", given.values, given.value_count, volume.size,
                            static_cast<std::size_t>(volume.components));
    palpate::require_volume(what, volume);
    return std::make_shared<const palpate::VectorVolume>(std::move(volume));
}

std::shared_ptr<const palpate::TriangleMesh> mesh_of(const palpate_mesh& given,
                                                     const std::string& what) {
    require((given.vertices_m != nullptr || given.vertex_count == 0) &&
                (given.triangles != nullptr || given.triangle_count == 0),
            "palpate_mesh: vertices_m or triangles is NULL");
    palpate::TriangleMesh mesh;
    mesh.vertices.reserve(given.vertex_count);
    for (std::size_t i = 0; i < given.vertex_count; ++i) {
        const double* p = given.vertices_m + 3 * i;
        mesh.vertices.push_back({p[0], p[1], p[2]});
    }
    mesh.triangles.reserve(given.triangle_count);
    for (std::size_t i = 0; i < given.triangle_count; ++i) {
        const std::uint32_t* t = given.triangles + 3 * i;
        mesh.triangles.push_back({t[0], t[1], t[2]});
    }
    palpate::require_mesh(what, mesh);
    return std::make_shared<const palpate::TriangleMesh>(std::move(mesh));
}

// ---- functions of the caller's -----------------------------------------------------------------

/// The caller's `user`, released when nothing can ask its function any more; not before keep().
class Borrowed {
public:
    Borrowed(void* user, void (*release)(void*)) noexcept : user_(user), release_(release) {}
    ~Borrowed() {
        if (is_kept_ && release_ != nullptr) release_(user_);
    }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;

    void keep() noexcept { is_kept_ = true; }
    void* user() const noexcept { return user_; }

private:
    void* user_;
    void (*release_)(void*);
    bool is_kept_ = false;
};

palpate::FunctionFieldSettings settings_of(const double (&lower)[3], const double (&upper)[3],
                                           double feature_size_m) {
    palpate::FunctionFieldSettings settings;
    settings.bounds = {vec(lower), vec(upper)};
    settings.feature_size_m = feature_size_m;
    settings.failures = std::make_shared<std::atomic<std::uint64_t>>(0);
    return settings;
}

std::shared_ptr<const palpate::ScalarField> scalars_of(const palpate_scalar_field& given,
                                                       const std::string& what,
                                                       const std::shared_ptr<Borrowed>& user,
                                                       palpate::FailureCount& failures) {
    require(given.sample != nullptr, "palpate_scalar_field: sample is NULL");
    palpate::FunctionFieldSettings settings =
        settings_of(given.lower_m, given.upper_m, given.feature_size_m);
    settings.steepest_per_m = given.steepest_per_m;
    failures = settings.failures;
    const auto ask = [sample = given.sample,
                      user](const palpate::Vec3& p) -> std::optional<palpate::FunctionSample> {
        palpate::FunctionSample said;
        if (sample(&p.x, &said.value, &said.gradient.x, user->user()) == 0) return std::nullopt;
        return said;
    };
    std::shared_ptr<const palpate::ScalarField> field =
        palpate::make_function_field(what, palpate::ScalarFunction(ask), settings);
    palpate::require_field(what, *field);
    return field;
}

std::shared_ptr<const palpate::VectorField> vectors_of(const palpate_vector_field& given,
                                                       const std::string& what,
                                                       const std::shared_ptr<Borrowed>& user,
                                                       palpate::FailureCount& failures) {
    require(given.sample != nullptr, "palpate_vector_field: sample is NULL");
    const palpate::FunctionFieldSettings settings =
        settings_of(given.lower_m, given.upper_m, given.feature_size_m);
    failures = settings.failures;
    const auto ask = [sample = given.sample,
                      user](const palpate::Vec3& p) -> std::optional<palpate::Vec3> {
        palpate::Vec3 said(0.0);
        if (sample(&p.x, &said.x, user->user()) == 0) return std::nullopt;
        return said;
    };
    std::shared_ptr<const palpate::VectorField> field =
        palpate::make_function_field(what, palpate::VectorFunction(ask), settings);
    palpate::require_field(what, *field);
    return field;
}

} // namespace

palpate_code palpate_data_make(palpate_data** data, palpate_error* error) {
    return guarded(error, [&] {
        require(data != nullptr, "palpate_data_make: data is NULL");
        *data = new palpate_data;
    });
}

void palpate_data_free(palpate_data* data) { delete data; }

palpate_code palpate_data_add_voxels(palpate_data* data, const char* name,
                                     const palpate_voxels* voxels, palpate_error* error) {
    return guarded(error, [&] {
        require_all(data, name, voxels, "palpate_data_add_voxels");
        require_fresh(data->data.volumes, name);
        auto made =
            voxels_of(known(voxels, kFirstVoxels, "palpate_voxels"), volume_named(name, "voxels"));
        data->data.volumes[name].voxels = std::move(made);
    });
}

palpate_code palpate_data_add_labels(palpate_data* data, const char* name,
                                     const palpate_labels* labels, palpate_error* error) {
    return guarded(error, [&] {
        require_all(data, name, labels, "palpate_data_add_labels");
        require_fresh(data->data.volumes, name);
        auto made = labels_of(known(labels, kFirstLabels, "palpate_labels"),
                              volume_named(name, "label_volume"));
        data->data.volumes[name].label_volume = std::move(made);
    });
}

palpate_code palpate_data_add_vectors(palpate_data* data, const char* name,
                                      const palpate_vectors* vectors, palpate_error* error) {
    return guarded(error, [&] {
        require_all(data, name, vectors, "palpate_data_add_vectors");
        require_fresh(data->data.volumes, name);
        auto made = vectors_of(known(vectors, kFirstVectors, "palpate_vectors"),
                               volume_named(name, "vector_volume"));
        data->data.volumes[name].vector_volume = std::move(made);
    });
}

palpate_code palpate_data_add_mesh(palpate_data* data, const char* surface,
                                   const palpate_mesh* mesh, palpate_error* error) {
    return guarded(error, [&] {
        require_all(data, surface, mesh, "palpate_data_add_mesh");
        require_fresh(data->data.meshes, surface);
        auto made = mesh_of(known(mesh, kFirstMesh, "palpate_mesh"),
                            "surfaces[\"" + std::string(surface) + "\"].triangle_mesh");
        data->data.meshes[surface] = std::move(made);
    });
}

palpate_code palpate_data_add_scalar_field(palpate_data* data, const char* name,
                                           const palpate_scalar_field* field,
                                           palpate_error* error) {
    return guarded(error, [&] {
        require_all(data, name, field, "palpate_data_add_scalar_field");
        require_fresh(data->data.volumes, name);
        const auto given = known(field, kFirstScalarField, "palpate_scalar_field");
        const auto user = std::make_shared<Borrowed>(given.user, given.release);
        palpate::FailureCount failures;
        auto made = scalars_of(given, volume_named(name, "scalar_field"), user, failures);
        data->data.volumes[name].scalar_field = std::move(made);
        data->failures[name] = std::move(failures);
        user->keep();
    });
}

palpate_code palpate_data_add_vector_field(palpate_data* data, const char* name,
                                           const palpate_vector_field* field,
                                           palpate_error* error) {
    return guarded(error, [&] {
        require_all(data, name, field, "palpate_data_add_vector_field");
        require_fresh(data->data.volumes, name);
        const auto given = known(field, kFirstVectorField, "palpate_vector_field");
        const auto user = std::make_shared<Borrowed>(given.user, given.release);
        palpate::FailureCount failures;
        auto made = vectors_of(given, volume_named(name, "vector_field"), user, failures);
        data->data.volumes[name].vector_field = std::move(made);
        data->failures[name] = std::move(failures);
        user->keep();
    });
}

uint64_t palpate_data_failures(const palpate_data* data, const char* name) {
    if (data == nullptr || name == nullptr) return 0;
    const auto found = std::find_if(data->failures.begin(), data->failures.end(),
                                    [&](const auto& named) { return named.first == name; });
    return found == data->failures.end() || !found->second
               ? 0
               : found->second->load(std::memory_order_relaxed);
}
