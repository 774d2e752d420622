// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/study/study.h>

namespace palpate::internal {

// Sections of the study's page, HTML; empty where the study has nothing for them.        [setup]

/// What each method reaches at equal error and at equal time.
std::string trade_off_section(const Study& study);
/// Where the time of a frame goes, and what each effect and each contact adds to it.
std::string cost_section(const Study& study);
/// The error budget.
std::string error_section(const Study& study);
/// The sweeps, each with its fits.
std::string sweep_section(const Study& study);

} // namespace palpate::internal
