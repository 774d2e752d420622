// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

namespace palpate::bench {

constexpr std::size_t kLine = 64; // bytes of a cache line

/// Lines of memory that each hold where the next one is, in an order that no prefetcher guesses:
/// following them costs one dependent load for each.
class Chain {
public:
    explicit Chain(std::size_t bytes) : lines_(bytes / kLine) {
        std::vector<std::uint32_t> order(lines_.size());
        std::iota(order.begin(), order.end(), 0U);
        std::mt19937 random(1);
        for (std::size_t i = order.size() - 1; i > 0;
             --i) // std::shuffle is not the same everywhere
            std::swap(order[i], order[random() % (i + 1)]);
        for (std::size_t i = 0; i < order.size(); ++i)
            lines_[order[i]].next = order[(i + 1) % order.size()];
    }
    std::size_t size() const { return lines_.size(); }
    /// The line that is `steps` after `from`.
    std::uint32_t follow(std::uint32_t from, std::size_t steps) const {
        for (std::size_t i = 0; i < steps; ++i)
            from = lines_[from].next;
        return from;
    }

private:
    struct alignas(kLine) Line {
        std::uint32_t next = 0;
    };
    std::vector<Line> lines_;
};

/// Fills the processor's caches with something else.
class ColdCaches {
public:
    static constexpr std::size_t kBytes = std::size_t{64} << 20; // more than a core's share of L3
    void operator()() {
        for (std::size_t i = 0; i < other_.size(); i += kLine)
            other_[i] = static_cast<unsigned char>(other_[i] + 1);
        benchmark::ClobberMemory();
    }

private:
    std::vector<unsigned char> other_ = std::vector<unsigned char>(kBytes, 1);
};

} // namespace palpate::bench
