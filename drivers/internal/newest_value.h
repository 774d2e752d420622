// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace palpate::internal {

/// The newest of the values that one thread gives and another one takes. Neither ever waits for
/// the other; values that were not taken in time are lost. (Three places: one being written, one
/// being read, and between them the newest, which is exchanged in one atomic operation.)
template <typename T>
class NewestValue {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    /// The giving thread's.                                                              [loop]
    void give(const T& value) noexcept {
        places_[giving_] = value;
        giving_ = middle_.exchange(giving_ | kFresh, std::memory_order_acq_rel) & kPlace;
    }

    /// The taking thread's: false, and `value` as it was, when none has come since.      [loop]
    bool take(T& value) noexcept {
        if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
        taking_ = middle_.exchange(taking_, std::memory_order_acq_rel) & kPlace;
        value = places_[taking_];
        return true;
    }

private:
    static constexpr std::uint32_t kPlace = 3;
    static constexpr std::uint32_t kFresh = 4;

    std::array<T, 3> places_{};
    std::uint32_t giving_ = 0;
    std::uint32_t taking_ = 1;
    std::atomic<std::uint32_t> middle_{2};
    static_assert(std::atomic<std::uint32_t>::is_always_lock_free);
};

} // namespace palpate::internal
