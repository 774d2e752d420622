// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/command/run_display.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/sub_steps.h>
#include <palpate/engine/view/view_page.h>

namespace palpate::command {
namespace {

struct ViewOptions {
    std::string what;
    std::string out;
    std::string page;
    std::string sub_steps; // as the command line has them
    std::string listen = "127.0.0.1";
    std::uint16_t port = 0;
    bool allow_remote = false;
    bool open = false;
    double seconds = std::numeric_limits<double>::infinity();
    std::optional<int> cpu;
    std::optional<std::string> device;
    Replace replace = Replace::own;
};

bool is_recording(const std::filesystem::path& file) {
    return file.extension() == ".h5" || is_journal(file);
}

/// Starts the browser of the desktop. What comes of it is told by a thread of its own, as a browser
/// may take its time.
void open_browser(const std::string& where) {
    std::string program = "xdg-open";
    std::string argument = where;
    std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
    pid_t process = 0;
    const auto fail = [](const std::string& link) {
        tell("palpate: warning: --open: no browser could be started with xdg-open; install one, or "
             "open this yourself: {}\n",
             link);
    };
    if (posix_spawnp(&process, program.c_str(), nullptr, nullptr, arguments.data(), environ) != 0)
        return fail(where);
    std::thread([process, where, fail] {
        int status = 0;
        if (waitpid(process, &status, 0) == process && status != 0) fail(where);
    }).detach();
}

// A recording.

/// The scene that was felt. A view needs its surfaces as they were; what else a replay needs does
/// not matter.
std::shared_ptr<const Scene> felt_scene(const Recording& recording,
                                        const std::filesystem::path& file) {
    constexpr std::uint32_t kOther = kBodyMoved | kSceneAdopted;
    for (const FrameReport& frame : recording.frames)
        if ((frame.flags & kOther) != 0)
            throw std::runtime_error(fmt::format(
                "{}: from frame {} on its surfaces were not where its scene has them, which a "
                "recording does not keep; record a run for each scene, with its bodies in place",
                file.string(), frame.frame));
    Recording alone = recording;
    static_cast<Run&>(alone) = {};
    return recorded_scene(alone, file, resources());
}

/// The frames that a reader wants the sub-steps of: "FROM-TO", "none", or the hardest ones.
std::vector<std::uint64_t> wanted_frames(const std::string& words, const Run& run) {
    constexpr std::size_t kHardest = 200;
    constexpr std::uint64_t kMost = 10'000;
    if (words.empty()) return hard_frames(run, kHardest);
    if (words == "none") return {};
    std::uint64_t from = 0, to = 0;
    const char* end = words.data() + words.size();
    const auto first = std::from_chars(words.data(), end, from);
    const bool has_dash = first.ec == std::errc() && first.ptr != end && *first.ptr == '-';
    const auto last = has_dash ? std::from_chars(first.ptr + 1, end, to) : first;
    if (!has_dash || last.ec != std::errc() || last.ptr != end || to < from || to - from >= kMost)
        throw UsageError(
            fmt::format("--sub-steps {}: give FROM-TO, frames of the recording, at most "
                        "{} of them, as 1200-1300; or none",
                        words, kMost));
    std::vector<std::uint64_t> frames;
    for (std::uint64_t frame = from; frame <= to; ++frame)
        frames.push_back(frame);
    return frames;
}

/// The recording's scene, and the sub-steps of the frames that are wanted, computed again. A
/// recording that cannot be computed again plays without them.
std::shared_ptr<const Scene> replayed_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            std::span<const std::uint64_t> wanted,
                                            std::vector<ViewFrameSteps>& sub_steps) {
    if (wanted.empty()) return felt_scene(recording, file);
    std::shared_ptr<const Scene> scene;
    try {
        scene = recorded_scene(recording, file, resources());
    } catch (const std::runtime_error& error) {
        std::shared_ptr<const Scene> felt = felt_scene(recording, file);
        tell("palpate: note: the page has no sub-steps: {}\n", error.what());
        return felt;
    }
    sub_steps = sub_steps_of(scene, recording, wanted, progress_bar());
    return scene;
}

int view_recording(const ViewOptions& options) {
    const std::filesystem::path file = found_recording(options.what);
    const std::filesystem::path out =
        options.out.empty() ? file.stem().string() + ".html" : options.out;
    const Recording recording = read_recording(file);
    if (recording.frames.empty())
        throw std::runtime_error(file.string() + ": has no frames to play; record a longer run");
    const std::array<std::filesystem::path, 1> outputs{out};
    std::vector<std::filesystem::path> inputs = input_files(recording, file);
    inputs.push_back(marks_file(file));
    check_outputs(outputs, inputs, options.replace);
    const std::vector<std::uint64_t> wanted = wanted_frames(options.sub_steps, recording);
    const std::string page = view_page(options.page);
    std::vector<ViewFrameSteps> sub_steps;
    const auto scene = replayed_scene(recording, file, wanted, sub_steps);
    ViewDocument document = view_document(*scene, ViewMode::playback);
    document.device = recording.device.name;
    document.marks = read_marks(marks_file(file));
    document.sub_steps = std::move(sub_steps);
    const ViewDetail detail{{30'000, 400'000}};
    const ViewFrames frames{recording.frames, recording.frames.front().frame, 0};
    write_whole_file(out, playback_page(page, scene_message(document, detail, &frames)));
    print(fmt::format("view: {}", std::filesystem::absolute(out).string()));
    if (options.open) open_browser(std::filesystem::absolute(out).string());
    return kDone;
}

// A scene.

/// Where a hand begins that a page moves: in front of the first surface, as a simulated one does.
Vec3 start_of(const Scene& scene) {
    const SceneDevice hand = make_device(scene);
    DeviceState state;
    hand.device->read(state);
    return hand.placement.to_scene(state).position;
}

/// A scene's device as a page may steer it. What it refers to, it holds.
struct SteeredScene {
    explicit SteeredScene(const Scene& scene, bool by_mouse) {
        const SceneDescription& description = scene.description();
        const double rate_hz = description.loop.rate_hz;
        if (by_mouse) {
            mouse.emplace(start_of(scene), rate_hz);
            steered.emplace(*mouse);
        } else if (is_sequence(description.device)) {
            steered.emplace(device_states(scene, 1, &notes), rate_hz);
        } else {
            attached = make_device(scene);
            steered.emplace(*attached->device);
        }
    }
    DevicePlacement placement() const { return attached ? attached->placement : DevicePlacement(); }

    std::optional<PageDevice> mouse;
    std::optional<SceneDevice> attached;
    std::optional<SteeredDevice> steered;
    std::vector<std::string> notes;
};

/// What moves the probe, in words.
std::string device_in_words(const SceneDescription& scene, bool by_mouse) {
    using Kind = DeviceDescription::Kind;
    if (by_mouse) return "page";
    switch (scene.device.kind) {
    case Kind::path:
        return "path";
    case Kind::orbit:
        return "orbit";
    case Kind::tour:
        return "tour";
    case Kind::recording:
        return "recording";
    case Kind::hand:
        return "hand";
    case Kind::hid:
        return "hid:" + scene.device.address;
    case Kind::none:
        break;
    }
    return "none";
}

void check_listen(const ViewOptions& options) {
    const bool is_own = options.listen.starts_with("127.") || options.listen == "::1";
    if (!is_own && !options.allow_remote)
        throw UsageError(fmt::format(
            "--listen {}: whoever reaches this address and has the link sees the scene, which may "
            "be a patient's, and moves the probe, and nothing on the way is encrypted; use "
            "ssh -L PORT:127.0.0.1:PORT instead, or add --allow-remote where that is meant",
            options.listen));
}

int view_scene(const ViewOptions& options) {
    outlive_readers();
    check_listen(options);
    const SceneDescription given = read_scene(options.what);
    const bool by_mouse = options.device ? *options.device == "page"
                                         : given.device.kind == DeviceDescription::Kind::none;
    SceneOverrides overrides;
    // A simulated hand knows where free space is; the page's begins there.
    overrides.device = by_mouse ? std::optional<std::string>("hand") : options.device;
    const SceneDescription description = changed_scene(given, overrides);
    std::string page = view_page(options.page);
    try {
        check_duty(description.loop);
    } catch (const std::invalid_argument& error) {
        throw UsageError(fmt::format("view: {}", error.what()));
    }
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    SteeredScene device(*scene, by_mouse);
    for (const std::string& warning : scene_warnings(*scene))
        tell("palpate: warning: {}\n", warning);
    for (const std::string& note : device.notes)
        tell("palpate: warning: {}\n", note);
    ViewDocument document = view_document(*scene, ViewMode::live);
    document.device = device_in_words(description, by_mouse);

    LiveViewSettings settings;
    settings.server.address = options.listen;
    settings.server.port = options.port;
    settings.server.rate_hz = description.loop.rate_hz;
    settings.run.cpu = options.cpu;
    settings.run.longest_s = options.seconds;
    settings.overrides = overrides;
    settings.folder =
        options.out.empty() ? description.file.stem().string() + "-view" : options.out;
    LiveView view(scene, std::move(document),
                  {*device.steered, device.placement(), device.mouse ? &*device.mouse : nullptr},
                  settings, std::move(page));
    print("view: " + view.server().link());
    if (options.open) open_browser(view.server().link());
    RunDisplay display(*scene, Shown::line);
    const SignalsOnlyAsk one_is_enough;
    view.run(display.watch());
    return kDone;
}

int view(const ViewOptions& options) {
    const std::filesystem::path what = options.what;
    if (is_recording(what)) return view_recording(options);
    if (std::filesystem::exists(what) && what.extension() != ".toml")
        throw UsageError(fmt::format("{}: is neither a scene (.toml) nor a recording (.h5); make a "
                                     "scene that feels it, docs/first_steps.md says how",
                                     what.string()));
    return view_scene(options);
}

} // namespace

void add_view(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ViewOptions>();
    CLI::App* command = app.add_subcommand(
        "view", "shows a scene in a browser while it is felt, or makes a page that plays a "
                "recording");
    command->add_option("SCENE|RECORDING", options->what, "scene (.toml) or recording (.h5)")
        ->required();
    command->add_option("-o,--out", options->out,
                        "of a recording: HTML file to write; of a scene: folder for what is "
                        "recorded (default: the scene's name with -view)");
    command->add_option("--device", options->device,
                        "of a scene: page (its mouse moves the probe), or as for trace, instead of "
                        "the scene's; page where that has none");
    command->add_option("--port", options->port, "of the page (default: any that is free)")
        ->check(CLI::Range(0, 65535));
    command->add_flag("--open", options->open, "opens it in the desktop's browser");
    command->add_option("--seconds", options->seconds, "of a scene: ends after S seconds")
        ->check(between(1e-3, 1e6));
    command->add_option("--cpu", options->cpu, "processor for the loop, from 0")
        ->check(CLI::Range(0, 1023));
    command->add_option("--listen", options->listen,
                        "address of this computer to be reached at (default: 127.0.0.1, nobody "
                        "else's)");
    command->add_flag("--allow-remote", options->allow_remote,
                      "with --listen: others that have the link may see the scene and move the "
                      "probe");
    command->add_option("--sub-steps", options->sub_steps,
                        "of a recording: FROM-TO, the frames whose sub-steps can be looked at, or "
                        "none (default: the 200 hardest)");
    command->add_option("--page", options->page, "another page than the one that is built in");
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return view(*options); }; });
}

} // namespace palpate::command
