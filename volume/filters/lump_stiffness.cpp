// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/lump_stiffness.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

constexpr double kCore = 0.75; // of the contact's radius, in the kernel
// A part whose radius is below this share of its distance counts as one point with its second
// moments. What that leaves out is of third order and the moments' anisotropy: below 2 % of what
// the part adds.
constexpr double kFar = 0.15;
constexpr std::size_t kFewPoints = 8;     // are not split
constexpr double kMostPoints = 2e7;       // of one inclusion, in all: 2 GB
constexpr double kFinestOfContact = 0.25; // of the contact's radius: longest side of a point's cell

/// The centres of the cells into which a label's voxels are split, and a cell's volume.
struct Cells {
    std::vector<Vec3> centres;
    double volume_m3 = 0.0;
};

Cells cells_of(const LabelVolume& volume, const Inclusion& inclusion, double finest_m) {
    const VoxelVolume occupied = label_occupancy(volume, inclusion.labels, 0);
    const Vec3 spacing = occupied.spacing_m();
    const auto voxels = std::count(occupied.values.begin(), occupied.values.end(), 1.0F);
    std::array<int, 3> pieces{};
    double points = static_cast<double>(voxels);
    for (int axis = 0; axis < 3; ++axis) {
        const double along = std::max(1.0, std::ceil(spacing[axis] / finest_m - 1e-9));
        points *= along;
        if (points > kMostPoints)
            throw std::invalid_argument(
                "a lump of " + std::to_string(voxels) +
                " voxels would be more than 20,000,000 pieces; give a larger contact radius, or, "
                "where the voxels are smaller than a quarter of it, a smaller lump");
        pieces[static_cast<std::size_t>(axis)] = static_cast<int>(along);
    }
    const int per_voxel = pieces[0] * pieces[1] * pieces[2];
    Cells cells;
    cells.volume_m3 =
        std::abs(glm::determinant(occupied.index_to_scene.linear)) / static_cast<double>(per_voxel);
    cells.centres.reserve(static_cast<std::size_t>(per_voxel) * static_cast<std::size_t>(voxels));
    const auto within = [](int piece, int of) { return (piece + 0.5) / of - 0.5; };
    for (int k = 0; k < occupied.size[2]; ++k)
        for (int j = 0; j < occupied.size[1]; ++j)
            for (int i = 0; i < occupied.size[0]; ++i) {
                if (occupied.at(i, j, k) != 1.0F) continue;
                for (int n = 0; n < per_voxel; ++n) {
                    const int a = n % pieces[0], b = n / pieces[0] % pieces[1],
                              c = n / (pieces[0] * pieces[1]);
                    cells.centres.push_back(occupied.index_to_scene.point(
                        {i + within(a, pieces[0]), j + within(b, pieces[1]),
                         k + within(c, pieces[2])}));
                }
            }
    return cells;
}

} // namespace

double contact_energy_share(double z_m, double r2_m2, double contact_radius_m) noexcept {
    if (!(z_m > 0.0)) return 0.0;
    const double core = kCore * contact_radius_m;
    const double s = r2_m2 + z_m * z_m + core * core; // above 0
    return 6.0 * contact_radius_m / (std::numbers::pi * std::numbers::pi) * z_m * z_m / (s * s * s);
}

double inclusion_factor(double ratio) noexcept { return 5.0 * (ratio - 1.0) / (2.0 * ratio + 3.0); }

InclusionSum::InclusionSum(const LabelVolume& volume, std::span<const Inclusion> inclusions,
                           double contact_radius_m)
    : contact_radius_m_(contact_radius_m) {
    require("contact_radius_m", contact_radius_m, kPositive);
    for (const Inclusion& inclusion : inclusions) {
        require("ratio", inclusion.ratio, kPositive);
        const Cells cells = cells_of(volume, inclusion, kFinestOfContact * contact_radius_m);
        const double factor = inclusion_factor(inclusion.ratio);
        // As stiff as the tissue around it: nothing is added, to the bit.
        if (cells.centres.empty() || factor == 0.0) continue;
        const std::size_t first = points_.size();
        points_.insert(points_.end(), cells.centres.begin(), cells.centres.end());
        weights_.resize(points_.size(), factor * cells.volume_m3);
        total_ += std::abs(factor) * cells.volume_m3 * static_cast<double>(cells.centres.size());
        split(first, points_.size(), factor * cells.volume_m3);
    }
    for (const Vec3& point : points_)
        bounds_.add(point);
}

/// Makes the part of points [first, last), which all weigh the same, and those in it.
void InclusionSum::split(std::size_t first, std::size_t last, double weight) {
    const auto begin = points_.begin();
    const auto at = [&](std::size_t i) { return begin + static_cast<std::ptrdiff_t>(i); };
    const std::size_t own = parts_.size();
    Part part;
    part.first = first;
    part.last = last;
    const auto count = static_cast<double>(last - first);
    part.centre = std::accumulate(at(first), at(last), Vec3{0.0}) / count;
    part.weight = weight * count;
    Box box;
    for (std::size_t i = first; i < last; ++i) {
        part.radius_m = std::max(part.radius_m, glm::length(points_[i] - part.centre));
        const Vec3 off = points_[i] - part.centre;
        part.variance += off * off / count;
        box.add(points_[i]);
    }
    parts_.push_back(part);
    if (last - first > kFewPoints) {
        const Vec3 extent = box.extent();
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                         : extent.y >= extent.z                       ? 1
                                                                      : 2;
        const std::size_t middle = first + (last - first) / 2;
        // Of equal coordinates the others decide: the same parts whatever the order was.
        std::nth_element(at(first), at(middle), at(last), [axis](const Vec3& a, const Vec3& b) {
            const int second = (axis + 1) % 3, third = (axis + 2) % 3;
            if (a[axis] != b[axis]) return a[axis] < b[axis];
            if (a[second] != b[second]) return a[second] < b[second];
            return a[third] < b[third];
        });
        split(first, middle, weight);
        split(middle, last, weight);
    }
    parts_[own].next = parts_.size();
}

double InclusionSum::gain(const Vec3& point, const Vec3& inward) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < parts_.size();) {
        const Part& part = parts_[i];
        const Vec3 way = part.centre - point;
        const double z = glm::dot(way, inward), far2 = squared_length(way);
        // The kernel has a kink of its second derivative at the surface.
        const bool is_one =
            part.radius_m < std::abs(z) && part.radius_m * part.radius_m < kFar * kFar * far2;
        if (is_one) {
            if (z > 0.0) sum += part.weight * mean_of_part(part, z, far2, inward);
            i = part.next;
        } else if (part.last - part.first <= kFewPoints) {
            for (std::size_t n = part.first; n < part.last; ++n)
                sum += weights_[n] * at_point(points_[n] - point, inward);
            i = part.next;
        } else {
            ++i; // those in it
        }
    }
    return sum;
}

double InclusionSum::at_point(const Vec3& way, const Vec3& inward) const noexcept {
    const double z = glm::dot(way, inward);
    return contact_energy_share(z, std::max(0.0, squared_length(way) - z * z), contact_radius_m_);
}

/// The kernel's mean over a part that is far away. With S its second moments the mean of z^2 is
/// z^2 + n S n, and of the rest, to second order and where S is round, that at tr S / 3 less:
/// z^2 s^-3 has the Laplacian 2 s^-3 + 6 z^2 s^-4 far away.
double InclusionSum::mean_of_part(const Part& part, double z, double far2,
                                  const Vec3& inward) const noexcept {
    const double z2 = z * z + glm::dot(part.variance, inward * inward);
    const double core = kCore * contact_radius_m_;
    const double s =
        far2 + core * core - (part.variance.x + part.variance.y + part.variance.z) / 3.0;
    return 6.0 * contact_radius_m_ / (std::numbers::pi * std::numbers::pi) * z2 / (s * s * s);
}

double InclusionSum::gain_point_by_point(const Vec3& point, const Vec3& inward) const noexcept {
    double sum = 0.0;
    for (std::size_t n = 0; n < points_.size(); ++n)
        sum += weights_[n] * at_point(points_[n] - point, inward);
    return sum;
}

double InclusionSum::reach_m(double gain) const noexcept {
    // w <= (6 a / pi^2) / R^4
    return std::pow(6.0 * contact_radius_m_ * total_ / (std::numbers::pi * std::numbers::pi * gain),
                    0.25);
}

} // namespace palpate
