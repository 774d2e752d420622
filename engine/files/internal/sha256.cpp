// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/files/internal/sha256.h>

#include <stdexcept>

#include <fmt/format.h>
#include <openssl/evp.h>

namespace palpate::internal {

struct Sha256::Context {
    EVP_MD_CTX* digest = EVP_MD_CTX_new();
    Context() = default;
    ~Context() { EVP_MD_CTX_free(digest); }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
};

Sha256::Sha256() : context_(std::make_unique<Context>()) { begin(); }

Sha256::~Sha256() = default;

void Sha256::begin() {
    if (context_->digest == nullptr ||
        EVP_DigestInit_ex(context_->digest, EVP_sha256(), nullptr) != 1)
        throw std::runtime_error("OpenSSL has no SHA-256; check its configuration");
}

void Sha256::add(std::string_view bytes) { add(bytes.data(), bytes.size()); }

void Sha256::add(const void* bytes, std::size_t size) {
    if (size > 0) EVP_DigestUpdate(context_->digest, bytes, size);
}

std::string Sha256::hexadecimal() {
    unsigned char hash[EVP_MAX_MD_SIZE];
    unsigned int size = 0;
    EVP_DigestFinal_ex(context_->digest, hash, &size);
    begin();
    std::string text;
    for (unsigned int i = 0; i < size; ++i)
        text += fmt::format("{:02x}", hash[i]);
    return text;
}

} // namespace palpate::internal
