// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace palpate::internal {

/// How the first picture of a study begins, by which it is known as one of our files.
inline constexpr std::string_view kFrontBeginning =
    "<!-- Palpate study: what accuracy costs in time -->";

} // namespace palpate::internal
