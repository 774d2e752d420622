// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <nlohmann/json.hpp>

namespace palpate::internal {

/// How a page is told what the numbers of a blob are.
template <class Number>
constexpr const char* blob_type() {
    if constexpr (std::is_same_v<Number, std::uint8_t>) return "u8";
    if constexpr (std::is_same_v<Number, std::uint16_t>) return "u16";
    if constexpr (std::is_same_v<Number, std::uint32_t>) return "u32";
    if constexpr (std::is_same_v<Number, float>) return "f32";
    if constexpr (std::is_same_v<Number, double>) return "f64";
}

/// Everything binary that a page is sent: a JSON document that names blobs, and the blobs behind
/// it. Little-endian; docs/view_protocol.md has the layout.                                       [setup]
class Container {
public:
    static constexpr std::string_view kMark = "PALPVIEW";
    static constexpr std::uint32_t kVersion = 1;
    static constexpr std::size_t kAlignment = 8; // bytes: a page reads f64 in place

    /// `kind`: "scene", "frames" or "mesh".
    explicit Container(const char* kind)
        : document{{"kind", kind}, {"blobs", nlohmann::json::object()}} {}

    nlohmann::json document; ///< what is to be said; its "blobs" are add()'s

    /// Appends numbers, and gives back the name that the document refers to them by. Each name
    /// once.
    template <class Number>
    std::string add(std::string name, std::span<const Number> numbers) {
        static_assert(std::endian::native == std::endian::little,
                      "numbers are written as they are");
        document["blobs"][name] = {
            {"type", blob_type<Number>()}, {"offset", blobs_.size()}, {"count", numbers.size()}};
        if (!numbers.empty())
            blobs_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
        pad(blobs_);
        return name;
    }

    /// The whole of it.
    std::string bytes() const;

private:
    static void pad(std::string& bytes) {
        bytes.resize((bytes.size() + kAlignment - 1) / kAlignment * kAlignment, '\0');
    }

    std::string blobs_;
};

} // namespace palpate::internal
