// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace palpate::test {

/// Reads what docs/view_protocol.md says of a container, as the page does.
class ContainerReader {
public:
    explicit ContainerReader(std::string_view bytes) {
        if (bytes.size() < 16 || bytes.substr(0, 8) != "PALPVIEW")
            throw std::runtime_error("no mark");
        std::uint32_t version = 0, length = 0;
        std::memcpy(&version, bytes.data() + 8, sizeof version);
        std::memcpy(&length, bytes.data() + 12, sizeof length);
        if (version != 1) throw std::runtime_error("another version");
        document = nlohmann::json::parse(bytes.substr(16, length));
        blobs_ = bytes.substr((16 + length + 7) / 8 * 8);
    }

    nlohmann::json document;

    template <class Number>
    std::vector<Number> blob(const std::string& name, const std::string& type) const {
        const nlohmann::json& described = document.at("blobs").at(name);
        if (described.at("type") != type) throw std::runtime_error(name + " is of another type");
        const auto offset = described.at("offset").get<std::size_t>();
        std::vector<Number> numbers(described.at("count").get<std::size_t>());
        if (offset % 8 != 0 || offset + numbers.size() * sizeof(Number) > blobs_.size())
            throw std::runtime_error(name + " is not where it should be");
        if (!numbers.empty())
            std::memcpy(numbers.data(), blobs_.data() + offset, numbers.size() * sizeof(Number));
        return numbers;
    }

    /// A column of "frames".
    template <class Number>
    std::vector<Number> column(const std::string& name, const std::string& type) const {
        return blob<Number>(document.at("frames").at("columns").at(name), type);
    }

private:
    std::string_view blobs_;
};

} // namespace palpate::test
