// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

namespace palpate {

namespace internal {
struct LoopStateParts;
}

/// The whole state of a HapticLoop between two frames, as a value: HapticLoop::save() gives it, and
/// HapticLoop::restore() takes it back, into the same loop or into another one that was made alike.
/// It never changes, and copies share what they hold: any number of threads. It keeps the loop's
/// scene alive.
class LoopState {
public:
    /// HapticLoop's matter.                                                             [setup]
    explicit LoopState(std::shared_ptr<const internal::LoopStateParts> parts) noexcept
        : parts_(std::move(parts)) {}
    /// Null where it was moved from.                                                    [any]
    const internal::LoopStateParts* parts() const noexcept { return parts_.get(); }

private:
    std::shared_ptr<const internal::LoopStateParts> parts_;
};

} // namespace palpate
