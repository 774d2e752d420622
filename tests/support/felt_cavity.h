// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/stepping_methods.h"
#include "tests/support/test_meshes.h"

/// The cavity of the paper's experiment, felt in every way that formulas allow, and a helix.
namespace palpate::test {

constexpr double kCavity = 0.05; ///< radius, m

enum class Felt {
    volume,     ///< VolumeContact: anchored at its level
    yielding,   ///< the same with 0.5 N: it is pushed away
    guarded,    ///< GuardedContact over a mesh of 20 480 triangles, which errs by 20 um
    memoryless, ///< GradientSurface, hard everywhere: it remembers no level
    follow,     ///< VectorFollow along a helix, hard: no surface at all
};

inline std::string name_of(Felt felt) {
    return felt == Felt::volume       ? "Volume"
           : felt == Felt::yielding   ? "Yielding"
           : felt == Felt::guarded    ? "Guarded"
           : felt == Felt::memoryless ? "Memoryless"
                                      : "Follow";
}

using MethodAndFelt = std::tuple<SteppingMethod, Felt>;

inline std::string name_of_case(const testing::TestParamInfo<MethodAndFelt>& of) {
    return name_of(std::get<0>(of.param)) + name_of(std::get<1>(of.param));
}

inline std::unique_ptr<ContactLoop> felt_cavity(Felt felt, const SteppingSettings& settings) {
    const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kCavity);
    Surfaces surfaces;
    Effects effects;
    switch (felt) {
    case Felt::volume:
        surfaces = one_surface(field);
        break;
    case Felt::yielding: {
        LevelSettings level;
        level.strength_n = 0.5;
        surfaces = one_surface(field, level);
        break;
    }
    case Felt::guarded: {
        static const auto mesh = certified(reversed(icosphere(kCavity, 5)));
        surfaces.push_back(
            std::make_unique<GuardedContact>(field, LevelSettings{}, mesh, /*leash_m=*/1e-3));
        break;
    }
    case Felt::memoryless:
        effects = memoryless(field, hard_everywhere());
        break;
    case Felt::follow:
        effects.push_back(std::make_unique<VectorFollow>(
            std::shared_ptr<const VectorField>(make_helix(0.02, 0.03)), hard_everywhere()));
        break;
    }
    return loop_of(settings, std::move(surfaces), std::move(effects));
}

} // namespace palpate::test
