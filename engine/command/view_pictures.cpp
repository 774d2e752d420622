// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/film_file.h>
#include <palpate/engine/view/internal/child_process.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/picture_browser.h>
#include <palpate/engine/view/view_page.h>

namespace palpate::command {
namespace {

constexpr double kUsualEvery_s = 1.0;
constexpr double kUsualRate_hz = 30.0;
constexpr std::size_t kMostPictures = 100'000; // some days of work

/// "1280x720", of which a film needs even numbers: colours are of two by two pixels there.
std::pair<int, int> size_of(const std::string& words, bool is_film) {
    constexpr std::array<int, 2> least{320, 240}, most{3840, 2160};
    std::array<int, 2> size{};
    const char* at = words.data();
    const char* const end = at + words.size();
    bool is_good = true;
    for (std::size_t i = 0; i < size.size() && is_good; ++i) {
        const auto read = std::from_chars(at, end, size[i]);
        is_good = read.ec == std::errc() && size[i] >= least[i] && size[i] <= most[i] &&
                  !(is_film && size[i] % 2 != 0) &&
                  (i == 0 ? read.ptr != end && *read.ptr == 'x' : read.ptr == end);
        at = i == 0 && is_good ? read.ptr + 1 : read.ptr;
    }
    if (!is_good)
        throw UsageError(fmt::format(
            "--size {}: give WIDTHxHEIGHT in pixels, from {}x{} to {}x{}{}", words, least[0],
            least[1], most[0], most[1], is_film ? ", even numbers for a film" : ""));
    return {size[0], size[1]};
}

/// An option that would change nothing.
void refuse(bool is_given, const char* name, const char* why) {
    if (is_given) throw UsageError(fmt::format("{}: {}; leave it out", name, why));
}

void check(const ViewOptions& options) {
    const PictureOptions& p = options.pictures;
    refuse(p.every_s && p.png.empty(), "--every", "a film has --fps and --speed");
    refuse(p.rate_hz && p.film.empty(), "--fps", "it is of a film; pictures have --every");
    refuse(p.speed && p.film.empty(), "--speed", "it is of a film; pictures have --every");
    if (!p.film.empty() && !p.film.ends_with(".mp4"))
        throw UsageError(
            fmt::format("--film {}: films are MP4; give a name that ends in .mp4", p.film));
}

/// The frame that is nearest to a time of the recording, s.
std::size_t nearest_frame(std::span<const FrameReport> frames, double time_s) {
    const auto after =
        std::lower_bound(frames.begin(), frames.end(), time_s,
                         [](const FrameReport& frame, double time) { return frame.time_s < time; });
    if (after == frames.begin()) return 0;
    const auto i = static_cast<std::size_t>(after - frames.begin());
    if (i == frames.size()) return i - 1;
    return time_s - frames[i - 1].time_s < frames[i].time_s - time_s ? i - 1 : i;
}

/// The frames of the pictures: of a film as long as the part that it shows, of single pictures with
/// both ends, each once.
std::vector<std::size_t> wanted_frames(const PictureOptions& options, const Recording& recording) {
    const std::vector<FrameReport>& frames = recording.frames;
    const double begin = frames.front().time_s, end = frames.back().time_s;
    const double from = options.from_s.value_or(begin), to = options.to_s.value_or(end);
    if (from < begin || to < from || to > end)
        // With all digits: what is told is taken where it is given back.
        throw UsageError(
            fmt::format("--from {} --to {}: the recording goes from {} to {} s; name a "
                        "part of that",
                        from, to, begin, end));
    const bool is_film = !options.film.empty();
    const double step = is_film
                            ? options.speed.value_or(1.0) / options.rate_hz.value_or(kUsualRate_hz)
                            : options.every_s.value_or(kUsualEvery_s);
    // The last frame lasts as long as the others do: 48 s are 1440 pictures at 30 Hz.
    const double period =
        frames.size() > 1 ? (end - begin) / static_cast<double>(frames.size() - 1) : 0.0;
    const double lasts = to - from + (to < end ? 0.0 : period);
    constexpr double kRounding = 1e-6; // of a step: times are sums of periods
    const double count = is_film ? std::max(1.0, std::round(lasts / step))
                                 : std::floor((to - from) / step + kRounding) + 1.0;
    if (count > static_cast<double>(kMostPictures))
        throw UsageError(
            fmt::format("{:.0f} pictures are more than {}; take a part of the recording "
                        "with --from and --to, or fewer pictures of it",
                        count, kMostPictures));
    std::vector<std::size_t> wanted;
    wanted.reserve(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        wanted.push_back(nearest_frame(frames, from + static_cast<double>(i) * step));
    if (!is_film) wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    return wanted;
}

/// What is drawn how, and who says how far it is.
struct Sitting {
    std::string page;                ///< that plays the recording
    PictureLook look;                ///< of all pictures
    std::vector<std::size_t> frames; ///< in the order of the pictures
    Progress progress;               ///< false: stop
};

/// Takes the pictures one by one. Throws std::runtime_error, also where a signal asked to stop.
void take(const Sitting& sitting, const std::filesystem::path& program,
          const std::function<void(std::size_t, const std::string&)>& keep) {
    PictureBrowser browser(program, sitting.page, sitting.look, [] { return !stop_wanted(); });
    const auto count = static_cast<double>(sitting.frames.size());
    for (std::size_t i = 0; i < sitting.frames.size(); ++i) {
        if (!sitting.progress(static_cast<double>(i) / count, "pictures"))
            throw std::runtime_error("stopped; nothing was written");
        keep(i, browser.png(sitting.frames[i]));
    }
    sitting.progress(1.0, "pictures");
}

std::string counted(std::size_t pictures) {
    return fmt::format("{} picture{}", pictures, pictures == 1 ? "" : "s");
}

/// All pictures have their names, or none has.
void write_pictures(const Sitting& sitting, const std::filesystem::path& program,
                    const std::filesystem::path& folder,
                    const std::vector<std::filesystem::path>& files) {
    const internal::TemporaryFolder parts(folder);
    take(sitting, program, [&](std::size_t i, const std::string& png) {
        write_whole_file(parts.path() / files[i].filename(), png);
    });
    for (const std::filesystem::path& file : files)
        std::filesystem::rename(parts.path() / file.filename(), file);
    print(fmt::format("view: {} in {}", counted(files.size()),
                      std::filesystem::absolute(folder).string()));
}

void write_film(const Sitting& sitting, const std::filesystem::path& program,
                const std::filesystem::path& encoder, const std::filesystem::path& file,
                double rate_hz) {
    FilmFile film(encoder, file, rate_hz, [] { return !stop_wanted(); });
    take(sitting, program, [&](std::size_t, const std::string& png) { film.add(png); });
    film.finish();
    print(fmt::format("view: {}: {}, {:.1f} s", std::filesystem::absolute(file).string(),
                      counted(sitting.frames.size()),
                      static_cast<double>(sitting.frames.size()) / rate_hz));
}

/// The pictures' files in their folder, by the numbers of their frames.
std::vector<std::filesystem::path> names_of(const std::filesystem::path& folder,
                                            std::span<const std::size_t> wanted,
                                            std::span<const FrameReport> frames) {
    std::vector<std::filesystem::path> names;
    names.reserve(wanted.size());
    for (const std::size_t i : wanted)
        names.push_back(folder / fmt::format("frame-{:06}.png", frames[i].frame));
    return names;
}

} // namespace

void add_pictures(CLI::App& command, PictureOptions& options) {
    CLI::Option* const png = command.add_option("--png", options.png,
                                                "of a recording: pictures (PNG) into this folder, "
                                                "by a browser without a window");
    CLI::Option* const film =
        command.add_option("--film", options.film, "of a recording: a film (MP4) of it, likewise");
    png->excludes(film);
    constexpr double most_s = 1e6;
    constexpr double any_s = 1e20; // a device's clock may be any, also one of ns since 1970
    command.add_option("--from", options.from_s, "pictures: from this time of the recording, s")
        ->check(between(-any_s, any_s));
    command.add_option("--to", options.to_s, "pictures: up to this time of the recording, s")
        ->check(between(-any_s, any_s));
    command.add_option("--every", options.every_s, "--png: s between pictures (default: 1)")
        ->check(between(1e-4, most_s));
    command.add_option("--fps", options.rate_hz, "--film: pictures a second (default: 30)")
        ->check(between(1.0, 240.0));
    command.add_option("--speed", options.speed, "--film: 0.1 is ten times as slow (default: 1)")
        ->check(between(1e-3, 1e3));
    command.add_option("--size", options.size,
                       "pictures: WIDTHxHEIGHT, pixels (default: 1280x720)");
    command.add_option("--seen-from", options.seen_from, "pictures: A, P, R, L, S or I")
        ->check(CLI::IsMember({"A", "P", "R", "L", "S", "I"}));
    command.add_flag("--dark", options.dark, "pictures: light on dark");
}

bool has_pictures(const PictureOptions& options) {
    if (!options.png.empty() || !options.film.empty()) return true;
    constexpr const char* why = "it is of pictures, and neither --png nor --film asks for any";
    refuse(options.from_s.has_value(), "--from", why);
    refuse(options.to_s.has_value(), "--to", why);
    refuse(options.every_s.has_value(), "--every", why);
    refuse(options.rate_hz.has_value(), "--fps", why);
    refuse(options.speed.has_value(), "--speed", why);
    refuse(options.size.has_value(), "--size", why);
    refuse(!options.seen_from.empty(), "--seen-from", why);
    refuse(options.dark, "--dark", why);
    return false;
}

int view_pictures(const ViewOptions& options) {
    check(options);
    const PictureOptions& wanted = options.pictures;
    const bool is_film = !wanted.film.empty();
    Sitting sitting;
    if (wanted.size)
        std::tie(sitting.look.width, sitting.look.height) = size_of(*wanted.size, is_film);
    sitting.look.from = wanted.seen_from;
    if (wanted.dark) sitting.look.scheme = PictureLook::Scheme::dark;
    const std::filesystem::path file = found_recording(options.volume.file);
    const Recording recording = read_shown(file, options.hand);
    sitting.frames = wanted_frames(wanted, recording);
    // What is asked for comes first: a wrong option is told where no browser is, too.
    const std::filesystem::path program = picture_browser();
    const std::filesystem::path encoder = is_film ? film_program() : std::filesystem::path();
    std::vector<std::filesystem::path> inputs = input_files(recording, file);
    inputs.push_back(marks_file(file));
    if (!options.page.empty()) inputs.emplace_back(options.page);
    std::optional<ResultFolder> folder;
    if (!is_film) folder.emplace(wanted.png);
    const std::vector<std::filesystem::path> outputs =
        is_film ? std::vector<std::filesystem::path>{wanted.film}
                : names_of(wanted.png, sitting.frames, recording.frames);
    check_outputs(outputs, inputs, options.replace);
    const std::string page = view_page(options.page);
    sitting.page = recording_page(recording, file, page, {});
    sitting.progress = progress_bar();
    if (::geteuid() == 0)
        tell("palpate: note: as you are root, the browser runs without its sandbox\n");
    const SignalsOnlyAsk one_is_enough; // a second would leave the browser behind
    if (is_film)
        write_film(sitting, program, encoder, wanted.film, wanted.rate_hz.value_or(kUsualRate_hz));
    else
        write_pictures(sitting, program, wanted.png, outputs);
    return kDone;
}
} // namespace palpate::command
