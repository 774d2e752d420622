// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/soft_loop.h"

/// Surfaces of which some are soft: layers over one another.
namespace palpate::test {

/// Frames of layers that go on until a step is below 0.1 nm.
inline SteppingSettings precise_layers() { return precise(SteppingMethod::adaptive, 1e-10); }

using Surfaces = std::vector<std::unique_ptr<SurfaceContact>>;

template <class... Contacts>
Surfaces surfaces(Contacts... contacts) {
    Surfaces all;
    (all.push_back(std::move(contacts)), ...);
    return all;
}

inline std::unique_ptr<SurfaceContact> ball(double radius_m) {
    return std::make_unique<VolumeContact>(
        std::shared_ptr<const ScalarField>(make_solid_sphere(radius_m)), LevelSettings{});
}

} // namespace palpate::test
