// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/volume/voxel_volume.h>

/// OpenVDB's own queries on a volume, to compare this library's sampler with.
namespace palpate::bench {

class OpenVdbQueries {
public:
    /// The volume's transform must be a scale and an offset; beyond it is the background.
    explicit OpenVdbQueries(const VoxelVolume& volume, float background);
    ~OpenVdbQueries();
    OpenVdbQueries(const OpenVdbQueries&) = delete;
    OpenVdbQueries& operator=(const OpenVdbQueries&) = delete;

    /// Trilinear, by a GridSampler with an accessor that is kept; the field's unit.
    double value(const Vec3& point) const;
    /// Central differences of six such values one voxel away, the field's unit per m.
    Vec3 gradient(const Vec3& point) const;

private:
    struct Grid;
    std::unique_ptr<Grid> grid_;
};

} // namespace palpate::bench
