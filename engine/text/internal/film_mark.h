// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace palpate::internal {

/// The last box of our films, which players pass over: length, type "free" and words (ISO/IEC
/// 14496-12, 8.1.2). By it they are known.
inline constexpr std::string_view kFilmMark("\0\0\0\x1a"
                                            "freewritten by Palpate",
                                            26);

/// Whether a file that begins and ends so is one of our films.                          [any]
inline bool is_own_film(std::string_view beginning, std::string_view end) noexcept {
    return beginning.substr(0, 8).ends_with("ftyp") && end.ends_with(kFilmMark);
}

} // namespace palpate::internal
