// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command_run.h"

namespace palpate::test {

/// The names of the checks that came to `outcome` in what `palpate validate ... --json` printed.
inline std::vector<std::string> checks(const CommandResult& result, const char* outcome) {
    std::vector<std::string> names;
    const auto json = nlohmann::json::parse(result.out, nullptr, false);
    if (json.is_discarded()) {
        ADD_FAILURE() << result.out << result.err;
        return names;
    }
    for (const auto& check : json["checks"])
        if (check["outcome"] == outcome) names.push_back(check["name"]);
    return names;
}

} // namespace palpate::test
