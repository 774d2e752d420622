// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace palpate::internal {

/// What a column of numbers comes to, in their unit. Percentiles are of the nearest rank, so that
/// every one is a number that occurred.
struct Spread {
    std::size_t count = 0; ///< 0: the rest means nothing
    double mean = 0.0;
    double rms = 0.0;
    double p50 = 0.0;
    double p90 = 0.0;
    double p99 = 0.0;
    double max = 0.0;
};

Spread spread_of(std::vector<double> values); ///< [any]

} // namespace palpate::internal
