// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/files/data_hash.h>

#include <array>
#include <memory>
#include <span>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/files/internal/sha256.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/vector_field.h>

namespace palpate {
namespace {

using internal::Sha256;

constexpr int kLatticePoints = 33; // along each axis

template <class Number>
void add(Sha256& hash, std::span<const Number> numbers) {
    static_assert(std::is_arithmetic_v<Number>);
    hash.add(std::string_view(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()));
}

template <class Number>
void add(Sha256& hash, const VoxelNumbers<Number>& numbers) {
    add(hash, std::span<const Number>(numbers));
}

std::string digits(const Vec3& v) { return fmt::format("{:a} {:a} {:a}\n", v.x, v.y, v.z); }

/// What begins the hash of data on a grid.
std::string head(std::string_view kind, const std::array<int, 3>& size,
                 const AffineTransform& to_scene) {
    const Mat3& linear = to_scene.linear;
    return fmt::format("palpate data 1 {}\n{} {} {}\n", kind, size[0], size[1], size[2]) +
           digits(linear[0]) + digits(linear[1]) + digits(linear[2]) + digits(to_scene.offset);
}

void add(Sha256& hash, const VoxelVolume& volume) {
    hash.add(head("voxels", volume.size, volume.index_to_scene));
    add(hash, volume.values);
}

void add(Sha256& hash, const LabelVolume& volume) {
    hash.add(head("labels", volume.size, volume.index_to_scene));
    for (const Label& label : volume.labels)
        hash.add(
            fmt::format("{} {} {} {}\n", label.layer, label.value, label.name.size(), label.name));
    hash.add(fmt::format("{} layers\n", volume.layers.size()));
    for (const VoxelNumbers<std::int32_t>& layer : volume.layers)
        add(hash, layer);
}

void add(Sha256& hash, const VectorVolume& volume) {
    const bool tensors = volume.kind == VectorVolume::Kind::symmetric_tensor;
    hash.add(head(tensors ? "tensors" : "vectors", volume.size, volume.index_to_scene));
    add(hash, volume.values);
}

template <class Visit>
void for_each_lattice_point(const Box& bounds, const Visit& visit) {
    for (int k = 0; k < kLatticePoints; ++k)
        for (int j = 0; j < kLatticePoints; ++j)
            for (int i = 0; i < kLatticePoints; ++i)
                visit(bounds.lower + Vec3(i, j, k) / (kLatticePoints - 1.0) * bounds.extent());
}

void add(Sha256& hash, const ScalarField& field) {
    const Box bounds = field.bounds();
    hash.add("palpate data 1 scalar field\n" + digits(bounds.lower) + digits(bounds.upper) +
             fmt::format("{:a} {:a} {:a}\n", field.feature_size_m(), field.relief_limit_m(),
                         field.patch_cosine()));
    const std::unique_ptr<FieldSampler> sampler = field.make_sampler();
    std::vector<double> numbers;
    for_each_lattice_point(bounds, [&](const Vec3& p) {
        const FieldSample s = sampler->sample(p);
        numbers.insert(numbers.end(),
                       {s.value, s.gradient.x, s.gradient.y, s.gradient.z, s.valid ? 1.0 : 0.0});
    });
    add(hash, std::span<const double>(numbers));
}

void add(Sha256& hash, const VectorField& field) {
    const Box bounds = field.bounds();
    hash.add("palpate data 1 vector field\n" + digits(bounds.lower) + digits(bounds.upper) +
             fmt::format("{:a}\n", field.feature_size_m()));
    const std::unique_ptr<VectorSampler> sampler = field.make_sampler();
    std::vector<double> numbers;
    for_each_lattice_point(bounds, [&](const Vec3& p) {
        const VectorSample s = sampler->sample(p);
        numbers.insert(numbers.end(), {s.value.x, s.value.y, s.value.z, s.valid ? 1.0 : 0.0});
    });
    add(hash, std::span<const double>(numbers));
}

/// Calls visit(field's name, data) for what is in memory.
template <class Visit>
void visit_data(const VolumeDescription& volume, const Visit& visit) {
    if (volume.voxels) return visit("voxels", *volume.voxels);
    if (volume.label_volume) return visit("label_volume", *volume.label_volume);
    if (volume.vector_volume) return visit("vector_volume", *volume.vector_volume);
    if (volume.scalar_field) return visit("scalar_field", *volume.scalar_field);
    if (volume.vector_field) return visit("vector_field", *volume.vector_field);
    throw std::invalid_argument("a volume is hashed that has no data in memory; give it some");
}

} // namespace

std::string data_in_words(const std::string& name, const VolumeDescription& volume) {
    std::string words;
    visit_data(volume, [&](std::string_view field, const auto& data) {
        words = fmt::format("volumes[\"{}\"].{}", name, field);
        if constexpr (requires { data.size; })
            words += fmt::format(", {} x {} x {}", data.size[0], data.size[1], data.size[2]);
    });
    return words;
}

std::string sha256_of_data(const VolumeDescription& volume) {
    Sha256 hash;
    visit_data(volume, [&](std::string_view, const auto& data) { add(hash, data); });
    return hash.hexadecimal();
}

} // namespace palpate
