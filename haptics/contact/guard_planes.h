// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <palpate/geometry/vec.h>

namespace palpate {

/// The planes that keep a point off facets that are not certified: each the skin's height above a
/// facet or, round an edge or vertex, above the tangent plane there. The newest are kept where
/// there is no room.
class GuardPlanes {
public:
    static constexpr std::size_t kCapacity = 8;
    static constexpr std::uint32_t kNoFacet = std::numeric_limits<std::uint32_t>::max();

    struct Entry {
        Vec3 anchor{0.0}; ///< a point of the plane, m: as high above the facet as the skin
        Vec3 normal{0.0}; ///< unit, towards the point
        std::uint32_t facet = kNoFacet; ///< whose plane it is; kNoFacet: an edge's or vertex's
        Vec3 found_at{0.0};             ///< where the point was then, m
    };

    void clear() noexcept { count_ = 0; }                                         ///< [loop]
    std::size_t size() const noexcept { return count_; }                          ///< [loop]
    const Entry& operator[](std::size_t i) const noexcept { return entries_[i]; } ///< [loop]

    /// Makes room for it by forgetting the oldest, where there is none.                 [loop]
    void add(const Entry& entry) noexcept {
        if (count_ == kCapacity) {
            for (std::size_t i = 1; i < count_; ++i)
                entries_[i - 1] = entries_[i];
            --count_;
        }
        entries_[count_++] = entry;
    }

    /// Forgets those for which `condition` is false.                                    [loop]
    template <class Condition>
    void keep_if(const Condition& condition) noexcept {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count_; ++i)
            if (condition(entries_[i])) entries_[kept++] = entries_[i];
        count_ = kept;
    }

private:
    std::array<Entry, kCapacity> entries_{};
    std::size_t count_ = 0;
};

} // namespace palpate
