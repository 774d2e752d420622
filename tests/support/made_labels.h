// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include <palpate/volume/label_volume.h>

namespace palpate::test {

/// A label volume with value(voxel index) at every voxel, labels 1 to `labels` named by digits.
template <class Function>
LabelVolume made_labels(const std::array<int, 3>& size, const AffineTransform& frame, int labels,
                        const Function& value) {
    LabelVolume volume;
    volume.size = size;
    volume.index_to_scene = frame;
    volume.layers.resize(1);
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                volume.layers[0].push_back(static_cast<std::int32_t>(value(Vec3(i, j, k))));
    for (int n = 1; n <= labels; ++n) {
        Label label;
        label.name = std::to_string(n);
        label.value = n;
        volume.labels.push_back(label);
    }
    return volume;
}

} // namespace palpate::test
