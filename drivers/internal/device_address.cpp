// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/device_address.h>

#include <algorithm>
#include <stdexcept>

namespace palpate::internal {

DeviceAddress device_address(const std::string& kind, const std::string& text) {
    const std::size_t mark = text.find('?');
    DeviceAddress address;
    address.place = text.substr(0, mark);
    const auto fail = [&](const std::string& what, const std::string& remedy) {
        throw std::runtime_error(kind + text + ": " + what + "; " + remedy);
    };
    for (std::size_t at = mark; at < text.size();) {
        const std::size_t end = std::min(text.find('&', at + 1), text.size());
        const std::string option = text.substr(at + 1, end - at - 1);
        const std::size_t equals = option.find('=');
        if (equals == std::string::npos || equals == 0)
            fail("the option \"" + option + "\" is no key=value", "write ?key=value&key=value");
        const std::string key = option.substr(0, equals);
        for (const auto& [known, value] : address.options)
            if (known == key) fail("the option " + key + " is there twice", "keep one of them");
        address.options.emplace_back(key, option.substr(equals + 1));
        at = end;
    }
    return address;
}

} // namespace palpate::internal
