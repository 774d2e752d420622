// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace palpate::internal {

/// Finite values out of many, in ascending order: what percentiles and thresholds are taken from.
/// At most about a million, so that a large volume is not copied for it.
class ValueSample {
public:
    /// Takes every n-th of `count` values.                                              [setup]
    /// `row` is the length of the rows they lie in; n has no common factor with it, so that all
    /// columns are met. `value(index)` may be NaN: left out.
    template <class Function>
    ValueSample(std::size_t count, std::size_t row, const Function& value) {
        const std::size_t step = step_for(count, row);
        for (std::size_t i = 0; i < count; i += step)
            add(value(i));
        sort();
    }

    bool empty() const noexcept { return sorted_.empty(); }

    /// The value below which that share of the sample lies, [0, 1]; 0 for an empty one.
    double percentile(double share) const noexcept;

    /// Otsu's threshold, strictly between two values of the sample; nothing where all are equal.
    std::optional<double> otsu_threshold() const noexcept;

private:
    static std::size_t step_for(std::size_t count, std::size_t row) noexcept;
    void add(double value);
    void sort();

    std::vector<float> sorted_;
};

} // namespace palpate::internal
