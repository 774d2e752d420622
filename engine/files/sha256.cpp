// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/files/sha256.h>

#include <cstddef>
#include <fstream>
#include <stdexcept>

#include <palpate/engine/files/internal/sha256.h>
#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate {

std::string sha256_of_file(const std::filesystem::path& file) {
    constexpr std::size_t kPiece = std::size_t{1} << 20; // bytes
    const auto fail = [&] {
        throw std::runtime_error(file.string() +
                                 ": cannot be read; check that it exists and is a readable file");
    };
    internal::refuse_pipe_or_device(file);
    std::ifstream stream(file, std::ios::binary);
    if (!stream || std::filesystem::is_directory(file)) fail();
    internal::Sha256 hash;
    std::string piece(kPiece, '\0');
    while (stream) {
        stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
        hash.add(std::string_view(piece).substr(0, static_cast<std::size_t>(stream.gcount())));
    }
    if (stream.bad()) fail();
    return hash.hexadecimal();
}

std::string sha256_of_text(std::string_view text) {
    internal::Sha256 hash;
    hash.add(text);
    return hash.hexadecimal();
}

} // namespace palpate
