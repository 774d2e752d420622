// SPDX-License-Identifier: Apache-2.0
// The floor that everything else is compared with: a load that waits for the one before it, from a
// set of memory that fits in the first, second or third cache, or in none; and one reading of the
// clock. bench_page.py divides the times of the other benchmarks by these.
#include <memory>

#include "bench/internal/memory.h"
#include "bench/internal/spread.h"

namespace palpate::bench {
namespace {

void load(benchmark::State& state) {
    const Chain chain(static_cast<std::size_t>(state.range(0)) << 10);
    constexpr std::size_t kSteps = std::size_t{1} << 14;
    constexpr int kBatches = 100; // their median: who is interrupted in one is not in all
    if (chain.follow(0, chain.size()) != 0) { // also warms the caches
        state.SkipWithError("the chain is not one ring");
        return;
    }
    std::uint32_t at = 0;
    for (auto _ : state) {
        Spread batches;
        for (int i = 0; i < kBatches; ++i) {
            const auto began = Timer::now();
            at = chain.follow(at, kSteps);
            benchmark::DoNotOptimize(at);
            batches.add(since_ns(began) / static_cast<double>(kSteps));
        }
        state.SetIterationTime(1e-9 * batches.at(0.5));
    }
}

void clock_reading(benchmark::State& state) {
    auto last = Timer::now();
    bool goes_back = false;
    for (auto _ : state) {
        const auto now = Timer::now();
        goes_back = goes_back || now < last;
        last = now;
    }
    if (goes_back) state.SkipWithError("the clock goes back");
}

BENCHMARK(load)
    ->ArgName("KiB")
    ->RangeMultiplier(4)
    ->Range(4, 256 << 10)
    ->UseManualTime()
    ->Iterations(1);
BENCHMARK(clock_reading)->Iterations(100000);

} // namespace
} // namespace palpate::bench

BENCHMARK_MAIN();
