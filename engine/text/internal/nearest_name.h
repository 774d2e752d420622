// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::internal {

/// Edit distance of whole words (optimal string alignment): insertions, deletions and replacements of
/// a byte, and two bytes that changed places, cost 1.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// What to do about a name that does not exist: `did you mean "bone"?` when a valid one is near,
/// else "NOUN: a, b, c" with all of them, or "there are no NOUN".
std::string remedy_for_name(std::string_view given, std::span<const std::string_view> valid,
                            std::string_view noun);

/// "a, b, c".
std::string joined(std::span<const std::string_view> names);

using Names = std::vector<std::string_view>;

/// The keys of a map of names.
template <class Map>
Names names_of(const Map& map) {
    Names names;
    for (const auto& [name, value] : map)
        names.push_back(name);
    return names;
}

} // namespace palpate::internal
