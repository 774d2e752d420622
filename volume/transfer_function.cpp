// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/transfer_function.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace palpate {

const TransferFunction& TransferFunction::check(std::string_view what, const Range& range) const {
    const std::string field(what);
    if (count < 1 || count > kCapacity)
        throw std::invalid_argument(field + ".count = " + std::to_string(count) +
                                    " is out of range; give an integer in [1, " +
                                    std::to_string(kCapacity) + "]");
    Range strengths = range;
    if (count > 1) { // between infinite ones there is nothing to interpolate
        const bool low_open =
            range.ends == Range::Ends::low_open || range.ends == Range::Ends::open;
        strengths.or_infinite = false;
        if (std::isinf(range.high))
            strengths.ends = low_open ? Range::Ends::open : Range::Ends::high_open;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::string node = field + ".nodes[" + std::to_string(i) + "]";
        require(node + ".strength_n", nodes[i].strength_n, strengths);
        if (count == 1) break; // its value is not looked at
        require(node + ".value", nodes[i].value, kFiniteRange);
        if (i > 0 && !(nodes[i].value > nodes[i - 1].value))
            throw std::invalid_argument(node + ".value = " + in_digits(nodes[i].value) +
                                        " is not above the value before it, " +
                                        in_digits(nodes[i - 1].value) +
                                        "; give strictly increasing values");
    }
    return *this;
}

} // namespace palpate
