// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <palpate/haptics/solver/primitives.h>

/// Seeded sets of primitives that are hard to solve, the same on every machine.
namespace palpate::test {

/// splitmix64, and what is drawn from it with arithmetic alone.
class Draw {
public:
    explicit Draw(std::uint64_t seed) : state_(seed) {}

    double share() { return static_cast<double>(next() >> 11) * 0x1p-53; } ///< [0, 1)
    bool chance(double probability) { return share() < probability; }
    double between(double low, double high) { return low + (high - low) * share(); }
    int integer(int low, int high) { // both possible
        return low + static_cast<int>(share() * (high - low + 1));
    }
    /// Uniform in the ball of this radius.
    Vec3 within(double radius) {
        for (;;) {
            const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
            const Vec3 v{x, y, z};
            if (squared_length(v) <= 1.0) return radius * v;
        }
    }
    Vec3 direction() {
        for (;;) {
            const Vec3 v = within(1.0);
            const double length = glm::length(v);
            if (length > 0.1) return v / length;
        }
    }

private:
    std::uint64_t next() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::uint64_t state_;
};

/// How directions, anchors and strengths of a case relate to each other.
enum class CaseFamily {
    random,        ///< not at all
    degenerate,    ///< few directions and anchors, equal strengths: redundant, coincident, opposed
    near_parallel, ///< directions 1e-16 .. 1e-1 rad apart, anchors as near
    mixed,         ///< random with common anchors, and strengths of all sizes, 1 mN .. 1 kN
    lattice,       ///< small integers: exact ties
};
inline constexpr CaseFamily kCaseFamilies[] = {CaseFamily::random, CaseFamily::degenerate,
                                               CaseFamily::near_parallel, CaseFamily::mixed,
                                               CaseFamily::lattice};

/// Which primitives a case may have.
enum class CaseKinds { planes, all };

struct PrimitiveCase {
    PrimitiveSet primitives;
    Vec3 probe{0.0}; ///< m
};

/// A case of 1 to `most` primitives about 10 mm around the origin, a tenth without strength, a
/// fifth hard; three in ten with a force.
inline PrimitiveCase draw_case(Draw& draw, CaseFamily family, CaseKinds kinds, int most = 16) {
    constexpr double kSize = 0.01; // m
    const Vec3 direction_0 = draw.direction();
    const Vec3 anchors[] = {draw.within(kSize), draw.within(kSize)};
    const auto lattice = [&] {
        const int x = draw.integer(-2, 2), y = draw.integer(-2, 2), z = draw.integer(-2, 2);
        return Vec3{x, y, z};
    };
    const auto hair = [&] { return std::pow(10.0, draw.between(-16, -1)); };

    PrimitiveCase result;
    const int count = draw.integer(1, most);
    for (int i = 0; i < count; ++i) {
        Vec3 direction = draw.direction();
        Vec3 anchor = draw.within(kSize);
        double strength = draw.between(0, 5);
        switch (family) {
        case CaseFamily::random:
            break;
        case CaseFamily::degenerate:
            if (draw.chance(0.4))
                direction = draw.chance(0.2) ? -direction_0 : direction_0;
            else if (draw.chance(0.3))
                direction = glm::normalize(glm::cross(direction_0, direction));
            if (draw.chance(0.7)) anchor = anchors[draw.integer(0, 1)];
            if (draw.chance(0.2)) anchor += draw.between(-kSize, kSize) * direction_0;
            if (draw.chance(0.3)) strength = 2.0;
            break;
        case CaseFamily::near_parallel:
            direction = glm::normalize((draw.chance(0.3) ? -direction_0 : direction_0) +
                                       hair() * direction);
            if (draw.chance(0.4)) anchor = anchors[0] + kSize * hair() * draw.direction();
            break;
        case CaseFamily::mixed:
            if (draw.chance(0.2)) anchor = anchors[0];
            strength = std::pow(10.0, draw.between(-3, 3));
            break;
        case CaseFamily::lattice:
            direction = lattice();
            anchor = kSize * lattice();
            strength = 5.0 * draw.integer(1, 4);
            break;
        }
        if (draw.chance(0.1)) strength = 0.0;
        if (draw.chance(0.2)) strength = std::numeric_limits<double>::infinity();
        const int kind = kinds == CaseKinds::planes ? 0 : draw.integer(0, 2);
        if (kind == 0) result.primitives.add({anchor, direction, strength});
        if (kind == 1) result.primitives.add_line({anchor, direction, strength});
        if (kind == 2) result.primitives.add_point({anchor, strength});
    }
    if (draw.chance(0.3)) result.primitives.add_force(draw.within(2.0));
    result.probe = family == CaseFamily::lattice ? kSize * lattice() : draw.within(kSize);
    return result;
}

} // namespace palpate::test
