// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>

namespace palpate {

/// The program that makes films: ffmpeg in $PATH.                                         [setup]
/// Throws std::runtime_error saying what to install where there is none.
std::filesystem::path film_program();

/// A film (MP4, H.264) that is written picture by picture. It has its name when it is finished, and
/// not before; without that, nothing stays of it.
class FilmFile {
public:
    using GoOn = std::function<bool()>; ///< false: somebody wants to stop

    /// `rate_hz`: pictures a second, [1, 240].                                           [setup]
    /// Throws std::runtime_error where `program` cannot be started.
    FilmFile(const std::filesystem::path& program, const std::filesystem::path& file,
             double rate_hz, GoOn go_on);
    ~FilmFile();
    FilmFile(const FilmFile&) = delete;
    FilmFile& operator=(const FilmFile&) = delete;

    /// Adds a picture (PNG); all have the size of the first, which is even both ways.    [setup]
    /// Throws std::runtime_error with the program's words.
    void add(std::string_view png);
    /// Ends the film; an older file of its name is replaced. [setup] Throws as add().
    void finish();

private:
    class Encoder;
    std::unique_ptr<Encoder> encoder_;
};

} // namespace palpate
