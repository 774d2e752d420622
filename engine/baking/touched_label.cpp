// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/touched_label.h>

namespace palpate {
namespace {

constexpr double kLook_m = 0.25e-3; // a half of the finest voxels that labels come in

} // namespace

std::string_view touched_label(const LabelProbe& labels, const Touch& touch) noexcept {
    constexpr int kLooks = static_cast<int>(kLabelReach_m / kLook_m);
    for (int i = 0; i <= kLooks; ++i)
        if (const auto name = labels.name_at(touch.point - i * kLook_m * touch.normal);
            !name.empty())
            return name;
    return {};
}

} // namespace palpate
