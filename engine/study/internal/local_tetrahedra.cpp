// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/local_tetrahedra.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <palpate/engine/study/internal/held_planes.h>

namespace palpate::internal {
namespace {

constexpr double kCoarsest_m = 1e-3; // of the lattice; a grid's own spacing where that is finer
constexpr double kNudge = 1e-6;      // m in front of a facet, for segments that leave it
constexpr double kStill = 1e-9;      // m: a way that is none
constexpr int kMostTries = 16;       // of a frame: segments that are followed
constexpr std::size_t kCorners = 1 << 14; // that are kept: more than a frame meets

class LocalTetrahedra final : public Baseline {
public:
    explicit LocalTetrahedra(TetrahedralLevel level) : level_(std::move(level)) {}
    void restart(const Vec3& probe) noexcept override { proxy_ = probe; }
    Step move(const Vec3& probe) noexcept override {
        HeldPlanes held;
        bool touches = false;
        for (int tries = 0; tries < kMostTries && !held.is_full(); ++tries) {
            const Vec3 goal = held.goal(proxy_, probe);
            const std::optional<TetrahedralLevel::Hit> hit = level_.met(proxy_, goal);
            const Vec3 next = hit ? hit->position + kNudge * hit->normal : goal;
            const double way_m = glm::length(next - proxy_);
            proxy_ = next;
            if (hit) {
                touches = true;
                held.add(hit->normal);
                continue;
            }
            // At its goal: beyond the end of a facet the next one may lie farther back.
            if (way_m < kStill || goal == probe) break;
            held.clear();
        }
        return {proxy_, touches};
    }
    std::uint64_t samples() const noexcept override { return level_.samples(); }

private:
    TetrahedralLevel level_;
    Vec3 proxy_{0.0};
};

/// Where a coordinate that goes from `at` by `way` next is an integer, as a share of the way
/// beyond `share`; none where it does not move.
double next_integer(double at, double way, double share) noexcept {
    if (way == 0.0) return std::numeric_limits<double>::infinity();
    const double here = at + share * way;
    const double target = way > 0.0 ? std::floor(here) + 1.0 : std::ceil(here) - 1.0;
    return (target - at) / way;
}

} // namespace

TetrahedralLevel::TetrahedralLevel(std::shared_ptr<const ScalarField> field, double level,
                                   double spacing_m)
    : field_(std::move(field)), sampler_(field_->make_sampler()), level_(level),
      spacing_m_(spacing_m), kept_(kCorners) {}

double TetrahedralLevel::value_at(const Corner& corner) noexcept {
    const auto hash = static_cast<std::uint64_t>(corner[0]) * 73856093u ^
                      static_cast<std::uint64_t>(corner[1]) * 19349663u ^
                      static_cast<std::uint64_t>(corner[2]) * 83492791u;
    Kept& kept = kept_[hash % kCorners];
    if (!kept.is_there || kept.corner != corner) {
        const Vec3 point(static_cast<double>(corner[0]), static_cast<double>(corner[1]),
                         static_cast<double>(corner[2]));
        kept = {corner, sampler_->value(spacing_m_ * point), true};
    }
    return kept.value;
}

TetrahedralLevel::Linear TetrahedralLevel::linear_at(const Vec3& x) noexcept {
    const Vec3 floor = glm::floor(x);
    Corner corner{static_cast<std::int64_t>(floor.x), static_cast<std::int64_t>(floor.y),
                  static_cast<std::int64_t>(floor.z)};
    const Vec3 inside = x - floor;
    std::array<int, 3> axes{0, 1, 2};
    std::sort(axes.begin(), axes.end(), [&](int a, int b) { return inside[a] > inside[b]; });
    Linear linear{floor, value_at(corner), Vec3{0.0}};
    double before = linear.value;
    for (const int axis : axes) {
        ++corner[static_cast<std::size_t>(axis)];
        const double value = value_at(corner);
        linear.slope[axis] = value - before;
        before = value;
    }
    return linear;
}

std::optional<TetrahedralLevel::Hit> TetrahedralLevel::met(const Vec3& from,
                                                           const Vec3& to) noexcept {
    const Vec3 start = from / spacing_m_;
    const Vec3 way = (to - from) / spacing_m_;
    if (!is_finite(start) || !is_finite(way)) return {};
    double share = 0.0;
    for (int passed = 0; passed < kMostTetrahedra && share < 1.0; ++passed) {
        // The next face of a tetrahedron: a coordinate, or the difference of two, is an integer.
        double end = 1.0;
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            end = std::min(end, next_integer(start[i], way[i], share));
            end = std::min(end, next_integer(start[i] - start[j], way[i] - way[j], share));
        }
        constexpr double least = 1e-14; // of the way: rounding at a face must not hold it up
        end = std::max(end, share + least);
        const Linear linear = linear_at(start + 0.5 * (share + end) * way);
        const double before = linear(start + share * way) - level_;
        const double after = linear(start + std::min(end, 1.0) * way) - level_;
        const double length = glm::length(linear.slope);
        if (after >= 0.0 && after > before && length > 0.0) {
            const double part = before < 0.0 ? before / (before - after) : 0.0;
            const double at = share + part * (std::min(end, 1.0) - share);
            return Hit{from + at * (to - from), -linear.slope / length};
        }
        share = end;
    }
    return {};
}

std::unique_ptr<Baseline> make_local_tetrahedra(std::shared_ptr<const ScalarField> field,
                                                double level) {
    const double spacing_m = std::min(kCoarsest_m, field->feature_size_m());
    return std::make_unique<LocalTetrahedra>(TetrahedralLevel(std::move(field), level, spacing_m));
}

} // namespace palpate::internal
