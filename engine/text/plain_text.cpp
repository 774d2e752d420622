// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/plain_text.h>

namespace palpate {

std::string plain_text(std::string_view text) {
    std::string plain;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
        // C0, DEL, and C1 as UTF-8 spells it.
        const bool is_c1 = byte == 0xC2 && next >= 0x80 && next <= 0x9F;
        plain += byte < 0x20 || byte == 0x7F || is_c1 ? '?' : text[i];
        if (is_c1) ++i;
    }
    return plain;
}

} // namespace palpate
