// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include <palpate/volume/scalar_field.h>

namespace palpate {

/// Methods to compare with, up to the paper's own and one after it: each in its plainest form, over
/// a field's level or on a mesh, without friction; hard, but for `primitives` and `subdivided`. For
/// studies alone; scenes cannot choose them.
enum class BaselineKind {
    penalty,       ///< no proxy: the depth along the gradient at the probe
    god_object,    ///< Zilles and Salisbury (1995), on a field: the probe onto the tangent plane at
                   ///< the proxy, one step back to the level
    virtual_proxy, ///< Ruspini et al. (1997): a ball that slides as far as it is free
    linear,        ///< the way along the tangent plane at the proxy, in one step
    ikits,         ///< Ikits et al. (2003): the way along the tangent planes, by Runge and Kutta
    primitives,    ///< haptic primitives before the paper: a yielding plane through the proxy
                   ///< across the gradient, one step; kPrimitiveStrength_n, kPrimitiveRamp_m
    subdivided,    ///< the paper: the same in kPaperSubSteps sub-steps
    local_tetrahedra, ///< Corenthy et al. (2015): a god-object on facets of marching tetrahedra,
                      ///< made around it, with continuous collision
    finger_proxy, ///< CHAI3D's way after Ruspini et al. (1997) and Zilles and Salisbury (1995): a
                  ///< point on a mesh, held by up to three facets, all found in one frame
};
/// All that go over a level, in the order in which a study runs them; finger_proxy comes after
/// them, where there is a mesh.
inline constexpr std::array kBaselines{BaselineKind::penalty,       BaselineKind::god_object,
                                       BaselineKind::virtual_proxy, BaselineKind::linear,
                                       BaselineKind::ikits,         BaselineKind::primitives,
                                       BaselineKind::subdivided,    BaselineKind::local_tetrahedra};

// Haptic primitives have no level: a strength that grows with the value stands for it. It grows
// over more than a frame's way, so that a step does not miss it.
inline constexpr double kPrimitiveStrength_n = 5.0; ///< at the level and behind it
inline constexpr double kPrimitiveRamp_m = 0.25e-3; ///< in front of the level, where it begins
inline constexpr int kPaperSubSteps = 46;           ///< the paper's average in 0.9 ms

std::string_view name(BaselineKind kind) noexcept; ///< [any]
/// What the method gets wrong, in a clause.                                              [any]
std::string_view weakness(BaselineKind kind) noexcept;

/// One loop's state of a baseline. Scene frame, m. Not for two threads at once.
class Baseline {
public:
    virtual ~Baseline() = default;

    /// The proxy is set to `probe`; it begins in free space.                             [loop]
    virtual void restart(const Vec3& probe) noexcept = 0;

    /// What a frame of a baseline gives.
    struct Step {
        Vec3 proxy{0.0};      ///< m, scene frame
        bool touches = false; ///< the surface pushes
    };
    /// One frame: the proxy for a probe.                                                [loop]
    virtual Step move(const Vec3& probe) noexcept = 0;

    virtual std::uint64_t samples() const noexcept = 0; ///< of the field, or rays, so far [any]
};

/// A baseline over the level of a field; `radius_m` > 0: of virtual_proxy's ball. Throws
/// std::invalid_argument where it is not, the level is no number, there is no field, or the kind is
/// finger_proxy, which needs a mesh.                                                     [setup]
std::unique_ptr<Baseline> make_baseline(BaselineKind kind, std::shared_ptr<const ScalarField> field,
                                        double level, double radius_m = 1e-3);

} // namespace palpate
