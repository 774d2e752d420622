// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/scene/scene_description.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/fields/stiffness_map.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/volume_parts.h>

namespace palpate {

/// What lies beneath a soft surface, as it is felt from above.
struct BakedStiffness {
    std::shared_ptr<const StiffnessMap> map; ///< scene frame; null: nothing does
    double contact_radius_m = 0.0; ///< of the kernel: the scene's, or as much wider as the coupling
                                   ///< asks for, m
    double asked_radius_m = 0.0;   ///< the scene's, m
    std::string lumps;             ///< what lies beneath, as "Nodule 10x"
    double stiffest = 1.0;         ///< greatest ratio on the surface
    double softest = 1.0;          ///< least ratio on it
    double steepest_per_m = 0.0;   ///< greatest change of its logarithm along the surface, 1/m
    Vec3 steepest_at{0.0};         ///< where that is, m, scene frame
    bool from_cache = false;       ///< read from the cache, not computed
};

/// A field made ready for one surface: smoothed, its level chosen again, unwanted components
/// removed. Mesh and contact take the same one, so that they are of the same thing.
struct BakedSurface {
    std::shared_ptr<const ScalarField> field; ///< scene frame, own unit; null: a mesh alone
    std::shared_ptr<const GridField> grid;    ///< the same when it is a grid; null for a formula or
                                              ///< a field of the program's own
    double level = 0.0;                       ///< the field's unit
    SurfaceShift shift;                       ///< against the surface before smoothing
    double volume_before_mm3 = 0.0; ///< enclosed before smoothing; of labels: of their voxels
    double volume_mm3 = 0.0;        ///< enclosed by what is kept
    std::vector<VolumeComponent>
        components;                  ///< of the material, largest first; empty for a formula
    std::vector<std::string> labels; ///< names of those it is made of; empty: an isosurface
    bool joined = false;      ///< to labels of other surfaces, without_grooves(): it reaches about
                              ///< smooth_voxels into them, which volume_mm3 does not count
    BakedStiffness stiffness; ///< not of the field: made for each scene
    std::vector<ThinPart> thin_parts;  ///< of labels: what smoothing took away
    std::vector<std::string> warnings; ///< of reading the volume
    std::string key;                   ///< hash of everything that went in: names it in the cache
    bool from_cache = false;           ///< read from the cache, not computed
};

/// A surface of a formula or of a field of the program's own, as it is: of `field`.       [setup]
/// Throws std::runtime_error "FILE:LINE: [surface.bone]: what is wrong; what to do" where the
/// field has no such level.
BakedSurface bake_formula(const SceneDescription& scene, const std::string& surface,
                          std::shared_ptr<const ScalarField> field);

/// Labels of other surfaces of the scene that are felt as this one is: made of labels of the same
/// volume in the same way, whole, smoothed, hard wherever they are. Along borders with these it is
/// baked without a groove: nobody can tell them apart by pressing, and a groove that is narrower
/// than the voxels is theirs, not the anatomy's. Empty where this one is no such surface.  [setup]
std::vector<std::string> labels_felt_alike(const SceneDescription& scene,
                                           const std::string& surface);

} // namespace palpate
