// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <palpate/engine/baking/label_probe.h>
#include <palpate/haptics/stepping/touch.h>

namespace palpate {

/// Name of the label that a contact is with, of those that its surface is made of or is closed
/// against: that of the first such voxel behind the contact, along its normal, at most
/// kLabelReach_m deep, or 1.5 of the thickest voxels. A smoothed surface lies up to a voxel beside
/// its labels' own border. So within a voxel of where two labels meet, of one surface or of two
/// that are closed against each other, the name may be the neighbour's. Empty where no label is
/// behind: a surface that is not made of labels, far in front of them by a texture, or a mesh
/// alone. Lives as long as `labels`. [any]
std::string_view touched_label(const LabelProbe& labels, const Touch& touch) noexcept;

/// How deep behind a contact touched_label() looks, m: some voxels of the usual scans.
inline constexpr double kLabelReach_m = 3e-3;

} // namespace palpate
