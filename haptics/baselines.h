// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include <palpate/volume/scalar_field.h>

namespace palpate {

/// Methods from before the paper, to compare with: each in its plainest form, over a field's level,
/// hard, without friction. For studies alone; scenes cannot choose them.
enum class BaselineKind {
    penalty,       ///< no proxy: the depth along the gradient at the probe
    god_object,    ///< Zilles and Salisbury (1995), on a field: the probe onto the tangent plane at
                   ///< the proxy, one step back to the level
    virtual_proxy, ///< Ruspini et al. (1997): a ball that slides as far as it is free
    ikits,         ///< Ikits et al. (2003): the way along the tangent planes, by Runge and Kutta
};
inline constexpr std::array kBaselines{BaselineKind::penalty, BaselineKind::god_object,
                                       BaselineKind::virtual_proxy, BaselineKind::ikits};

std::string_view name(BaselineKind kind) noexcept; ///< [any]
/// What the method gets wrong, in a clause.                                              [any]
std::string_view weakness(BaselineKind kind) noexcept;

/// One loop's state of a baseline. Scene frame, m. Not for two threads at once.
class Baseline {
public:
    virtual ~Baseline() = default;

    /// The proxy is set to `probe`; it begins in free space.                             [loop]
    virtual void restart(const Vec3& probe) noexcept = 0;

    struct Step {
        Vec3 proxy{0.0};
        bool touches = false;
    };
    /// One frame: the proxy for a probe.                                                [loop]
    virtual Step move(const Vec3& probe) noexcept = 0;

    virtual std::uint64_t samples() const noexcept = 0; ///< of the field, so far          [any]
};

/// A baseline over the level of a field, which must outlive it; `radius_m` > 0: of virtual_proxy's
/// ball.   [setup]
std::unique_ptr<Baseline> make_baseline(BaselineKind kind, const ScalarField& field, double level,
                                        double radius_m = 1e-3);

} // namespace palpate
