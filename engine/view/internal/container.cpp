// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/internal/container.h>

#include <cstring>

namespace palpate::internal {

std::string Container::bytes() const {
    // Names in files of hospitals are not always UTF-8.
    const std::string json =
        document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    std::string bytes(kMark);
    for (const std::uint32_t number : {kVersion, static_cast<std::uint32_t>(json.size())}) {
        char four[sizeof number];
        std::memcpy(four, &number, sizeof number);
        bytes.append(four, sizeof number);
    }
    bytes += json;
    pad(bytes);
    return bytes + blobs_;
}

} // namespace palpate::internal
