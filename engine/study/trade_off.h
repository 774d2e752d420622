// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/study/study_run.h>

namespace palpate {

inline constexpr std::array kEqualErrors_um{100.0, 10.0, 1.0, 0.1};  ///< rms
inline constexpr std::array kEqualTimes_us{1.0, 10.0, 100.0, 900.0}; ///< median of a frame

/// Which error a trade is about.
enum class TradedError {
    position, ///< from the converged proxy, rms: a proxy that lags on the surface has one
    level,    ///< from the surface, rms
};

/// What one method reaches over its settings that were measured: at equal error and at equal time.
struct TradeOff {
    std::string method;    ///< method_of() its runs
    bool certified = true; ///< none of its runs has a note
    std::array<std::optional<double>, kEqualErrors_um.size()>
        cheapest_us; ///< of the settings that are as exact as this; nothing where none is
    std::array<std::optional<double>, kEqualTimes_us.size()>
        best_um; ///< of the settings whose frames take no longer than this, by more than 5 %
};

/// One for each method, in the order of the runs; runs in real time are left out, as are those
/// whose error is not known. An error below `known_to_um`, um rms, counts as one of that for
/// `cheapest_us`.                                                                         [setup]
std::vector<TradeOff> trade_offs(std::span<const StudyRun> runs, TradedError error,
                                 double known_to_um = 0.0);

/// Both errors' tables in Markdown, as README can quote them; empty where no error is known.
/// Of positions nothing below what the reference is known to, um, is claimed.             [setup]
std::string trade_off_table(std::span<const StudyRun> runs, double known_to_um);

} // namespace palpate
