// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

/// How a frame's movement of the proxy is cut into sub-steps.
enum class SteppingMethod {
    single,   ///< one evaluation: the state before the paper
    paper,    ///< eqs (6)-(10): as many shares as the clock allows
    fixed,    ///< eqs (6), (7), (9) with a given number of shares
    adaptive, ///< full steps with curvature until the residual is below the tolerance
};

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
