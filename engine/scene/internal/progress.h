// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string_view>

#include <palpate/geometry/isosurface.h>

namespace palpate::internal {

/// Tells progress, and throws std::runtime_error "cancelled" where it says so.          [setup]
inline void report(const Progress& progress, double fraction, std::string_view what) {
    if (progress && !progress(fraction, what)) throw std::runtime_error("cancelled");
}

} // namespace palpate::internal
