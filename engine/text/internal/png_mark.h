// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

namespace palpate::internal {

/// A tEXt chunk of PNG: length, type, "Software", 0, "palpate" and their CRC-32. By it our pictures
/// are known.
inline constexpr std::string_view kPngMark("\0\0\0\x10"
                                           "tEXtSoftware\0palpate\x92\xad\x07\x28",
                                           28);
/// Where it stands: where the standard's first chunk (of 25 bytes, behind 8 of signature) ends.
inline constexpr std::size_t kPngMarkAt = 33;

/// Whether a file that begins so is one of our pictures.                                [any]
inline bool is_own_png(std::string_view beginning) noexcept {
    return beginning.size() > kPngMarkAt && beginning.starts_with("\x89PNG") &&
           beginning.substr(kPngMarkAt).starts_with(kPngMark);
}

} // namespace palpate::internal
