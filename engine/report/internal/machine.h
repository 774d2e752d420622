// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace palpate::internal {

/// What numbers that a clock gave were measured on.
struct Machine {
    std::string cpu; ///< its model's name, or "unknown"
    unsigned cores = 0;
    std::string system; ///< kernel and release
};

Machine this_machine(); ///< [setup]

} // namespace palpate::internal
