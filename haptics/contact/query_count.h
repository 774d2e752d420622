// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace palpate {

/// What a surface or an effect has computed so far: counters that only grow.
struct QueryCount {
    std::uint64_t field_samples = 0;   ///< values or gradients read from fields
    std::uint64_t roots = 0;           ///< first crossings of a segment with a level
    std::uint64_t surface_queries = 0; ///< rays and nearest points of a mesh

    /// Adds what another one has counted.                                                   [loop]
    QueryCount& operator+=(const QueryCount& other) noexcept {
        field_samples += other.field_samples;
        roots += other.roots;
        surface_queries += other.surface_queries;
        return *this;
    }
    /// What is in `all` and not in `some`. Modulo 2^64, as `some` may be counts of another loop.
    friend QueryCount operator-(const QueryCount& all, const QueryCount& some) noexcept {
        return {all.field_samples - some.field_samples, all.roots - some.roots,
                all.surface_queries - some.surface_queries};
    }
};

} // namespace palpate
