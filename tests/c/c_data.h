// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/vector_volume.h>
#include <palpate/volume/voxel_volume.h>

#include "tests/c/c_handles.h"

/// Data of C++ as structs of C that point into it.
namespace palpate::test {

template <class Volume, class Given>
void put_grid(const Volume& volume, Given& given) {
    for (int row = 0; row < 3; ++row) {
        given.voxels[row] = volume.size[static_cast<std::size_t>(row)];
        for (int column = 0; column < 3; ++column)
            given.index_to_scene[row][column] = volume.index_to_scene.linear[column][row];
        given.index_to_scene[row][3] = volume.index_to_scene.offset[row];
    }
}

inline palpate_voxels in_c(const VoxelVolume& volume) {
    auto given = sized<palpate_voxels>();
    put_grid(volume, given);
    given.values = volume.values.data();
    given.value_count = volume.values.size();
    return given;
}

inline palpate_vectors in_c(const VectorVolume& volume) {
    auto given = sized<palpate_vectors>();
    put_grid(volume, given);
    given.kind = volume.kind == VectorVolume::Kind::vector ? PALPATE_VECTORS : PALPATE_TENSORS;
    given.values = volume.values.data();
    given.value_count = volume.values.size();
    return given;
}

/// Without names.
inline palpate_labels in_c(const LabelVolume& volume, const std::vector<std::int32_t>& values) {
    auto given = sized<palpate_labels>();
    put_grid(volume, given);
    given.layer_count = static_cast<std::int32_t>(volume.layers.size());
    given.values = values.data();
    given.value_count = values.size();
    return given;
}

inline palpate_mesh in_c(const TriangleMesh& mesh) {
    auto given = sized<palpate_mesh>();
    given.vertices_m = &mesh.vertices.front().x;
    given.vertex_count = mesh.vertices.size();
    given.triangles = mesh.triangles.front().data();
    given.triangle_count = mesh.triangles.size();
    return given;
}

inline palpate_probe probe_of(const DeviceState& state) {
    auto probe = sized<palpate_probe>();
    probe.time_s = state.time_s;
    for (int i = 0; i < 3; ++i)
        probe.position_m[i] = state.position[i];
    probe.trial = state.trial;
    return probe;
}

} // namespace palpate::test
