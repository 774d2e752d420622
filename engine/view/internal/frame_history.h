// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include <palpate/engine/loop/frame_report.h>

namespace palpate::internal {

/// Frames from the thread that records to the one that serves: a lock is held for as long as one is
/// copied, or a list swapped. Where nobody takes them the oldest go.
class FrameFeed {
public:
    explicit FrameFeed(std::size_t most) : most_(most) {}

    void add(const FrameReport& frame) {
        const std::lock_guard lock(mutex_);
        if (waiting_.size() >= most_) { // the server's thread has stood still
            ++first_;
            waiting_.pop_front();
        }
        waiting_.push_back(frame);
    }

    /// What came since the last call, in `frames`; gives back the index of the first one.
    std::uint64_t take(std::vector<FrameReport>& frames) {
        std::deque<FrameReport> taken;
        std::uint64_t first = 0;
        {
            const std::lock_guard lock(mutex_);
            taken.swap(waiting_);
            first = std::exchange(first_, first_ + taken.size());
        }
        frames.assign(taken.begin(), taken.end());
        return first;
    }

private:
    std::mutex mutex_;
    std::size_t most_;
    std::uint64_t first_ = 0; // index of the first one that waits
    std::deque<FrameReport> waiting_;
};

/// The last frames, by index.
class FrameHistory {
public:
    explicit FrameHistory(std::size_t most) : most_(most) {}

    void add(std::uint64_t first, const std::vector<FrameReport>& frames) {
        if (first != end()) { // some in between are lost
            frames_.clear();
            first_ = first;
        }
        frames_.insert(frames_.end(), frames.begin(), frames.end());
        const std::size_t too_many = frames_.size() - std::min(frames_.size(), most_);
        frames_.erase(frames_.begin(), frames_.begin() + static_cast<std::ptrdiff_t>(too_many));
        first_ += too_many;
    }

    std::uint64_t first() const noexcept { return first_; }
    std::uint64_t end() const noexcept { return first_ + frames_.size(); }
    /// From that index on, which is in [first(), end()].
    std::vector<FrameReport> from(std::uint64_t index) const {
        return {frames_.begin() + static_cast<std::ptrdiff_t>(index - first_), frames_.end()};
    }

private:
    std::size_t most_;
    std::uint64_t first_ = 0;
    std::deque<FrameReport> frames_;
};

} // namespace palpate::internal
