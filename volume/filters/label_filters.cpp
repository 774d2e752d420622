// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/label_filters.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

namespace palpate {
namespace {

constexpr double kMm3PerM3 = 1e9;

// Columns per cell and direction: the part of a cell above the level is exact along each column and
// a midpoint sum across them. A plane that cuts a cell anyhow leaves an error below 1/100 of the
// cell, of either sign from cell to cell.
constexpr int kColumns = 4;

constexpr double kVolumeTolerance = 1e-4; // of the volume to keep
constexpr double kLowestLevel = 1e-6;     // of an occupancy: float's rounding of 1
constexpr int kMaxLevelSteps = 60;        // every second one halves: the bracket shrinks by 2^30

void require_filled(const VoxelVolume& volume, const char* who) {
    const auto [i, j, k] = volume.size;
    if (std::min({i, j, k}) < 1 || volume.values.size() != volume.voxels())
        throw std::invalid_argument(std::string(who) +
                                    ": the volume is empty or its values do not fill its size");
}

/// Values at the corners of a cell; corner 1 is i + 1, 2 is j + 1, 4 is k + 1.
using Corners = std::array<double, 8>;

/// Share of [0, 1] where the line from a to b is >= level.
double share_above(double a, double b, double level) {
    if (a >= level && b >= level) return 1.0;
    if (a < level && b < level) return 0.0;
    const double root = (level - a) / (b - a); // one end is below, so b != a
    return a >= level ? root : 1.0 - root;
}

/// Axis along which the cell's values change most: the level crosses columns along it, rather than
/// running beside them.
std::size_t steepest_axis(const Corners& c) {
    std::size_t steepest = 0;
    double largest = -1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t bit = std::size_t{1} << axis;
        double change = 0.0;
        for (std::size_t corner = 0; corner < 8; ++corner)
            change += (corner & bit) != 0 ? c[corner] : -c[corner];
        if (std::abs(change) > largest) {
            largest = std::abs(change);
            steepest = axis;
        }
    }
    return steepest;
}

/// Share of a cell that the level crosses in which the trilinear interpolation is >= level.
double cell_share(const Corners& c, double level) {
    const std::size_t along = std::size_t{1} << steepest_axis(c);
    const std::size_t u = along == 1 ? 2 : 1;
    const std::size_t v = along == 4 ? 2 : 4;
    const auto bilinear = [&](std::size_t side, double s, double t) {
        return (1.0 - t) * ((1.0 - s) * c[side] + s * c[side + u]) +
               t * ((1.0 - s) * c[side + v] + s * c[side + u + v]);
    };
    double sum = 0.0;
    for (int m = 0; m < kColumns; ++m)
        for (int n = 0; n < kColumns; ++n) {
            const double s = (m + 0.5) / kColumns;
            const double t = (n + 0.5) / kColumns;
            sum += share_above(bilinear(0, s, t), bilinear(along, s, t), level);
        }
    return sum / (kColumns * kColumns);
}

/// The cells' part above the level, in cells.
double cells_above(const VoxelVolume& volume, double level) {
    const auto [ni, nj, nk] = volume.size;
    const std::size_t row = static_cast<std::size_t>(ni);
    const std::size_t slice = row * static_cast<std::size_t>(nj);
    double sum = 0.0;
    for (int k = 0; k + 1 < nk; ++k)
        for (int j = 0; j + 1 < nj; ++j) {
            const float* const v = volume.values.data() + volume.index(0, j, k);
            // Corners at i + 1 of a cell are those at i of the next one.
            const auto above = [&](std::size_t i) {
                return static_cast<int>(v[i] >= level) + static_cast<int>(v[i + row] >= level) +
                       static_cast<int>(v[i + slice] >= level) +
                       static_cast<int>(v[i + row + slice] >= level);
            };
            std::int64_t whole_cells = 0;
            int here = above(0);
            for (std::size_t i = 0; i + 1 < row; ++i) {
                const int next = above(i + 1);
                const int corners = here + next;
                here = next;
                if (corners == 8) ++whole_cells;
                if (corners == 0 || corners == 8) continue;
                Corners c{};
                for (std::size_t corner = 0; corner < 8; ++corner)
                    c[corner] =
                        v[i + (corner & 1) + (corner & 2 ? row : 0) + (corner & 4 ? slice : 0)];
                sum += cell_share(c, level);
            }
            sum += static_cast<double>(whole_cells);
        }
    return sum;
}

double voxel_volume_m3(const VoxelVolume& volume) {
    return std::abs(glm::determinant(volume.index_to_scene.linear));
}

/// A level and how much more it encloses than wanted.
struct VolumeSample {
    double level = 0.0;
    double excess_m3 = 0.0;
};

} // namespace

double volume_above(const VoxelVolume& volume, double level) {
    require_filled(volume, "volume_above");
    const auto finite = [](float value) { return std::isfinite(value); };
    if (std::all_of(volume.values.begin(), volume.values.end(), finite))
        return voxel_volume_m3(volume) * cells_above(volume, level);
    VoxelVolume filled = volume;
    std::replace_if(filled.values.begin(), filled.values.end(), std::not_fn(finite),
                    static_cast<float>(value_range(volume)[0]));
    return voxel_volume_m3(filled) * cells_above(filled, level);
}

double level_keeping_volume(const VoxelVolume& smoothed, double volume_m3) {
    require_filled(smoothed, "level_keeping_volume");
    const auto sample = [&](double level) {
        return VolumeSample{level, volume_above(smoothed, level) - volume_m3};
    };
    const auto found = [&](const VolumeSample& s) {
        return std::abs(s.excess_m3) <= kVolumeTolerance * volume_m3;
    };
    // The volume falls as the level rises.
    VolumeSample low = sample(kLowestLevel);
    VolumeSample high = sample(1.0 - kLowestLevel);
    bool halve = false;
    for (int n = 0; n < kMaxLevelSteps && low.excess_m3 > 0.0 && high.excess_m3 < 0.0; ++n) {
        const double width = high.level - low.level;
        const double share = halve ? 0.5 : low.excess_m3 / (low.excess_m3 - high.excess_m3);
        const VolumeSample next = sample(low.level + share * width);
        if (found(next)) return next.level;
        (next.excess_m3 > 0.0 ? low : high) = next;
        halve = high.level - low.level > 0.5 * width;
    }
    throw std::runtime_error("no level of the smoothed labels encloses " +
                             std::to_string(kMm3PerM3 * volume_m3) + " mm3; smooth less");
}

namespace {

constexpr float kInside = 0.5F; // of an occupancy of 0 and 1
constexpr double kReach = 0.5;  // voxels from a voxel's centre to the surface that just rounds it

/// The 26 steps to a voxel's neighbours.
std::vector<std::array<int, 3>> neighbour_steps() {
    std::vector<std::array<int, 3>> steps;
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i)
                if (i != 0 || j != 0 || k != 0) steps.push_back({i, j, k});
    return steps;
}

bool is_within(const VoxelVolume& volume, const std::array<int, 3>& voxel) {
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (voxel[axis] < 0 || voxel[axis] >= volume.size[axis]) return false;
    return true;
}

std::array<int, 3> voxel_at(const VoxelVolume& volume, std::size_t index) {
    const auto width = static_cast<std::size_t>(volume.size[0]);
    const auto height = static_cast<std::size_t>(volume.size[1]);
    return {static_cast<int>(index % width), static_cast<int>(index / width % height),
            static_cast<int>(index / (width * height))};
}

/// Trilinear value at voxel + offset, each coordinate of the offset within one voxel; 0 outside.
double value_beside(const VoxelVolume& volume, const std::array<int, 3>& voxel,
                    const Vec3& offset) {
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        std::array<int, 3> at = voxel;
        double weight = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const double share = std::abs(offset[axis]);
            const bool far = (corner >> axis & 1) != 0;
            weight *= far ? share : 1.0 - share;
            if (far) at[static_cast<std::size_t>(axis)] += offset[axis] < 0.0 ? -1 : 1;
        }
        if (weight > 0.0 && is_within(volume, at)) sum += weight * volume.at(at[0], at[1], at[2]);
    }
    return sum;
}

/// Voxels of a label that are more than kReach outside the surface.
class LostVoxels {
public:
    LostVoxels(const VoxelVolume& occupancy, const VoxelVolume& smoothed, double level)
        : steps_(neighbour_steps()), smoothed_(smoothed), lost_(occupancy.values.size()) {
        for (std::size_t voxel = 0; voxel < lost_.size(); ++voxel)
            lost_[voxel] = occupancy.values[voxel] >= kInside && smoothed.values[voxel] < level &&
                           is_far_outside(voxel_at(smoothed, voxel), level);
    }

    /// The part that begins with `first`, which is no longer lost afterwards.
    std::vector<std::size_t> take_part(std::size_t first) {
        std::vector<std::size_t> part;
        if (!std::exchange(lost_[first], false)) return part;
        part.push_back(first);
        for (std::size_t n = 0; n < part.size(); ++n) {
            const std::array<int, 3> here = voxel_at(smoothed_, part[n]);
            for (const auto& [i, j, k] : steps_) {
                const std::array<int, 3> there{here[0] + i, here[1] + j, here[2] + k};
                if (!is_within(smoothed_, there)) continue;
                const std::size_t next = smoothed_.index(there[0], there[1], there[2]);
                if (std::exchange(lost_[next], false)) part.push_back(next);
            }
        }
        return part;
    }

private:
    bool is_far_outside(const std::array<int, 3>& voxel, double level) const {
        return std::none_of(steps_.begin(), steps_.end(), [&](const std::array<int, 3>& step) {
            const Vec3 direction = glm::normalize(Vec3(step[0], step[1], step[2]));
            return value_beside(smoothed_, voxel, kReach * direction) >= level;
        });
    }

    std::vector<std::array<int, 3>> steps_;
    const VoxelVolume& smoothed_;
    std::vector<char> lost_;
};

} // namespace

std::vector<ThinPart> thin_parts(const VoxelVolume& occupancy, const VoxelVolume& smoothed,
                                 double level, std::size_t smallest) {
    require_filled(occupancy, "thin_parts");
    require_filled(smoothed, "thin_parts");
    if (occupancy.size != smoothed.size)
        throw std::invalid_argument("thin_parts: occupancy and smoothed must be of one size");

    LostVoxels lost(occupancy, smoothed, level);
    std::vector<ThinPart> parts;
    for (std::size_t first = 0; first < occupancy.values.size(); ++first) {
        const std::vector<std::size_t> voxels = lost.take_part(first);
        if (voxels.empty() || voxels.size() < smallest) continue;
        const auto deepest =
            std::min_element(voxels.begin(), voxels.end(), [&](std::size_t a, std::size_t b) {
                return smoothed.values[a] < smoothed.values[b];
            });
        const auto [i, j, k] = voxel_at(smoothed, *deepest);
        parts.push_back({voxels.size(),
                         kMm3PerM3 * voxel_volume_m3(smoothed) * static_cast<double>(voxels.size()),
                         smoothed.index_to_scene.point(Vec3(i, j, k))});
    }
    std::stable_sort(parts.begin(), parts.end(),
                     [](const ThinPart& a, const ThinPart& b) { return a.voxels > b.voxels; });
    return parts;
}

} // namespace palpate
