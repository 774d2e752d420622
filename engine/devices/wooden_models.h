// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <palpate/drivers/wooden_model.h>

namespace palpate {

/// The models that come with us (drivers/models/*.json), by name, in alphabetical order.  [setup]
std::vector<std::string> wooden_model_names();

/// One of them, or, where `name` ends in .json, the file of that name. Throws std::runtime_error
/// with file, key, reason and remedy.                                                      [setup]
WoodenModel wooden_model(const std::string& name);

/// A file of the reference host's kind (its woodenhaptics.json), or of ours, which adds keys
/// (docs/devices.md). What a file does not say is as in `default_woody`; keys that we do not know
/// are not looked at; a comma too many before a closing brace is no harm. `file` is for messages.
/// Throws as wooden_model().                                                               [setup]
WoodenModel parse_wooden_model(const std::string& text, const std::filesystem::path& file);

} // namespace palpate
