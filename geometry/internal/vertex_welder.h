// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// Numbers positions in the order in which they first appear; positions with equal coordinates
/// (-0.0 is 0.0) share a number.
class VertexWelder {
public:
    /// The number of a position, and whether it is new.
    struct Vertex {
        std::uint32_t number;
        bool is_new;
    };
    Vertex weld(const Vec3& position) {
        const Vec3 p = position + 0.0; // -0.0 becomes 0.0
        const Bits bits{std::bit_cast<std::uint64_t>(p.x), std::bit_cast<std::uint64_t>(p.y),
                        std::bit_cast<std::uint64_t>(p.z)};
        const auto [found, is_new] =
            number_of_.try_emplace(bits, static_cast<std::uint32_t>(number_of_.size()));
        return {found->second, is_new};
    }

private:
    using Bits = std::array<std::uint64_t, 3>;
    struct Hash {
        std::size_t operator()(const Bits& bits) const noexcept {
            // Odd multipliers (of the golden ratio and of Steele's splitmix) and folds: the low
            // bits of float32 coordinates held in double are all zero.
            std::uint64_t hash = bits[0] * 0x9e3779b97f4a7c15u;
            hash = (hash ^ (hash >> 29) ^ bits[1]) * 0xbf58476d1ce4e5b9u;
            hash = (hash ^ (hash >> 32) ^ bits[2]) * 0x94d049bb133111ebu;
            return static_cast<std::size_t>(hash ^ (hash >> 31));
        }
    };
    std::unordered_map<Bits, std::uint32_t, Hash> number_of_;
};

} // namespace palpate::internal
