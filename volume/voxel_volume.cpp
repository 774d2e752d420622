// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/voxel_volume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>

namespace palpate {
namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;

// Below this an axis is said to run straight: the words show tenths of a degree.
constexpr double kStraightDegrees = 0.05;

struct AxisWords {
    const char* positive;
    const char* negative;
};
constexpr std::array<AxisWords, 3> kPatientAxes{
    {{"left", "right"}, {"posterior", "anterior"}, {"superior", "inferior"}}};

/// Patient axis 0, 1, 2 for i, j, k: each once, and together as parallel as possible, so that the
/// words stay distinct for a volume that lies at 45 degrees.
std::array<int, 3> patient_axes(const Mat3& directions) {
    std::array<int, 3> order{0, 1, 2};
    std::array<int, 3> best = order;
    double most = -1.0;
    do {
        double sum = 0.0;
        for (int index = 0; index < 3; ++index)
            sum += std::abs(directions[index][order[static_cast<std::size_t>(index)]]);
        if (sum > most) {
            most = sum;
            best = order;
        }
    } while (std::next_permutation(order.begin(), order.end()));
    return best;
}

std::string degrees_off(double cosine) {
    const double degrees = std::acos(std::clamp(std::abs(cosine), 0.0, 1.0)) * kDegreesPerRadian;
    if (degrees < kStraightDegrees) return {};
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), " (%.1f degrees off)", degrees);
    return text.data();
}

} // namespace

std::array<double, 2> value_range(const VoxelVolume& volume) noexcept {
    // Values side by side do not wait for each other, so a compiler takes a vector of them at once.
    constexpr std::size_t kLanes = 16;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::array<float, kLanes> smallest, largest;
    smallest.fill(kInfinity);
    largest.fill(-kInfinity);
    const auto see = [&](std::size_t lane, float value) {
        const bool finite = std::abs(value) < kInfinity; // false for NaN
        const float low = finite ? value : kInfinity;
        const float high = finite ? value : -kInfinity;
        smallest[lane] = low < smallest[lane] ? low : smallest[lane];
        largest[lane] = high > largest[lane] ? high : largest[lane];
    };
    const std::size_t count = volume.values.size();
    for (std::size_t first = 0; first + kLanes <= count; first += kLanes)
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            see(lane, volume.values[first + lane]);
    for (std::size_t n = count - count % kLanes; n < count; ++n)
        see(0, volume.values[n]);
    const float low = *std::min_element(smallest.begin(), smallest.end());
    if (low == kInfinity) return {0.0, 0.0}; // none is finite
    return {low, *std::max_element(largest.begin(), largest.end())};
}

std::string orientation_in_words(const VoxelVolume& volume) {
    Mat3 directions = volume.index_to_scene.linear;
    for (int index = 0; index < 3; ++index)
        directions[index] = glm::normalize(directions[index]);
    const std::array<int, 3> axes = patient_axes(directions);

    std::array<std::string, 3> corner; // by patient axis
    std::string runs;
    for (int index = 0; index < 3; ++index) {
        const auto axis = static_cast<std::size_t>(axes[static_cast<std::size_t>(index)]);
        const double cosine = directions[index][static_cast<int>(axis)];
        const AxisWords& words = kPatientAxes[axis];
        const bool positive = cosine >= 0.0;
        corner[axis] = positive ? words.negative : words.positive; // it runs away from there
        runs += std::array{"; i runs to the patient's ", ", j ",
                           ", k "}[static_cast<std::size_t>(index)];
        runs += positive ? words.positive : words.negative;
        runs += degrees_off(cosine);
    }
    return "voxel 0,0,0 lies " + corner[0] + ", " + corner[1] + ", " + corner[2] + runs;
}

} // namespace palpate
