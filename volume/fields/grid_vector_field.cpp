// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/grid_vector_field.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include <palpate/volume/fields/internal/principal_axis.h>

namespace palpate {
namespace {

// Steps that are combinations of each other up to rounding, relative to the box that they span.
constexpr double kSingular = 1e-9;
// The principal direction is told apart where the next eigenvalue is smaller by this share of the
// largest: 10 roundings of the floats that are stored.
constexpr double kDistinct = 1e-6;

void check(const VectorVolume& volume, VectorSense sense) {
    const bool tensors = volume.kind == VectorVolume::Kind::symmetric_tensor;
    if (*std::min_element(volume.size.begin(), volume.size.end()) < 2)
        throw std::invalid_argument(
            "vector volume: it has fewer than two voxels along an axis; give at least two to "
            "interpolate between");
    if (volume.components != (tensors ? 6 : 3) ||
        volume.values.size() != volume.voxels() * static_cast<std::size_t>(volume.components))
        throw std::invalid_argument("vector volume: " + std::to_string(volume.values.size()) +
                                    " values for " + std::to_string(volume.voxels()) +
                                    " voxels; give 3 each for vectors, 6 for tensors");
    if (tensors && sense == VectorSense::directed)
        throw std::invalid_argument(
            "vector volume: tensors have no sense; take them as axial directions");
    const Mat3& m = volume.index_to_scene.linear;
    const double box = glm::length(m[0]) * glm::length(m[1]) * glm::length(m[2]);
    const bool finite = is_finite(m[0]) && is_finite(m[1]) && is_finite(m[2]) &&
                        is_finite(volume.index_to_scene.offset);
    if (!finite || !(std::abs(glm::determinant(m)) > kSingular * box))
        throw std::invalid_argument("vector volume: its index_to_scene is singular or not finite; "
                                    "correct directions and spacing");
}

/// v v^T of every vector, packed as tensors are.
std::vector<float> squares(std::span<const float> vectors) {
    std::vector<float> tensors;
    tensors.reserve(2 * vectors.size());
    for (std::size_t n = 0; n + 3 <= vectors.size(); n += 3)
        for (std::size_t row = 0; row < 3; ++row)
            for (std::size_t column = row; column < 3; ++column)
                tensors.push_back(vectors[n + row] * vectors[n + column]);
    return tensors;
}

} // namespace

class GridVectorSampler final : public VectorSampler {
public:
    explicit GridVectorSampler(const GridVectorField& field) noexcept : field_(field) {}

    VectorSample sample(const Vec3& point) noexcept override {
        ++samples_;
        if (!find_cell(point)) return {};
        return field_.kind_ == GridVectorField::Kind::directed ? directed() : axial();
    }

private:
    /// Number `component` at corner a + 2 b + 4 c of the cell.
    double corner(std::size_t n, std::size_t component) const noexcept {
        return field_.values_[corner_[n] + component];
    }

    /// The cell that holds a point, and where in it; false outside and without data.
    bool find_cell(const Vec3& point) noexcept {
        const Vec3 index = field_.scene_to_index_.point(point);
        std::array<std::size_t, 3> low{};
        for (int axis = 0; axis < 3; ++axis) {
            const int nodes = field_.size_[static_cast<std::size_t>(axis)];
            if (!(index[axis] >= 0.0 && index[axis] <= nodes - 1.0)) return false; // NaN, too
            const double node = std::min(std::floor(index[axis]), nodes - 2.0);
            at_[axis] = index[axis] - node;
            low[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(node);
        }
        const auto row = static_cast<std::size_t>(field_.size_[0]);
        const auto slice = row * static_cast<std::size_t>(field_.size_[1]);
        const auto components = static_cast<std::size_t>(field_.components_);
        for (std::size_t n = 0; n < corner_.size(); ++n) {
            const std::size_t voxel =
                low[0] + (n & 1) + row * (low[1] + (n >> 1 & 1)) + slice * (low[2] + (n >> 2));
            corner_[n] = components * voxel;
            for (std::size_t component = 0; component < components; ++component)
                if (!std::isfinite(corner(n, component))) return false;
        }
        return true;
    }

    /// Trilinear value of a component, and its derivative by i, j, k.
    double interpolate(std::size_t component, Vec3& by_index) const noexcept {
        const auto v = [&](std::size_t n) { return corner(n, component); };
        const auto between = [](double a, double b, double t) { return a + t * (b - a); };
        std::array<double, 4> at_i{};
        std::array<double, 4> by_i{};
        for (std::size_t e = 0; e < 4; ++e) {
            by_i[e] = v(2 * e + 1) - v(2 * e);
            at_i[e] = v(2 * e) + at_.x * by_i[e];
        }
        const double low = between(at_i[0], at_i[1], at_.y);
        const double high = between(at_i[2], at_i[3], at_.y);
        by_index = {
            between(between(by_i[0], by_i[1], at_.y), between(by_i[2], by_i[3], at_.y), at_.z),
            between(at_i[1] - at_i[0], at_i[3] - at_i[2], at_.z), high - low};
        return between(low, high, at_.z);
    }

    VectorSample directed() const noexcept {
        VectorSample s;
        Mat3 rows; // column c: the derivative of component c by i, j, k
        for (std::size_t c = 0; c < 3; ++c)
            s.value[static_cast<int>(c)] = interpolate(c, rows[static_cast<int>(c)]);
        s.derivative = glm::transpose(rows) * field_.scene_to_index_.linear;
        s.valid = true;
        return s;
    }

    VectorSample axial() const noexcept {
        std::array<double, 6> t{};
        Vec3 unused;
        for (std::size_t c = 0; c < t.size(); ++c)
            t[c] = interpolate(c, unused);
        const Mat3 tensor(t[0], t[1], t[2], t[1], t[3], t[4], t[2], t[4], t[5]);
        const internal::PrincipalAxis principal = internal::principal_axis(tensor);
        if (!(principal.largest > 0.0) ||
            principal.largest - principal.second < kDistinct * principal.largest)
            return {};
        const bool of_tensors = field_.kind_ == GridVectorField::Kind::tensor;
        // The trace of a mean of v v^T is the mean of |v|^2.
        const double length = of_tensors ? internal::anisotropy(tensor)
                                         : std::sqrt(std::max(0.0, t[0] + t[3] + t[5]));
        return {length * principal.axis, Mat3(0.0), true};
    }

    const GridVectorField& field_;
    std::array<std::size_t, 8> corner_{}; // of the cell: where its numbers begin
    Vec3 at_{0.0};                        // in [0, 1]^3
};

GridVectorField::GridVectorField(const VectorVolume& volume, VectorSense sense)
    : size_(volume.size), index_to_scene_(volume.index_to_scene) {
    check(volume, sense);
    scene_to_index_ = index_to_scene_.inverse();
    if (volume.kind == VectorVolume::Kind::symmetric_tensor) {
        kind_ = Kind::tensor;
        values_.assign(volume.values.begin(), volume.values.end());
    } else if (sense == VectorSense::axial) {
        kind_ = Kind::axial;
        values_ = squares(volume.values);
    } else {
        kind_ = Kind::directed;
        values_.assign(volume.values.begin(), volume.values.end());
    }
    components_ = kind_ == Kind::directed ? 3 : 6;
}

std::unique_ptr<VectorSampler> GridVectorField::make_sampler() const {
    return std::make_unique<GridVectorSampler>(*this);
}

Box GridVectorField::bounds() const {
    Box box;
    for (int n = 0; n < 8; ++n) {
        const Vec3 corner((n & 1) * (size_[0] - 1), (n >> 1 & 1) * (size_[1] - 1),
                          (n >> 2) * (size_[2] - 1));
        box.add(index_to_scene_.point(corner));
    }
    return box;
}

double GridVectorField::feature_size_m() const noexcept {
    const Mat3& m = index_to_scene_.linear;
    return std::min({glm::length(m[0]), glm::length(m[1]), glm::length(m[2])});
}

} // namespace palpate
