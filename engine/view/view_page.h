// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// The page that was built in: one HTML file, without data. Empty where this build has none.  [any]
std::string_view built_in_page() noexcept;

/// The built-in page, or the one of `file` where that is not empty.                        [setup]
/// Throws std::runtime_error where there is none, or the file is no such page.
std::string view_page(const std::filesystem::path& file = {});

/// A page with a container (scene_message()) inside: it needs no network and no other file. [setup]
/// Throws std::invalid_argument where `page` has no place for it.
std::string playback_page(std::string_view page, std::string_view container);

} // namespace palpate
