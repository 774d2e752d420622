// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/spread.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {

Spread spread_of(std::vector<double> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto rank = [&](double share) {
        const auto index =
            static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
        return values[std::clamp<std::size_t>(index, 1, values.size()) - 1];
    };
    double sum = 0.0;
    double squares = 0.0;
    for (double value : values) {
        sum += value;
        squares += value * value;
    }
    const double count = static_cast<double>(values.size());
    return {values.size(), sum / count,  std::sqrt(squares / count), rank(0.50), rank(0.90),
            rank(0.99),    values.back()};
}

} // namespace palpate::internal
