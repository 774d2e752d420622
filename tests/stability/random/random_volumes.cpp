// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/random_volumes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace palpate::stability {
namespace {

using test::any_vector;
using test::between;
using test::chance;
using test::of_any_size;
using test::pick;
using test::Random;

/// Of n voxels each way about a place, 2.4 size wide.
AffineTransform frame_about(Random& random, int n, double size_m, const Vec3& place) {
    const double h = 2.4 * size_m / n;
    Mat3 axes(h);
    if (chance(random, 0.4)) {
        const Vec3 x = glm::normalize(Vec3{1.0, 0.0, 0.0} + any_vector(random, 0.6));
        const Vec3 y = glm::normalize(glm::cross(Vec3{0.1, 0.2, 1.0}, x));
        const double hand = chance(random, 0.3) ? -1.0 : 1.0;
        axes = h * Mat3(x, between(random, 0.7, 1.3) * y, hand * glm::cross(x, y));
        if (chance(random, 0.3)) axes[1] += 0.2 * axes[0]; // sheared
    }
    return {axes, place - axes * Vec3(0.5 * (n - 1))};
}

template <class Value>
std::shared_ptr<VoxelVolume> filled(const AffineTransform& frame, int n, const Value& value) {
    auto volume = std::make_shared<VoxelVolume>();
    volume->size = {n, n, n};
    volume->index_to_scene = frame;
    volume->values.resize(volume->voxels());
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i)
                volume->values[volume->index(i, j, k)] =
                    static_cast<float>(value(frame.point(Vec3(i, j, k))));
    return volume;
}

} // namespace

RandomVolume random_volume(Random& random, double size_m, const Vec3& place) {
    const int n = 10 + pick(random, 9);
    const AffineTransform frame = frame_about(random, n, size_m, place);
    const double h = 2.4 * size_m / n, wall = between(random, 0.1, 3.0) * h;
    const Vec3 lean = glm::normalize(any_vector(random, 1.0) + Vec3{0.0, 0.0, 1.5});
    const double share = between(random, 0.5, 0.9);
    const auto at = [&](const Vec3& p) { return p - place; };
    const auto ball = [&](const Vec3& p) { return share * size_m - glm::length(at(p)); };
    const auto sheet = [&](const Vec3& p) { return 0.5 * wall - std::abs(glm::dot(lean, at(p))); };
    const auto noise = [&] { return between(random, -1.0, 1.0); };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    using Value = std::function<double(const Vec3&)>;
    const std::array<std::pair<const char*, Value>, 10> kinds{{
        {"ball", ball},
        {"noisy ball", [&](const Vec3& p) { return ball(p) + 0.7 * h * noise(); }},
        {"noise", [&](const Vec3&) { return size_m * noise(); }},
        {"binary ball", [&](const Vec3& p) { return ball(p) > 0.0 ? size_m : -size_m; }},
        {"saddle", [&](const Vec3& p) { return (at(p).x * at(p).x - at(p).z * at(p).z) / size_m; }},
        {"leaning wall", sheet},
        {"two membranes",
         [&](const Vec3& p) {
             return 0.4 * wall - std::abs(std::abs(glm::dot(lean, at(p))) - 0.5 * wall);
         }},
        {"ball with holes that are no numbers",
         [&](const Vec3& p) { return chance(random, 0.05) ? nan : ball(p); }},
        {"saturated", [&](const Vec3& p) { return std::clamp(ball(p), -h, h); }},
        {"wedge", [&](const Vec3& p) { return -std::max(at(p).z, glm::dot(lean, at(p))); }},
    }};
    const auto& [kind, value] = kinds[static_cast<std::size_t>(pick(random, kinds.size()))];
    RandomVolume made;
    made.kind = kind;
    made.value_per_m = of_any_size(random, 1.0, 1e6);
    made.level = chance(random, 0.5) ? 0.0 : made.value_per_m * h * between(random, -0.2, 0.2);
    made.file.volume =
        filled(frame, n, [&, value = value](const Vec3& p) { return made.value_per_m * value(p); });
    return made;
}

VoxelFile random_labels(Random& random, int labels, double size_m, const Vec3& place) {
    const int n = 10 + pick(random, 5);
    const AffineTransform frame = frame_about(random, n, size_m, place);
    return {filled(frame, n,
                   [&](const Vec3& p) {
                       const Vec3 q = p - place;
                       if (glm::length(q) > 0.8 * size_m) return 0.0;
                       if (labels == 1) return 1.0;
                       return q.x < 0.0 ? 1.0 : q.y < 0.0 ? 2.0 : 3.0;
                   }),
            true};
}

VoxelFile labels_of(const LabelVolume& atlas, Random& random, double size_m, const Vec3& place) {
    constexpr int kMostLabels = 6, kLeast = 12, kMost = 20; // voxels along an axis
    const auto& values = atlas.layers.front();
    const std::array<int, 3>& size = atlas.size;
    if (*std::min_element(size.begin(), size.end()) <= kMost)
        throw std::invalid_argument(
            fmt::format("an atlas of {} x {} x {} voxels: give one with more than {} along each "
                        "axis",
                        size[0], size[1], size[2], kMost));
    const int n = kLeast + pick(random, kMost - kLeast + 1);
    std::array<int, 3> low{};
    std::size_t middle = 0; // of the cube
    constexpr int kTries = 100'000;
    int tries = 0;
    do {
        if (++tries > kTries)
            throw std::invalid_argument("an atlas with hardly a label: give another one");
        std::array<std::size_t, 3> at{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = pick(random, size[axis] - n);
            at[axis] = static_cast<std::size_t>(low[axis] + n / 2);
        }
        middle = at[0] + static_cast<std::size_t>(size[0]) *
                             (at[1] + static_cast<std::size_t>(size[1]) * at[2]);
    } while (values[middle] == 0);
    std::map<std::int32_t, int> names{{values[middle], 1}};
    auto volume = std::make_shared<VoxelVolume>();
    volume->size = {n, n, n};
    volume->index_to_scene = frame_about(random, n, size_m, place);
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const std::array<int, 3> at{low[0] + i, low[1] + j, low[2] + k};
                const std::int32_t value = values[static_cast<std::size_t>(at[0]) +
                                                  static_cast<std::size_t>(size[0]) *
                                                      (static_cast<std::size_t>(at[1]) +
                                                       static_cast<std::size_t>(size[1]) *
                                                           static_cast<std::size_t>(at[2]))];
                const auto found = names.find(value);
                if (found == names.end() && value != 0 && names.size() < kMostLabels)
                    names.emplace(value, static_cast<int>(names.size()) + 1);
                const auto name = names.find(value);
                volume->values.push_back(name == names.end() ? 0.0f
                                                             : static_cast<float>(name->second));
            }
    return {volume, true};
}

VoxelFile random_lumps(Random& random, double size_m, const Vec3& place) {
    const int n = 16 + pick(random, 9);
    const AffineTransform frame = frame_about(random, n, size_m, place);
    const Vec3 first = any_vector(random, 0.5 * size_m), second = any_vector(random, 0.5 * size_m);
    const double wide = between(random, 0.1, 0.3) * size_m;
    return {filled(frame, n,
                   [&](const Vec3& p) {
                       const Vec3 q = p - place;
                       if (glm::length(q) > 0.8 * size_m) return 0.0;
                       if (glm::length(q - first) < wide) return 2.0;
                       return glm::length(q - second) < 0.5 * wide ? 3.0 : 1.0;
                   }),
            true};
}

VoxelFile random_sieve(Random& random, double radius_m, double widest_m, double size_m,
                       const Vec3& place) {
    const int n = 16 + pick(random, 9);
    const AffineTransform frame = frame_about(random, n, size_m, place);
    const double wall_m = between(random, 0.5, 3.0) * 2.4 * size_m / n;
    std::vector<std::pair<Vec3, double>> holes; // direction, cosine of half the angle
    for (int i = 1 + pick(random, 4); i > 0; --i)
        holes.emplace_back(glm::normalize(any_vector(random, 1.0)),
                           std::cos(between(random, 0.5, 1.0) * widest_m / radius_m));
    return {filled(frame, n,
                   [&](const Vec3& p) {
                       const double r = glm::length(p - place);
                       for (const auto& [axis, cosine] : holes)
                           if (glm::dot(axis, p - place) > cosine * r) return -size_m;
                       return std::min(radius_m - r, wall_m - (radius_m - r));
                   }),
            false};
}

std::shared_ptr<const VectorVolume> random_vectors(Random& random, double size_m,
                                                   const Vec3& place) {
    const int n = 8 + pick(random, 6);
    auto volume = std::make_shared<VectorVolume>();
    volume->size = {n, n, n};
    volume->index_to_scene = frame_about(random, n, size_m, place);
    const double noise = chance(random, 0.5) ? between(random, 0.0, 0.3) : 2.0;
    const Vec3 mean = any_vector(random, 1.0);
    volume->values.resize(3 * volume->voxels());
    for (std::size_t i = 0; i < volume->voxels(); ++i) {
        const Vec3 v = mean + any_vector(random, noise);
        for (int axis = 0; axis < 3; ++axis)
            volume->values[3 * i + static_cast<std::size_t>(axis)] = static_cast<float>(v[axis]);
    }
    return volume;
}

} // namespace palpate::stability
