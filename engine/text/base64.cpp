// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/base64.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

namespace palpate {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

} // namespace

std::string base64(std::string_view bytes) {
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63u] : '=';
    }
    return text;
}

std::string bytes_of_base64(std::string_view text) {
    const auto refuse = [] { throw std::invalid_argument("a text is not in base 64"); };
    if (text.size() % 4 != 0) refuse();
    const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with("=") ? 1 : 0;
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const std::size_t digit = kDigits.find(text[i]);
        const bool is_padding = i + padding >= text.size();
        if (!is_padding && digit == std::string_view::npos) refuse();
        bits = bits << 6 | (is_padding ? 0u : static_cast<std::uint32_t>(digit));
        if (i % 4 != 3) continue;
        for (std::size_t k = 0; k < 3; ++k)
            bytes += static_cast<char>(bits >> (16 - 8 * k) & 255u);
        bits = 0;
    }
    bytes.resize(bytes.size() - padding);
    return bytes;
}

} // namespace palpate
