// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/film_file.h>

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/text/internal/film_mark.h>
#include <palpate/engine/view/internal/child_process.h>

namespace palpate {
namespace {

using internal::ChildProcess;
using std::chrono::seconds;

constexpr seconds kPicture{60}; // until a picture is taken
constexpr seconds kEnd{600};    // until the last ones are written, and their index before them

/// H.264 as every player reads it; 18 is where eyes see no loss.
std::vector<std::string> film_options(double rate_hz, const std::filesystem::path& file) {
    return {"-hide_banner", "-nostdin", "-loglevel",  "error",      "-f",
            "image2pipe",   "-c:v",     "png",        "-framerate", fmt::format("{}", rate_hz),
            "-i",           "pipe:0",   "-c:v",       "libx264",    "-crf",
            "18",           "-pix_fmt", "yuv420p",    "-movflags",  "+faststart",
            "-f",           "mp4",      file.string()};
}

} // namespace

std::filesystem::path film_program() {
    std::filesystem::path found = internal::found_program({"ffmpeg"});
    if (found.empty())
        throw std::runtime_error("films need ffmpeg, and there is none in PATH; install it "
                                 "(apt-get install ffmpeg), or write pictures with --png");
    return found;
}

class FilmFile::Encoder {
public:
    Encoder(const std::filesystem::path& program, const std::filesystem::path& file, double rate_hz,
            GoOn go_on)
        : file_(file), go_on_(std::move(go_on)),
          folder_(std::filesystem::absolute(file).parent_path()),
          part_(folder_.path() / "film.mp4"),
          process_(program, film_options(rate_hz, part_), {STDIN_FILENO}, folder_.path()) {}

    void add(std::string_view png) {
        if (!process_.write(png, ChildProcess::Clock::now() + kPicture, go_on_))
            fail("takes no more pictures");
    }

    void finish() {
        process_.end_input();
        const auto status = process_.wait(ChildProcess::Clock::now() + kEnd, go_on_);
        if (!status) fail("does not end");
        if (*status != 0) fail(fmt::format("ended with {}", *status));
        std::ofstream film(part_, std::ios::binary | std::ios::app);
        film << internal::kFilmMark;
        film.close();
        if (!film) fail("has left no room for the film's end");
        std::error_code error;
        std::filesystem::rename(part_, file_, error);
        if (error) fail("wrote a film that cannot have its name: " + error.message());
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        const std::string words = process_.last_words();
        throw std::runtime_error(
            fmt::format("{}: cannot be written, as ffmpeg {}{}; check that there is room, or write "
                        "pictures with --png",
                        file_.string(), what, words.empty() ? "" : " (" + words + ")"));
    }

    std::filesystem::path file_;
    GoOn go_on_;
    internal::TemporaryFolder folder_; // outlives the program, which writes into it
    std::filesystem::path part_;
    ChildProcess process_;
};

FilmFile::FilmFile(const std::filesystem::path& program, const std::filesystem::path& file,
                   double rate_hz, GoOn go_on)
    : encoder_(std::make_unique<Encoder>(program, file, rate_hz, std::move(go_on))) {}

FilmFile::~FilmFile() = default;

void FilmFile::add(std::string_view png) { encoder_->add(png); }

void FilmFile::finish() { encoder_->finish(); }

} // namespace palpate
