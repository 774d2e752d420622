// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace palpate::internal {

/// SHA-256 over any number of pieces (FIPS 180-4, by OpenSSL).                          [setup]
/// Throws std::runtime_error where OpenSSL has no SHA-256.
class Sha256 {
public:
    Sha256();
    ~Sha256();
    void add(std::string_view bytes);
    void add(const void* bytes, std::size_t size);
    /// The hash of all pieces since the beginning or the last call.
    std::string hexadecimal();

private:
    void begin();

    struct Context;
    std::unique_ptr<Context> context_;
};

} // namespace palpate::internal
