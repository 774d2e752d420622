// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/printable.h>

#include <array>
#include <cctype>
#include <cstddef>

namespace palpate {
namespace {

/// Bytes of the UTF-8 character that begins at `at`; 0 where none does.
std::size_t character_length(const std::string& text, std::size_t at) {
    const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
    const unsigned char first = byte(at);
    if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
    // Ranges of the second byte keep out overlong forms, surrogates and what is beyond U+10FFFF;
    // U+0080 to U+009F are controls.
    struct Form {
        unsigned char first_from, first_to, second_from, second_to;
        std::size_t length;
    };
    constexpr std::array<Form, 9> kForms{{{0xC2, 0xC2, 0xA0, 0xBF, 2},
                                          {0xC3, 0xDF, 0x80, 0xBF, 2},
                                          {0xE0, 0xE0, 0xA0, 0xBF, 3},
                                          {0xE1, 0xEC, 0x80, 0xBF, 3},
                                          {0xED, 0xED, 0x80, 0x9F, 3},
                                          {0xEE, 0xEF, 0x80, 0xBF, 3},
                                          {0xF0, 0xF0, 0x90, 0xBF, 4},
                                          {0xF1, 0xF3, 0x80, 0xBF, 4},
                                          {0xF4, 0xF4, 0x80, 0x8F, 4}}};
    for (const Form& form : kForms) {
        if (first < form.first_from || first > form.first_to) continue;
        if (at + form.length > text.size()) return 0;
        if (byte(at + 1) < form.second_from || byte(at + 1) > form.second_to) return 0;
        for (std::size_t n = 2; n < form.length; ++n)
            if ((byte(at + n) & 0xC0) != 0x80) return 0;
        return form.length;
    }
    return 0;
}

} // namespace

bool is_blank(char c) noexcept { return std::isspace(static_cast<unsigned char>(c)) != 0; }

std::string_view trimmed(std::string_view text) noexcept {
    while (!text.empty() && is_blank(text.front()))
        text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back()))
        text.remove_suffix(1);
    return text;
}

std::string printable(const std::string& text) {
    const std::string inner(trimmed(text));
    std::string result;
    for (std::size_t at = 0; at < inner.size();) {
        const std::size_t length = character_length(inner, at);
        if (length == 0) {
            result += '?';
            ++at;
        } else {
            result.append(inner, at, length);
            at += length;
        }
    }
    return result;
}

} // namespace palpate
