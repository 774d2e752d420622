// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

/// How a journal lies in its file: a mark, and parts, each behind its length in digits and a line's
/// end.
namespace palpate::internal {

inline constexpr std::string_view kJournalEnding = ".part"; ///< behind the recording's name
inline constexpr std::string_view kJournalMark = "palpate journal 1\n";

inline std::string journal_part(const std::string& bytes) {
    return std::to_string(bytes.size()) + "\n" + bytes;
}

/// Takes the first part from `rest`; nothing where it is not whole.                       [any]
inline std::optional<std::string_view> next_journal_part(std::string_view& rest) {
    constexpr std::size_t most_digits = 18;
    std::size_t size = 0, at = 0;
    for (; at < rest.size() && at < most_digits && rest[at] >= '0' && rest[at] <= '9'; ++at)
        size = 10 * size + static_cast<std::size_t>(rest[at] - '0');
    if (at == 0 || at >= rest.size() || rest[at] != '\n' || rest.size() - at - 1 < size)
        return std::nullopt;
    const std::string_view part = rest.substr(at + 1, size);
    rest.remove_prefix(at + 1 + size);
    return part;
}

} // namespace palpate::internal
