// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/choices.h>

namespace palpate {
/// Which method cuts a frame into sub-steps, and its settings.
struct SteppingSettings {
    SteppingMethod method = SteppingMethod::adaptive;
    int sub_steps = 8;         ///< fixed: evaluations per frame, [1, Stepping::kMostEvaluations]
    double budget_us = 900.0;  ///< paper: t_delta of eq. (8), us, > 0
    double tolerance_m = 1e-7; ///< adaptive: a step expected to leave less is the last, m, > 0
    int evaluation_cap = 8; ///< adaptive: evaluations per frame at most, besides one for each edge
                            ///< that the proxy goes over where several meshes hold it together,
                            ///< [1, Stepping::kMostEvaluations]
};

} // namespace palpate
