// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace palpate::internal {

/// A document as text. Names in files of hospitals are not always UTF-8: what is not becomes the
/// replacement character, rather than an exception.                                       [setup]
inline std::string json_text(const nlohmann::json& document) {
    constexpr int kIndent = 2;
    return document.dump(kIndent, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Whether a text comes back from a document as it is.                                     [setup]
inline bool is_utf8(const std::string& text) {
    return nlohmann::json::parse(json_text(text)).get_ref<const std::string&>() == text;
}

} // namespace palpate::internal
