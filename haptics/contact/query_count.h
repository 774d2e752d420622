// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace palpate {

/// What a surface or an effect has computed so far: counters that only grow.
struct QueryCount {
    std::uint64_t field_samples = 0;
    std::uint64_t roots = 0;
    std::uint64_t surface_queries = 0; ///< rays and nearest points of a mesh
};

} // namespace palpate
