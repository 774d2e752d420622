// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/patient_size.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace palpate {
namespace {

constexpr double kMmPerM = 1e3;
// Bounds that a file states exactly may round over them on their way to metres.
constexpr double kRounding = 1.0 + 1e-9;

/// "0.5 x 1e+09 x 2 mm"
std::string in_mm(const Vec3& m) {
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "%.4g x %.4g x %.4g mm", kMmPerM * m.x, kMmPerM * m.y,
                  kMmPerM * m.z);
    return text.data();
}

double largest(const Vec3& v) { return std::max({v.x, v.y, v.z}); }
double smallest(const Vec3& v) { return std::min({v.x, v.y, v.z}); }

/// Written so that a NaN is not within.
bool is_within(double value, double low, double high) {
    return value >= low / kRounding && value <= high * kRounding;
}

std::optional<Implausible> implausible_box(const Box& box, const std::string& remedy) {
    using Part = Implausible::Part;
    if (!is_within(largest(box.extent()), 0.0, PatientSize::kLargestExtent))
        return Implausible{Part::spacing, "is " + in_mm(box.extent()) +
                                              " large, where at most 100 m are taken for a "
                                              "patient; " +
                                              remedy};
    const Vec3 farthest = glm::max(glm::abs(box.lower), glm::abs(box.upper));
    if (!is_within(largest(farthest), 0.0, PatientSize::kFarthest))
        return Implausible{Part::place, "lies up to " + in_mm(farthest) +
                                            " from the origin, where at most 1 km is taken for a "
                                            "patient; " +
                                            remedy};
    return std::nullopt;
}

} // namespace

std::string irregularity(const AffineTransform& index_to_scene) {
    // |determinant| / product of column lengths: below this the axes lie in a plane but for
    // rounding of a float header (6e-8 per entry).
    constexpr double kMinAxesVolume = 1e-6;
    double product = 1.0;
    bool finite = is_finite(index_to_scene.offset);
    for (int axis = 0; axis < 3; ++axis) {
        finite = finite && is_finite(index_to_scene.linear[axis]);
        product *= glm::length(index_to_scene.linear[axis]);
    }
    if (!finite) return "is not finite; correct its numbers";
    if (!(product > 0.0) ||
        std::abs(glm::determinant(index_to_scene.linear)) < kMinAxesVolume * product)
        return "is singular: an axis has no length or lies in the plane of the others; correct its "
               "spacing and directions";
    return {};
}

std::optional<Implausible> implausible_grid(const std::array<int, 3>& size,
                                            const AffineTransform& index_to_scene) {
    const Mat3& linear = index_to_scene.linear;
    const Vec3 step(glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2]));
    const auto spacing = [&](const std::string& why) {
        return Implausible{Implausible::Part::spacing,
                           "has voxels of " + in_mm(step) + ", " + why + "; correct their spacing"};
    };
    if (!is_within(smallest(step), PatientSize::kSmallestVoxel, PatientSize::kLargestVoxel) ||
        !is_within(largest(step), PatientSize::kSmallestVoxel, PatientSize::kLargestVoxel))
        return spacing("where 2e-05 mm (20 nm) to 1000 mm are taken for a patient");
    if (!(largest(step) <= PatientSize::kMostUneven * kRounding * smallest(step)))
        return spacing("of which one side is more than 10000 times another");
    Box box;
    for (int corner = 0; corner < 8; ++corner)
        box.add(index_to_scene.point(Vec3((corner & 1) != 0 ? size[0] - 1 : 0,
                                          (corner & 2) != 0 ? size[1] - 1 : 0,
                                          (corner & 4) != 0 ? size[2] - 1 : 0)));
    return implausible_box(box, "correct its size, spacing and origin");
}

std::optional<Implausible> implausible_bounds(const Box& bounds) {
    if (bounds.empty()) return std::nullopt;
    return implausible_box(bounds, "correct its unit (mm or m) or its coordinates");
}

} // namespace palpate
