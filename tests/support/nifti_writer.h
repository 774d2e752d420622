// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate::test {

/// A NIfTI-1 header, by default of 4 x 3 x 2 int16 with voxels of .5 x 1 x 2 mm, whose fields can
/// be set by their offset: so that impossible ones can be made too.
struct Nifti {
    Nifti() : bytes(352, '\0') {
        set<std::int32_t>(0, 348);
        sizes({4, 3, 2});
        type(4, 16);
        set<float>(76, 1.0F);
        spacing(0.5F, 1.0F, 2.0F);
        set<float>(108, 352.0F);
        set<char>(123, 2); // mm
        std::memcpy(bytes.data() + 344, "n+1", 4);
    }
    template <class T>
    void set(std::size_t offset, T value) {
        std::memcpy(bytes.data() + offset, &value, sizeof(T));
    }
    void sizes(const std::vector<std::int16_t>& along) {
        set(40, static_cast<std::int16_t>(along.size()));
        for (std::size_t axis = 0; axis < 7; ++axis)
            set<std::int16_t>(42 + 2 * axis, axis < along.size() ? along[axis] : std::int16_t{1});
    }
    void type(std::int16_t code, std::int16_t bits) {
        set(70, code);
        set(72, bits);
    }
    void intent(std::int16_t code) { set(68, code); }
    void spacing(float i, float j, float k) {
        set(80, i);
        set(84, j);
        set(88, k);
    }
    /// Spacing .5 1 2 as a sform; RAS, mm.
    void sform(float x, float y, float z) {
        sform({Mat3(0.5, 0, 0, 0, 1, 0, 0, 0, 2), Vec3(x, y, z)});
    }
    /// Voxel index -> RAS, mm; rounded to float.
    void sform(const AffineTransform& ras_mm) {
        set<std::int16_t>(254, 1);
        for (int row = 0; row < 3; ++row) {
            const std::size_t start = 280 + 16 * static_cast<std::size_t>(row);
            for (int column = 0; column < 3; ++column)
                set(start + 4 * static_cast<std::size_t>(column),
                    static_cast<float>(ras_mm.linear[column][row]));
            set(start + 12, static_cast<float>(ras_mm.offset[row]));
        }
    }
    void qform(float b, float c, float d, float x, float y, float z) {
        set<std::int16_t>(252, 1);
        const float values[6] = {b, c, d, x, y, z};
        std::memcpy(bytes.data() + 256, values, sizeof(values));
    }
    std::string with(const std::string& data) const { return bytes + data; }

    std::string bytes;
};

} // namespace palpate::test
