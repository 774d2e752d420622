// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include <palpate/geometry/range.h>

namespace palpate {

/// Strength over a field's value: linear between its nodes, constant outside; a plain struct of
/// fixed capacity.
struct TransferFunction {
    /// A strength at one value.
    struct Node {
        double value = 0.0;      ///< the field's own unit
        double strength_n = 0.0; ///< N, >= 0; infinity only in a function of one node
    };
    static constexpr std::size_t kCapacity = 32; ///< nodes at most

    std::array<Node, kCapacity> nodes{}; ///< the first `count` are in use
    std::size_t count = 0;               ///< nodes in use, by strictly increasing value

    /// The same strength everywhere: N, >= 0, may be infinite.                          [any]
    static TransferFunction constant(double strength_n) noexcept {
        TransferFunction f;
        f.nodes[0].strength_n = strength_n;
        f.count = 1;
        return f;
    }

    /// Itself; throws std::invalid_argument that begins with `what` and names node and range where
    /// a strength is outside of `range` (infinite ones: only as a single node), values do not
    /// increase, or there are no nodes or too many.                                   [setup]
    const TransferFunction& check(std::string_view what, const Range& range) const;

    /// Strength in N at a value; 0 for a function without nodes or a value that is NaN. [loop]
    double operator()(double value) const noexcept {
        if (count == 0 || !(value == value)) return 0.0;
        if (count == 1 || value <= nodes[0].value) return nodes[0].strength_n;
        for (std::size_t i = 1; i < count; ++i) {
            if (value > nodes[i].value) continue;
            const Node& low = nodes[i - 1];
            const Node& high = nodes[i];
            const double share =
                (value - low.value) / (high.value - low.value); // increasing values: > 0
            return low.strength_n + share * (high.strength_n - low.strength_n);
        }
        return nodes[count - 1].strength_n;
    }

    /// Its derivative there: strength per unit of the field; 0 outside of the nodes, and at a node
    /// that of the piece before it.                                                      [loop]
    double slope(double value) const noexcept {
        for (std::size_t i = 1; i < count; ++i) {
            const Node& low = nodes[i - 1];
            const Node& high = nodes[i];
            if (value > low.value && value <= high.value)
                return (high.strength_n - low.strength_n) / (high.value - low.value);
        }
        return 0.0;
    }

    /// The greatest of its strengths; 0 for a function without nodes.                   [any]
    double strongest() const noexcept {
        double most = 0.0;
        for (std::size_t i = 0; i < count; ++i)
            most = std::max(most, nodes[i].strength_n);
        return most;
    }
    /// Strength 0 for every value: an effect with it can never be felt.                 [any]
    bool is_zero() const noexcept { return strongest() == 0.0; }
};

} // namespace palpate
