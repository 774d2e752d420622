// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/command/run_display.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/loop/scene_warnings.h>
#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/view_page.h>

namespace palpate::command {
namespace {

/// Where a hand begins that a page moves: in front of the first surface, as a simulated one does,
/// or where there is none at the scene's origin.
Vec3 start_of(const Scene& scene) {
    if (scene.surfaces().empty()) return Vec3{0.0};
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

/// What moves the probe, in words; without a plug-in's folder, which is nobody's business, and
/// without options.
std::string device_in_words(const SceneDescription& scene, bool by_mouse) {
    if (by_mouse) return "page";
    DeviceDescription shown = scene.device;
    shown.address = shown.address.substr(0, shown.address.find('?'));
    if (shown.kind == DeviceDescription::Kind::plugin)
        shown.address = std::filesystem::path(shown.address).filename().string();
    return device_type(shown);
}

/// Refuses a folder for recordings that could not be made, before there is one to be lost.
void check_folder(const std::filesystem::path& folder) {
    std::error_code ignored;
    std::filesystem::path there = std::filesystem::absolute(folder);
    while (!std::filesystem::exists(there, ignored) && there.has_relative_path())
        there = there.parent_path();
    if (!std::filesystem::is_directory(there, ignored))
        throw std::runtime_error(
            fmt::format("{}: {} is no folder; name a folder for recordings with -o",
                        folder.string(), there.string()));
    if (::access(there.c_str(), W_OK) != 0)
        throw std::runtime_error(fmt::format(
            "{}: {} cannot be written; name another folder for recordings with -o, or change its "
            "rights",
            folder.string(), there.string()));
}

/// Which of several hands is shown, and how another one is.
std::string hand_in_words(const std::string& hand, const std::vector<std::string>& hands) {
    return hands.size() == 1 ? fmt::format(" (hand {})", hand)
                             : fmt::format(" (hand {} of {}; --hand NAME shows another)", hand,
                                           hands_in_words(hands));
}

} // namespace

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
    // A browser that stays has neither this program's sockets nor its Ctrl-C.
    posix_spawn_file_actions_t files{};
    posix_spawnattr_t how{};
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
    posix_spawnattr_init(&how);
    posix_spawnattr_setflags(&how, POSIX_SPAWN_SETPGROUP);
    const int failed =
        posix_spawnp(&process, program.c_str(), &files, &how, arguments.data(), environ);
    posix_spawnattr_destroy(&how);
    posix_spawn_file_actions_destroy(&files);
    if (failed != 0) return fail(where);
    std::thread([process, where, fail] {
        int status = 0;
        if (waitpid(process, &status, 0) == process && status != 0) fail(where);
    }).detach();
}

int view_scene(const ViewOptions& options) {
    outlive_readers();
    check_listen(options.listen, kWhoSeesAPage);
    if (options.replace == Replace::any)
        throw UsageError("--force: a scene's recordings take free names, and nothing is replaced; "
                         "leave it out");
    const SceneDescription whole = read_scene(options.volume.file);
    const std::vector<std::string> hands = hand_names(whole);
    SceneOverrides overrides;
    overrides.hand = options.hand;
    if (!overrides.hand && !hands.empty()) overrides.hand = hands.front();
    const SceneDescription given = changed_scene(whole, overrides);
    const bool by_mouse = options.device ? *options.device == "page"
                                         : given.device.kind == DeviceDescription::Kind::none;
    // A simulated hand knows where free space is; the page's begins there.
    overrides.device = by_mouse ? std::optional<std::string>("hand") : options.device;
    const SceneDescription description = changed_scene(whole, overrides);
    std::string page = view_page(options.page);
    try {
        check_duty(description.loop);
    } catch (const std::invalid_argument& error) {
        throw UsageError(fmt::format("view: {}", error.what()));
    }
    if (std::filesystem::path(options.out).extension() == ".html")
        throw UsageError(fmt::format("-o {}: of a scene it is the folder for what is recorded; a "
                                     "page is made of a recording: palpate view RECORDING -o {}",
                                     options.out, options.out));
    const std::string folder =
        options.out.empty() ? description.file.stem().string() + "-view" : options.out;
    check_folder(folder);
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    SteeredScene device(*scene, by_mouse);
    for (const std::string& warning : scene_warnings(*scene))
        tell("palpate: warning: {}\n", warning);
    for (const std::string& note : device.notes)
        tell("palpate: warning: {}\n", note);
    ViewDocument document = view_document(*scene, ViewMode::live);
    for (const std::string& why : document.not_shown)
        tell("palpate: note: the slices do without a volume: {}\n", plain_text(why));
    document.device = device_in_words(description, by_mouse);
    if (!hands.empty()) document.device += hand_in_words(*overrides.hand, hands);
    if (!options.hand && hands.size() > 1)
        tell("palpate: note: hand {} of {} is felt and shown, alone; --hand NAME shows another, "
             "and palpate trace --pace realtime runs all\n",
             *overrides.hand, hands_in_words(hands));

    LiveViewSettings settings;
    settings.server.address = options.listen.address;
    settings.server.port = options.port;
    settings.server.rate_hz = description.loop.rate_hz;
    settings.run.cpu = options.cpu;
    settings.run.longest_s = options.seconds;
    settings.overrides = overrides;
    settings.button_marks = !options.no_button_marks;
    settings.folder = folder;
    LiveView view(scene, std::move(document),
                  {*device.steered, device.placement(), device.mouse ? &*device.mouse : nullptr},
                  settings, std::move(page));
    print("view: " + view.server().link());
    if (options.open) open_browser(view.server().link());
    RunDisplay display(*scene, Shown::line);
    const SignalsOnlyAsk one_is_enough;
    view.run(display.watch());
    if (device.attached) {
        if (const std::string complaint = device_complaint(*device.attached->device);
            !complaint.empty())
            tell("palpate: warning: {}\n", complaint);
    }
    return kDone;
}
} // namespace palpate::command
