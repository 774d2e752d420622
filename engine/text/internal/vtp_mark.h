// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace palpate::internal {

/// How a .vtp of ours begins; the version follows.
inline constexpr std::string_view kVtpBeginning = "<?xml version=\"1.0\"?>\n<!-- palpate ";

} // namespace palpate::internal
