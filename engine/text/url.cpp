// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/url.h>

#include <fmt/format.h>

namespace palpate {

std::string percent_encoded(std::string_view path) {
    constexpr std::string_view kPlain =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
    std::string address;
    for (const char byte : path)
        if (kPlain.find(byte) != std::string_view::npos)
            address += byte;
        else
            address += fmt::format("%{:02X}", static_cast<unsigned char>(byte));
    return address;
}

} // namespace palpate
