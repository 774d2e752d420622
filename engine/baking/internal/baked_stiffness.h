// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/volume/filters/lump_stiffness.h>
#include <palpate/volume/label_volume.h>

namespace palpate::internal {

/// Up to which change of the stiffness along a surface, 1/m of its logarithm, a loop is safe:
/// |grad K| delta <= k at the largest delta, the force limit over K. [setup]
double steepest_allowed_per_m(const SceneDescription& scene);

/// The map of a surface over `inclusions`: of the first contact radius, from `contact_radius_m` on,
/// with which no change is steeper than `steepest_per_m`. Each radius that is tried is wider than
/// the one before by the root of how much too steep that was, and at least by kWidening. [setup]
/// The stiffness is that of the kernel at the point of the surface that is nearest to a node, along
/// the mean normal of the surface within the contact, as a flat contact lies on it. `lumps` and
/// `from_cache` are left to the caller. Throws std::runtime_error without place where no radius
/// does.
BakedStiffness map_stiffness(const BakedSurface& baked, const LabelVolume& volume,
                             std::span<const Inclusion> inclusions, double contact_radius_m,
                             double steepest_per_m);

/// Least factor between two contact radii that map_stiffness() tries.
inline constexpr double kWidening = 1.1;

/// What lies beneath a surface of a scene, which was baked from these labels. `place` begins
/// messages: "FILE:LINE: [surface.body]". Throws std::runtime_error where a label does not exist,
/// is named twice, or lies outside of the surface, and as map_stiffness().             [setup]
BakedStiffness bake_stiffness(const SceneDescription& scene, const std::string& surface,
                              const BakedSurface& baked, const LabelVolume& volume,
                              const std::string& place);

/// As a .vdb whose values are the map's gains, with all else as metadata; and back. [setup]
/// Throws std::exception where it is no such file, or cannot be written.
void write_stiffness(const BakedStiffness& stiffness, const std::filesystem::path& file);
/// What write_stiffness() wrote; from_cache is true. [setup]
BakedStiffness read_stiffness(const std::filesystem::path& file);

} // namespace palpate::internal
