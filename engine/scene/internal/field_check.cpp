// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/field_check.h>

#include <stdexcept>

#include <fmt/format.h>

namespace palpate::internal {

void FieldCheck::integer(std::string_view field, int value, const IntegerRange& range) const {
    if (value >= range.low && value <= range.high) return;
    fail(field, fmt::format("= {} is out of range", value),
         fmt::format("give an integer in [{}, {}]", range.low, range.high));
}

void FieldCheck::triple(std::string_view field, const Vec3& value, const Range& range) const {
    for (int i = 0; i < 3; ++i)
        number(fmt::format("{}[{}]", field, i), value[i], range);
}

void FieldCheck::enumerator(std::string_view field, int value, int last) const {
    if (value >= 0 && value <= last) return;
    fail(field, fmt::format("= {} is none of its enumeration's values", value),
         fmt::format("give one of 0 to {}", last));
}

void FieldCheck::unknown(std::string_view field, const std::string& value, const Names& names,
                         std::string_view noun) const {
    fail(field, fmt::format("= \"{}\" does not exist", value), remedy_for_name(value, names, noun));
}

void FieldCheck::fail(std::string_view field, std::string_view what,
                      std::string_view remedy) const {
    throw std::invalid_argument(fmt::format("{} {}; {}", path(field), what, remedy));
}

} // namespace palpate::internal
