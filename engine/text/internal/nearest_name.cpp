// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/internal/nearest_name.h>

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

namespace palpate::internal {
namespace {

/// A name is near when at most a third of it, and at least two typing errors, is different.
bool is_near(std::string_view given, std::string_view valid) {
    return edit_distance(given, valid) <= std::max<std::size_t>(2, valid.size() / 3) &&
           edit_distance(given, valid) < valid.size();
}

} // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
    // Rows i - 2, i - 1 and i of the table of distances between the first i bytes of a and all
    // beginnings of b.
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before.swap(last);
        last.swap(row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            row[j] = std::min({replaced, last[j] + 1, row[j - 1] + 1});
            const bool changed_places =
                i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (changed_places) row[j] = std::min(row[j], before[j - 2] + 1);
        }
    }
    return row[b.size()];
}

std::string joined(std::span<const std::string_view> names) {
    return fmt::format("{}", fmt::join(names.begin(), names.end(), ", "));
}

std::string remedy_for_name(std::string_view given, std::span<const std::string_view> valid,
                            std::string_view noun) {
    if (valid.empty()) return fmt::format("there are no {}", noun);
    const auto nearest =
        std::min_element(valid.begin(), valid.end(), [&](std::string_view a, std::string_view b) {
            return edit_distance(given, a) < edit_distance(given, b);
        });
    if (is_near(given, *nearest)) return fmt::format("did you mean \"{}\"?", *nearest);
    return fmt::format("{}: {}", noun, joined(valid));
}

} // namespace palpate::internal
