// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <palpate/haptics/solver/fixed_vector.h>
#include <palpate/haptics/solver/primitives.h>

namespace palpate::internal {

/// A plane as mixed problems know it: multipliers are lengths, N / k.
struct Hinge {
    Vec3 normal{0.0};      ///< unit
    double bound = 0.0;    ///< sigma = s / k, m
    bool yields = true;    ///< the bound is the strength, not the hard primitives' cap
    std::size_t index = 0; ///< in PrimitiveSet::planes()
};

/// A line or a point. Its offset and its pull are in the coordinates of `across`, so that rounding
/// cannot give a line's pull a component along it.
struct Tether {
    Vec3 axis{0.0};        ///< unit; zero for a point
    Mat3 across{1.0};      ///< columns: two unit vectors across a line, and zero; a point's axes
    double bound = 0.0;    ///< sigma = s / k, m
    std::size_t index = 0; ///< in PrimitiveSet::lines() or points()
};

/// Where the proxy is to each primitive: a plane's gap, the way from a line or a point, m.
struct Offsets {
    FixedVector<double, PrimitiveSet::kCapacity> gap;
    FixedVector<Vec3, PrimitiveSet::kCapacity> way;
};

/// Forces on the proxy over k, m.
struct Multipliers {
    Multipliers(std::size_t hinges, std::size_t tethers) noexcept
        : lambda(hinges, 0.0), pull(tethers, Vec3{0.0}) {}

    FixedVector<double, PrimitiveSet::kCapacity> lambda; ///< along each hinge's normal
    FixedVector<Vec3, PrimitiveSet::kCapacity> pull;     ///< of each tether, in its coordinates
};

/// The usable primitives of a set, seen from a' = a + F0 / k.
struct MixedPrimitives {
    FixedVector<Hinge, PrimitiveSet::kCapacity> hinges;
    FixedVector<Tether, PrimitiveSet::kCapacity> tethers; ///< lines first
    std::size_t line_count = 0;
    double scale = 0.0; ///< distance of the furthest anchor, m
    Offsets at_target;  ///< of a' itself

    /// Bounds in m; `stiffness` k in N/m, > 0.                                          [loop]
    MixedPrimitives(const PrimitiveSet& primitives, const Vec3& target, double stiffness) noexcept;

    Vec3 sum(const Multipliers& multipliers) const noexcept;              ///< scene frame, m
    double sum_of_lengths(const Multipliers& multipliers) const noexcept; ///< m
    double largest_change(const Multipliers& from, const Multipliers& to) const noexcept; ///< m
    /// `offsets` after the proxy has moved by `step`, m, scene frame.
    Offsets moved(const Offsets& offsets, const Vec3& step) const noexcept;
};

/// Coordinates across a line along the unit vector `axis`: see Tether::across.
Mat3 across_of(const Vec3& axis) noexcept;

} // namespace palpate::internal
