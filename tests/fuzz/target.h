// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "tests/support/temporary_folder.h"

/// What fuzz targets share. A target is one source: it takes bytes that anybody may have made, and
/// either works on them or refuses them with one line. Anything else ends the process.
namespace palpate::test {

/// Ends the process where something that must hold does not.
inline void must(bool holds, const char* what, std::string_view about = "") {
    if (holds) return;
    std::fprintf(stderr, "%s: %.*s\n", what, static_cast<int>(about.size()), about.data());
    std::abort();
}

/// How often something was taken, not refused: so that a replay can see whether it was about
/// anything.
inline int taken = 0;

/// Whether `act` came to its end; false where it refused, which it must do with one short line.
template <class Act>
bool is_taken(const Act& act) {
    const auto must_be_said = [](const std::exception& error) {
        const std::string_view why = error.what();
        must(!why.empty() && why.find('\n') == std::string_view::npos, "no single line", why);
        must(why.size() < 2000, "not a short line", why);
    };
    try {
        act();
        ++taken;
        return true;
    } catch (const std::runtime_error& error) {
        must_be_said(error);
    } catch (const std::invalid_argument& error) {
        must_be_said(error);
    } // anything else ends the process
    return false;
}

/// A folder of the process's own, for files that a reader wants under a name.
inline const std::filesystem::path& own_folder() {
    static const TemporaryFolder folder;
    return folder.path();
}

/// The input as a file of that name in own_folder().
inline std::filesystem::path as_file(const char* name, std::string_view bytes) {
    const std::filesystem::path file = own_folder() / name;
    std::FILE* out = std::fopen(file.c_str(), "wb");
    must(out != nullptr, "cannot write", file.native());
    must(std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size(), "cannot write");
    std::fclose(out);
    return file;
}

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

/// Takes numbers from the input, one after the other; zeros behind its end.
class Input {
public:
    Input(const std::uint8_t* data, std::size_t size) : rest_(as_text(data, size)) {}

    bool is_empty() const { return rest_.empty(); }
    template <class Number>
    Number take() {
        static_assert(std::is_trivially_copyable_v<Number>);
        Number number{};
        const std::size_t there = rest_.size() < sizeof number ? rest_.size() : sizeof number;
        std::memcpy(&number, rest_.data(), there);
        rest_.remove_prefix(there);
        return number;
    }
    /// Of 0 .. below - 1; `below` is at most 256.
    unsigned choice(unsigned below) { return take<std::uint8_t>() % below; }
    /// of +-0.033 but for one in 256, else any double there is.
    double length() {
        const auto kind = take<std::uint8_t>();
        return kind < 255 ? 1e-6 * take<std::int16_t>() : take<double>();
    }
    std::string_view rest() const { return rest_; }

private:
    std::string_view rest_;
};

} // namespace palpate::test
