// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// A column of a .vtp.
struct VtpArray {
    std::string name;
    std::size_t components = 1;
    std::vector<double> values; ///< as many for each point or cell
};

/// VTK's polygonal data, to be written: lines, then triangles. LPS, said as 3D Slicer does, and mm.
struct VtpText {
    std::vector<Vec3> points_mm;
    std::vector<std::size_t> line_ends; ///< a line has the points from the end of the one before
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<VtpArray> of_points;
    std::vector<VtpArray> of_cells; ///< lines, then triangles

    /// The file as text; `what` it holds is said in a comment. Numbers come back bit for bit.
    /// [setup]
    std::string written(std::string_view what) const;
};

} // namespace palpate::internal
