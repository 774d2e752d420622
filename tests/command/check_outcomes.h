// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <set>
#include <sstream>
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

/// That no check of a driver whose device takes no force failed, and that those of forces, which
/// say nothing of it, were skipped.
inline void expect_passed_without_force(const CommandResult& result) {
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
    EXPECT_GE(checks(result, "PASS").size(), 33u) << result.out;
    const std::vector<std::string> skipped = checks(result, "SKIP");
    for (const char* check :
         {"force_limit", "force_not_finite", "force_sign", "passivity", "watchdog", "zero_at_stop"})
        EXPECT_EQ(std::count(skipped.begin(), skipped.end(), check), 1) << check << result.out;
}

/// Of a command that has to pass, the first of three tries that does: where the machine, or whom
/// the driver talks to, stands still for a second, checks of time fail.
template <class Try>
CommandResult passed_in_three(Try once) {
    CommandResult result = once();
    for (int again = 0; again < 2 && result.exit != 0; ++again)
        result = once();
    return result;
}

/// The names of all checks, as `palpate validate ... --list` printed them.
inline std::set<std::string> listed_checks(const CommandResult& result) {
    std::set<std::string> names;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);)
        names.insert(line.substr(0, line.find(' ')));
    return names;
}

} // namespace palpate::test
