// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <palpate/engine/study/internal/instruction_counter.h>

/// How benchmarks measure times, and what they tell of them.
namespace palpate::bench {

using Timer = std::chrono::steady_clock;

/// Time that passed, ns.                                                                 [any]
inline double since_ns(Timer::time_point start) {
    return std::chrono::duration<double, std::nano>(Timer::now() - start).count();
}

/// Numbers, and those at a share of them.
class Spread {
public:
    void reserve(std::size_t count) { values_.reserve(count); }
    void add(double value) {
        values_.push_back(value);
        sorted_ = false;
    }
    std::size_t size() const { return values_.size(); }
    /// Nearest rank: 0.5 the median, 1 the largest; 0 of nothing.
    double at(double share) const {
        if (values_.empty()) return 0.0;
        if (!std::exchange(sorted_, true)) std::sort(values_.begin(), values_.end());
        const double rank = std::ceil(share * static_cast<double>(values_.size()));
        return values_[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
    }
    /// p50, p99, p99.9 and max as counters, as "contact_p50_us".
    void report(benchmark::State& state, const std::string& before, const std::string& unit) const {
        for (const auto& [name, share] :
             {std::pair{"p50_", 0.5}, {"p99_", 0.99}, {"p999_", 0.999}, {"max_", 1.0}})
            state.counters[before + name + unit] = at(share);
    }

private:
    mutable std::vector<double> values_; // sorted when it is asked, and only then
    mutable bool sorted_ = false;
};

/// What two readings of the clock cost, one after the other: the median of many, ns.      [any]
inline double clock_cost_ns() {
    static const double cost = [] {
        Spread readings;
        for (int i = 0; i < 10001; ++i)
            readings.add(since_ns(Timer::now()));
        return readings.at(0.5);
    }();
    return cost;
}

/// Times `work(i)` for each i below `count`, one iteration of the benchmark for all of them: once
/// without a clock between them, for their mean and their instructions; and once one by one, for
/// percentiles, less what the clock costs. The benchmark's own time is the mean of one. `before`
/// is done before each i of the second pass, and not timed: where it is given, the first pass is
/// left out.
template <class Work, class Before = std::nullptr_t>
void measure(benchmark::State& state, std::size_t count, const Work& work,
             const Before& before = nullptr) {
    constexpr bool kIsPrepared = !std::is_same_v<Before, std::nullptr_t>;
    internal::InstructionCounter counter;
    const double clock_ns = clock_cost_ns();
    Spread each;
    each.reserve(count);
    for (auto _ : state) {
        double sum_ns = 0.0;
        if constexpr (!kIsPrepared) {
            const auto began = Timer::now();
            counter.start();
            for (std::size_t i = 0; i < count; ++i)
                benchmark::DoNotOptimize(work(i));
            counter.stop();
            sum_ns = since_ns(began);
        }
        for (std::size_t i = 0; i < count; ++i) {
            if constexpr (kIsPrepared) before();
            const auto began = Timer::now();
            benchmark::DoNotOptimize(work(i));
            const double ns = std::max(0.0, since_ns(began) - clock_ns); // read once: for both
            each.add(ns);
            if constexpr (kIsPrepared) sum_ns += ns;
        }
        state.SetIterationTime(1e-9 * sum_ns / static_cast<double>(count));
    }
    each.report(state, "", "ns");
    if (const auto instructions = counter.counted(); instructions && !kIsPrepared)
        state.counters["instructions"] =
            static_cast<double>(*instructions) /
            static_cast<double>(count * static_cast<std::size_t>(state.iterations()));
}

/// The rest of main() of a program that registers its benchmarks itself: its exit status.
inline int run_registered(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}

} // namespace palpate::bench
