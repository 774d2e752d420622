// SPDX-License-Identifier: Apache-2.0
#include "bench/internal/openvdb_queries.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Interpolation.h>

namespace palpate::bench {

struct OpenVdbQueries::Grid {
    openvdb::FloatGrid::Ptr grid;
    openvdb::FloatGrid::ConstAccessor accessor;
    Vec3 origin_m, spacing_m;

    double at(const Vec3& point) const {
        const Vec3 index = (point - origin_m) / spacing_m;
        return openvdb::tools::BoxSampler::sample(accessor,
                                                  openvdb::Vec3R(index.x, index.y, index.z));
    }
};

OpenVdbQueries::OpenVdbQueries(const VoxelVolume& volume, float background) {
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(background);
    const openvdb::CoordBBox box(
        openvdb::Coord(0),
        openvdb::Coord(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1));
    const openvdb::tools::Dense<const float, openvdb::tools::LayoutXYZ> dense(box,
                                                                              &volume.values[0]);
    openvdb::tools::copyFromDense(dense, *grid, 0.0F);
    const auto& m = volume.index_to_scene.linear;
    grid_ = std::make_unique<Grid>(Grid{
        grid, grid->getConstAccessor(), volume.index_to_scene.offset, {m[0].x, m[1].y, m[2].z}});
}

OpenVdbQueries::~OpenVdbQueries() = default;

double OpenVdbQueries::value(const Vec3& point) const { return grid_->at(point); }

Vec3 OpenVdbQueries::gradient(const Vec3& point) const {
    Vec3 result(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step(0.0);
        step[axis] = grid_->spacing_m[axis];
        result[axis] = (grid_->at(point + step) - grid_->at(point - step)) / (2.0 * step[axis]);
    }
    return result;
}

} // namespace palpate::bench
