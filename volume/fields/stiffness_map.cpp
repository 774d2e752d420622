// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/stiffness_map.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace palpate {
namespace {

/// The three nodes along an axis that a place sees, what they weigh, and how that changes.
struct Taps {
    int first = 0;
    std::array<double, 3> weight{};
    std::array<double, 3> slope{}; // per node distance
};

Taps taps_at(double place) noexcept {
    const double nearest = std::round(place);
    const double t = place - nearest; // [-1/2, 1/2]
    return {static_cast<int>(nearest) - 1,
            {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)},
            {t - 0.5, -2.0 * t, t + 0.5}};
}

} // namespace

StiffnessMap::StiffnessMap(const Lattice& lattice, std::vector<float> gains)
    : lattice_(lattice), gains_(std::move(gains)) {
    const bool has_nodes =
        std::all_of(lattice.size.begin(), lattice.size.end(), [](int size) { return size > 0; });
    if (!has_nodes || !(lattice.spacing_m > 0.0) || !std::isfinite(lattice.spacing_m))
        throw std::invalid_argument("stiffness map: the lattice has no nodes, or no spacing; give "
                                    "sizes and a spacing above 0");
    if (gains_.size() != lattice.nodes())
        throw std::invalid_argument("stiffness map: there are not as many gains as nodes; give one "
                                    "for each");
    if (!std::all_of(gains_.begin(), gains_.end(),
                     [](float gain) { return gain > -1.0F && std::isfinite(gain); }))
        throw std::invalid_argument("stiffness map: a gain is not above -1, or not finite; correct "
                                    "it");
}

StiffnessMap::Sample StiffnessMap::sample(const Vec3& point) const noexcept {
    const Vec3 place = (point - lattice_.origin) / lattice_.spacing_m;
    std::array<Taps, 3> taps;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(place[axis] > -1.5 &&
              place[axis] < lattice_.size[static_cast<std::size_t>(axis)] + 0.5))
            return {};
        taps[static_cast<std::size_t>(axis)] = taps_at(place[axis]);
    }
    Sample sample;
    for (std::size_t c = 0; c < 3; ++c) {
        const int k = taps[2].first + static_cast<int>(c);
        if (k < 0 || k >= lattice_.size[2]) continue;
        for (std::size_t b = 0; b < 3; ++b) {
            const int j = taps[1].first + static_cast<int>(b);
            if (j < 0 || j >= lattice_.size[1]) continue;
            double sum = 0.0, slope = 0.0; // along x
            for (std::size_t a = 0; a < 3; ++a) {
                const int i = taps[0].first + static_cast<int>(a);
                if (i < 0 || i >= lattice_.size[0]) continue;
                const double gain = static_cast<double>(gains_[lattice_.index(i, j, k)]);
                sum += taps[0].weight[a] * gain;
                slope += taps[0].slope[a] * gain;
            }
            sample.ratio += taps[2].weight[c] * taps[1].weight[b] * sum;
            sample.gradient += Vec3{taps[2].weight[c] * taps[1].weight[b] * slope,
                                    taps[2].weight[c] * taps[1].slope[b] * sum,
                                    taps[2].slope[c] * taps[1].weight[b] * sum};
        }
    }
    sample.gradient /= lattice_.spacing_m;
    return sample;
}

} // namespace palpate
