// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/trade_off.h>

#include <algorithm>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>

namespace palpate {
namespace {

constexpr double kAsLong = 1.05; // a budget of 10 us makes frames of 10.2: what is around sub-steps

void keep_least(std::optional<double>& least, double value) {
    if (!least || value < *least) least = value;
}

template <std::size_t Count>
std::string cells(const std::array<std::optional<double>, Count>& values, double known_to) {
    std::string text;
    for (const std::optional<double>& value : values)
        text += value && *value < known_to ? fmt::format(" < {} |", internal::readable(known_to))
                                           : fmt::format(" {} |", internal::readable(value));
    return text;
}

std::string table_of(std::span<const StudyRun> runs, TradedError error, double known_to_um,
                     const char* caption) {
    const std::vector<TradeOff> trades = trade_offs(runs, error, known_to_um);
    if (trades.empty()) return {};
    std::string text = fmt::format("{}\n\n| method |", caption);
    for (const double error_um : kEqualErrors_um)
        text += fmt::format(" us for {:g} um |", error_um);
    for (const double time_us : kEqualTimes_us)
        text += fmt::format(" um in {:g} us |", time_us);
    text += "\n|---|";
    for (std::size_t i = 0; i < kEqualErrors_um.size() + kEqualTimes_us.size(); ++i)
        text += "---|";
    text += "\n";
    for (const TradeOff& trade : trades)
        text +=
            fmt::format("| {}{} |{}{}\n", trade.method, trade.certified ? "" : " (not certified)",
                        cells(trade.cheapest_us, 0.0), cells(trade.best_um, known_to_um));
    return text + "\n";
}

} // namespace

std::vector<TradeOff> trade_offs(std::span<const StudyRun> runs, TradedError error,
                                 double known_to_um) {
    std::vector<TradeOff> trades;
    for (const StudyRun& run : runs) {
        const StudyRun::Error& of = error == TradedError::position ? run.converged : run.level;
        if (of.frames == 0 || run.frames_in_contact == 0 || !run.pace.empty()) continue;
        const std::string method{method_of(run)};
        auto trade = std::find_if(trades.begin(), trades.end(),
                                  [&](const TradeOff& known) { return known.method == method; });
        if (trade == trades.end()) trade = trades.insert(trades.end(), {method, true, {}, {}});
        trade->certified = trade->certified && run.note.empty();
        for (std::size_t i = 0; i < kEqualErrors_um.size(); ++i)
            if (std::max(of.rms_um, known_to_um) <= kEqualErrors_um[i])
                keep_least(trade->cheapest_us[i], run.spent_p50_us);
        for (std::size_t i = 0; i < kEqualTimes_us.size(); ++i)
            if (run.spent_p50_us <= kAsLong * kEqualTimes_us[i])
                keep_least(trade->best_um[i], of.rms_um);
    }
    return trades;
}

std::string trade_off_table(std::span<const StudyRun> runs, double known_to_um) {
    return table_of(runs, TradedError::position, known_to_um,
                    "Equal error and equal time: position (distance from the converged proxy, um "
                    "rms) against the median us of a frame") +
           table_of(runs, TradedError::level, 0.0,
                    "The same for the distance from the surface, um rms, which says nothing of "
                    "where on it the proxy is");
}

} // namespace palpate
