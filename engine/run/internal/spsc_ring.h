// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::internal {

/// A queue of fixed capacity from one thread to one other, without locks: neither ever waits for
/// the other. Its memory is touched when it is made.
template <class T>
class SpscRing {
public:
    /// At least that many, rounded up to a power of two.                                [setup]
    explicit SpscRing(std::size_t capacity) : slots_(std::bit_ceil(capacity)) {}

    /// How many push() takes now; more once the other thread goes on.     [the pushing thread]
    std::size_t room() const noexcept {
        return slots_.size() -
               (pushed_.load(std::memory_order_relaxed) - popped_.load(std::memory_order_acquire));
    }

    /// All of them, or none and false where there is not room for all.    [the pushing thread]
    bool push(std::span<const T> values) noexcept {
        if (values.size() > room()) return false;
        const std::size_t at = pushed_.load(std::memory_order_relaxed);
        for (std::size_t i = 0; i < values.size(); ++i)
            slots_[(at + i) & (slots_.size() - 1)] = values[i];
        pushed_.store(at + values.size(), std::memory_order_release);
        return true;
    }
    bool push(const T& value) noexcept { return push(std::span<const T>(&value, 1)); }

    /// The oldest one; false where there is none.                         [the popping thread]
    bool pop(T& value) noexcept {
        const std::size_t at = popped_.load(std::memory_order_relaxed);
        if (at == pushed_.load(std::memory_order_acquire)) return false;
        value = slots_[at & (slots_.size() - 1)];
        popped_.store(at + 1, std::memory_order_release);
        return true;
    }

private:
    static constexpr std::size_t kLine = 64; // bytes of a cache line: each thread writes its own

    std::vector<T> slots_;
    alignas(kLine) std::atomic<std::size_t> pushed_{0};
    alignas(kLine) std::atomic<std::size_t> popped_{0};
};

} // namespace palpate::internal
