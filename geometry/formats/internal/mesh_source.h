// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::internal {

/// The bytes of a mesh file, where reading has come to, and how to complain about it. The views
/// that it hands out live as long as it does.
class MeshSource {
public:
    /// Reads the whole file. Throws std::runtime_error "FILE: what is wrong; what to do".  [setup]
    explicit MeshSource(const std::filesystem::path& file);

    /// Throw std::runtime_error "FILE: what", "FILE:LINE: what" with the line of what line() or
    /// word() gave last, or with that of a byte of the file.
    [[noreturn]] void fail(const std::string& what) const;
    [[noreturn]] void fail_here(const std::string& what) const;
    [[noreturn]] void fail_at(std::size_t byte, const std::string& what) const;

    /// The next line without its end; nothing at the end of the file.
    std::optional<std::string_view> line();
    /// The next word between white space; nothing at the end of the file.
    std::optional<std::string_view> word();
    /// The next bytes; null when there are fewer.
    const char* bytes(std::size_t count);

    std::string_view text() const { return text_; }
    std::size_t left() const { return text_.size() - at_; } ///< bytes
    std::size_t here() const { return given_; } ///< byte at which what was given last begins

private:
    std::string file_;
    std::string text_;
    std::size_t at_ = 0;
    std::size_t given_ = 0;
};

/// The words of a line between white space; NUL counts as such (headers are padded with it).
std::vector<std::string_view> words_of(std::string_view line);

/// The whole word as a number, a plus sign allowed; nothing when it is none.
std::optional<double> number_in(std::string_view word);

} // namespace palpate::internal
