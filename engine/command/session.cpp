// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/session.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/devices/hid_device.h>
#include <palpate/engine/loop/scene_warnings.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/record/recording_journal.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/text/plain_text.h>

namespace palpate::command {
namespace {

/// Whether a device that says nothing is at fault. A tool that another program tracks may rest, and
/// a stick may speak only when it moves.
bool speaks_always(DeviceDescription::Kind kind, const HapticDevice& device) {
    using Kind = DeviceDescription::Kind;
    return kind == Kind::plugin || kind == Kind::inverse3 ||
           (kind == Kind::hid && !may_rest(device));
}

/// A run in real time into a folder that has a recording, killed.
void warn_of_later_run(const std::filesystem::path& recording) {
    const std::filesystem::path journal = RecordingJournal::file_of(recording);
    std::error_code none, no_journal;
    const auto whole = std::filesystem::last_write_time(recording, none);
    const auto cut_off = std::filesystem::last_write_time(journal, no_journal);
    if (!none && !no_journal && whole < cut_off)
        tell("palpate: warning: {}: beside it is {}, of a later run that was cut off; give that "
             "name to look at it\n",
             plain_text(recording.string()), plain_text(journal.filename().string()));
}

} // namespace

SceneDescription changed_scene(SceneDescription scene, const SceneOverrides& overrides) {
    try {
        apply(overrides, scene);
        check_used(overrides, scene);
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
    return scene;
}

SceneOverrides with_devices(SceneOverrides overrides, const std::vector<std::string>& words) {
    try {
        for (const std::string& one : words)
            add_device(overrides, one);
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
    return overrides;
}

std::filesystem::path named_recording(const std::string& named) {
    std::filesystem::path file(named);
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored)) file /= "recording.h5";
    warn_of_later_run(file);
    return found_recording(file);
}

void require_one_hand(const SceneDescription& scene) {
    if (!scene.hands.empty())
        throw UsageError(fmt::format("{}: has the hands {}, and this is of one; add --hand {}",
                                     scene.file.string(), hands_in_words(hand_names(scene)),
                                     scene.hands.front().name));
}

bool is_attached(const DeviceDescription& device) noexcept {
    using Kind = DeviceDescription::Kind;
    return device.kind == Kind::hid || device.kind == Kind::plugin ||
           device.kind == Kind::inverse3 || device.kind == Kind::igtl;
}

LostDevice::LostDevice(const SceneDescription& scene)
    : kind_(scene.device.kind), rate_hz_(scene.loop.rate_hz) {}

void LostDevice::add(const RunFrame& run) {
    if (run.silence == Silence::none)
        frames_ = 0;
    else if (run.silence == Silence::device)
        ++frames_; // the loop's own silence, and the end, say nothing of the device
}

std::string LostDevice::in_words(const std::string& name, const HapticDevice& device) const {
    constexpr double kLost_s = 1.0; // what only stumbles is back by then
    const double silent_s = static_cast<double>(frames_) / rate_hz_;
    const bool always = speaks_always(kind_, device);
    if (silent_s < kLost_s || !(always || has_failed(device))) return {};
    return fmt::format("{}: gave no state in the last {:.1f} s of the run, and has failed; look at "
                       "{}, and run again",
                       name, silent_s,
                       always ? "its power and its cable" : "the program that sends it");
}

void add_listen(CLI::App& command, ListenOptions& options, const std::string& what) {
    CLI::Option* listen =
        command
            .add_option_function<std::string>(
                "--listen",
                [&options](const std::string& given) { // the server takes digits
                    options.address = given == "localhost" ? "127.0.0.1" : given;
                },
                "address of this computer to be reached at (default: 127.0.0.1, nobody else's)")
            ->type_name("TEXT");
    command.add_flag("--allow-remote", options.allow_remote, "with --listen: " + what)
        ->needs(listen);
}

void check_listen(const ListenOptions& options, const std::string& who) {
    const bool is_own = options.address.starts_with("127.") || options.address == "::1";
    if (is_own || options.allow_remote) return;
    throw UsageError(fmt::format("--listen {}: {}, and nothing on the way is encrypted; use "
                                 "ssh -L PORT:127.0.0.1:PORT instead, or add --allow-remote where "
                                 "that is meant",
                                 options.address, who));
}

std::string for_a_shell(const std::string& word) {
    constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                   "_-./+:=@%,";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
    std::string quoted = "'";
    for (const char letter : word)
        quoted += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
    return quoted + "'";
}

void check_page_name(const std::filesystem::path& page) {
    if (page.extension() == ".html" || page.extension() == ".htm") return;
    throw UsageError(fmt::format("-o {}: is written as a page; name it .html", page.string()));
}

void check_every(const SceneDescription& scene, bool is_given) {
    if (!is_given) return;
    for (const SceneDescription& hand : each_hand(scene)) {
        if (takes_every(hand.device)) continue;
        throw UsageError(
            fmt::format("--every: takes each K-th row of a path or an orbit, and the "
                        "device{} is neither; leave it out",
                        hand.device.name.empty() ? "" : " of hand " + hand.device.name));
    }
}

void warn_of_sources(const Scene& scene) {
    for (const std::string& warning : source_warnings(scene))
        tell("palpate: warning: {}\n", warning);
}

ResultFolder::ResultFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::error_code error;
    made_ = std::filesystem::create_directories(folder_, error);
    if (!std::filesystem::is_directory(folder_))
        throw std::runtime_error(
            fmt::format("{}: cannot be made a folder; name another one", folder_.string()));
    lock_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
    ::close(lock_);
    throw std::runtime_error(fmt::format(
        "{}: another command is writing into it; wait for that one, or name another folder",
        folder_.string()));
}

std::vector<std::filesystem::path> ResultFolder::files(std::span<const char* const> names) const {
    std::vector<std::filesystem::path> files;
    for (const char* name : names)
        files.push_back(folder_ / name);
    return files;
}

ResultFolder::~ResultFolder() {
    if (lock_ >= 0) ::close(lock_);
    std::error_code ignored;
    if (made_) std::filesystem::remove(folder_, ignored); // fails, as it should, where it has files
}

} // namespace palpate::command
