// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/volume/fields/internal/grid_nodes.h>
#include <palpate/volume/scalar_field.h>

namespace palpate::internal {

/// One loop's access to a grid: keeps the cell it sampled last. A step of 40-200 um leaves a cell
/// of 1 mm in every fourth to tenth sample.
class GridSampler final : public FieldSampler {
public:
    explicit GridSampler(const GridNodes& nodes) noexcept : nodes_(nodes) {}

    FieldSample sample(const Vec3& point) noexcept override;
    double value(const Vec3& point) noexcept override;
    std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                     double level) noexcept override;

private:
    const GridNodes& nodes_;
    CellIndex cached_{-1, -1, -1}; // no cell with data is there
    Cell cell_;
    bool cell_is_missing_ = false;
};

} // namespace palpate::internal
