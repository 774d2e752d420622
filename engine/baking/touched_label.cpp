// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/touched_label.h>

#include <algorithm>

namespace palpate {
namespace {

constexpr double kLook_m = 0.25e-3; // between two looks, at most: a half of the usual voxels
constexpr double kOfVoxel = 0.5;    // of the finest, where that is less
constexpr double kReachOfVoxel =
    1.5; // of the coarsest: so far in front of its label lies a surface
constexpr double kMostLooks = 256.0;

} // namespace

std::string_view touched_label(const LabelProbe& labels, const Touch& touch) noexcept {
    const double reach_m = std::max(kLabelReach_m, kReachOfVoxel * labels.coarsest_m());
    const double look_m =
        std::max(std::min(kLook_m, kOfVoxel * labels.finest_m()), reach_m / kMostLooks);
    const int looks = static_cast<int>(reach_m / look_m);
    for (int i = 0; i <= looks; ++i)
        if (const auto name =
                labels.name_at(touch.surface, touch.point - i * look_m * touch.normal);
            !name.empty())
            return name;
    return {};
}

} // namespace palpate
