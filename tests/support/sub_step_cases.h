// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/haptics/stepping/subdivision.h>

/// A frame in one evaluation, in thousands, and in as many as a clock allows.
namespace palpate::test {

struct SubStepCase {
    std::string name;
    SteppingSettings settings;
    double reading_us = 0.0; ///< by which the scripted clock advances at each reading
};

inline SubStepCase adaptive_steps() { return {"adaptive", {}, 0.0}; }

inline std::vector<SubStepCase> any_number_of_sub_steps() {
    std::vector<SubStepCase> cases;
    for (const int number : {1, 8, 46, 256, 1024, 4096}) {
        SubStepCase fixed{"fixed " + std::to_string(number), {}, 0.0};
        fixed.settings.method = SteppingMethod::fixed;
        fixed.settings.sub_steps = number;
        cases.push_back(fixed);
    }
    SubStepCase paper{"paper", {}, 0.5}; // some 1800 in its 0.9 ms
    paper.settings.method = SteppingMethod::paper;
    cases.push_back(paper);
    return cases;
}

} // namespace palpate::test
