// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace palpate {

/// Hands the newest value from one thread to another, without a lock. Neither side ever waits, and
/// no value is seen half-written: one slot is the writer's, one the reader's, and the third goes to
/// and fro between them. `Value`: what can be copied without an exception.
template <class Value>
class Latest {
public:
    Latest() noexcept = default;
    Latest(const Latest&) = delete;
    Latest& operator=(const Latest&) = delete;

    /// From one writing thread at a time.                                               [any]
    void set(const Value& value) noexcept {
        slots_[writers_] = value;
        writers_ = between_.exchange(writers_ | kFresh, std::memory_order_acq_rel) & kSlot;
    }
    /// Whether a value was set since the last call; it is then in `value`, which is otherwise left
    /// alone. From one reading thread at a time.                                        [loop]
    bool take(Value& value) noexcept {
        if ((between_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
        readers_ = between_.exchange(readers_, std::memory_order_acq_rel) & kSlot;
        value = slots_[readers_];
        return true;
    }

private:
    static constexpr std::uint32_t kSlot = 3;
    static constexpr std::uint32_t kFresh = 4; // the slot between has what the reader has not seen
    static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

    std::array<Value, 3> slots_{};
    std::uint32_t writers_ = 0;
    std::uint32_t readers_ = 1;
    std::atomic<std::uint32_t> between_{2};
};

} // namespace palpate
