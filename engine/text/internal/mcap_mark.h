// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace palpate::internal {

/// The first and the last bytes of an MCAP file; '0' is the version of the format.
inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);

/// What the header of an .mcap of ours says of its library; the version follows.
inline constexpr std::string_view kMcapLibrary = "palpate ";

/// Whether a file that begins so is an .mcap of ours: magic, then the header record (its opcode, 8
/// bytes of length, the profile, the library), whose texts have 4 bytes of length each.   [any]
inline bool is_own_mcap(std::string_view beginning) noexcept {
    constexpr std::size_t kProfileAt = 8 + 1 + 8 + 4; // behind magic, opcode and two lengths
    constexpr std::string_view kProfile = "ros2";
    if (!beginning.starts_with(kMcapMagic) || beginning.size() < kProfileAt) return false;
    const std::string_view texts = beginning.substr(kProfileAt);
    return texts.starts_with(kProfile) &&
           texts.substr(kProfile.size()).substr(0, 4 + kMcapLibrary.size()).ends_with(kMcapLibrary);
}

} // namespace palpate::internal
