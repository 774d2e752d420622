// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate {

/// The proxy's way in one frame, corner by corner. Allocates in its constructor alone. Not for two
/// threads at once.
class ProxyPath {
public:
    /// Room for so many corners, the frame's start included.                            [setup]
    explicit ProxyPath(std::size_t most_corners) { corners_.reserve(most_corners); }

    void clear() noexcept { corners_.clear(); } ///< there is no frame                    [loop]
    /// A frame begins at `start`, m, scene frame.                                        [loop]
    void begin(const Vec3& start) noexcept {
        corners_.clear();
        corners_.push_back(start);
        unmoved_ = 0;
    }
    /// Other primitives hold the proxy from here on: it may move again.                  [loop]
    void look_anew() noexcept { unmoved_ = 0; }
    /// An evaluation ends with the proxy here, m, scene frame; of no more than there is room for.
    /// [loop]
    void record_move(const Vec3& proxy) noexcept {
        if (proxy == corners_.back()) {
            ++unmoved_;
            return;
        }
        unmoved_ = 0;
        corners_.push_back(proxy);
    }

    /// Every corner, the frame's start first, m, scene frame.                            [loop]
    std::span<const Vec3> corners() const noexcept { return corners_; }
    std::uint32_t sub_steps() const noexcept { ///< movements                             [loop]
        return static_cast<std::uint32_t>(corners_.size() - 1);
    }
    /// Whether the last move was none.                                                   [loop]
    bool stands_still() const noexcept { return unmoved_ > 0; }
    double length_m() const noexcept { ///< of all movements, m                           [loop]
        double length = 0.0;
        for (std::size_t i = 1; i < corners_.size(); ++i)
            length += glm::length(corners_[i] - corners_[i - 1]);
        return length;
    }
    /// Moves in a row that were none.                                                    [loop]
    int tries_in_vain() const noexcept { return unmoved_; }

private:
    std::vector<Vec3> corners_;
    int unmoved_ = 0;
};

} // namespace palpate
