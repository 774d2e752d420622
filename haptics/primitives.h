// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <palpate/geometry/vec.h>

namespace palpate {

/// A plane that holds the proxy on its normal's side and yields above its strength:
/// P = +lambda n, lambda in [0, s], while n.(x - p) < 0.                     numerics 1.1
struct PlanePrimitive {
    Vec3 anchor{0.0};        ///< p: a point of the plane, m, scene frame
    Vec3 normal{0.0};        ///< n: unit, towards free space
    double strength_n = 0.0; ///< s: N, >= 0; infinite: a constraint
};

/// The haptic primitives of one evaluation: planes in a fixed capacity, forces merged into one.
class PrimitiveSet {
public:
    static constexpr std::size_t kCapacity = 16;

    void clear() noexcept {
        count_ = 0;
        force_ = Vec3{0.0};
        overflowed_ = false;
    }

    /// Adds a plane; a plane beyond the capacity is left out and remembered as overflow.   [loop]
    void add(const PlanePrimitive& plane) noexcept {
        if (count_ == kCapacity) {
            overflowed_ = true;
            return;
        }
        planes_[count_++] = plane;
    }

    /// Adds a constant force d in N; several merge exactly: a' = a + sum d / k.            [loop]
    void add_force(const Vec3& force) noexcept { force_ += force; }

    std::span<const PlanePrimitive> planes() const noexcept { return {planes_.data(), count_}; }
    const Vec3& force() const noexcept { return force_; }
    bool overflowed() const noexcept { return overflowed_; }

private:
    std::array<PlanePrimitive, kCapacity> planes_{};
    std::size_t count_ = 0;
    Vec3 force_{0.0};
    bool overflowed_ = false;
};

} // namespace palpate
