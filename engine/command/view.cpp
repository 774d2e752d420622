// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <memory>
#include <string_view>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/record/recorded_run.h>

namespace palpate::command {
namespace {

bool is_recording(const std::filesystem::path& file) {
    return file.extension() == ".h5" || is_journal(file);
}

/// The options with the recording, or the journal, in the place of a folder that a trace wrote.
ViewOptions with_recording(ViewOptions options) {
    const std::filesystem::path inside = named_recording(options.volume.file);
    std::error_code ignored;
    if (std::filesystem::exists(inside, ignored)) options.volume.file = inside.string();
    return options;
}

/// What is shown, as bits.
enum ShownAs : unsigned { kScene = 1, kData = 2, kPage = 4, kPictures = 8 };

constexpr const char* words_for(ShownAs shown) {
    switch (shown) {
    case kScene:
        return "a scene";
    case kData:
        return "neither a scene nor a recording, and nothing is felt yet";
    case kPage:
        return "a recording, which is played by a page without a loop or a server";
    default:
        return "a recording, of which pictures are asked for";
    }
}

/// Refuses an option that would change nothing.                                          [setup]
void check_used(const ViewOptions& options, ShownAs shown) {
    struct Use {
        std::string_view option;
        unsigned of; // what it is for
    };
    constexpr std::array<Use, 11> kUses{{{"--device", kScene},
                                         {"--hand", kScene | kPage | kPictures},
                                         {"--cpu", kScene},
                                         {"--no-button-marks", kScene},
                                         {"--port", kScene | kData},
                                         {"--seconds", kScene | kData},
                                         {"--listen", kScene | kData},
                                         {"--allow-remote", kScene | kData},
                                         {"--open", kScene | kData | kPage},
                                         {"--out", kScene | kData | kPage},
                                         {"--sub-steps", kPage}}};
    for (const std::string& given : options.given)
        for (const Use& use : kUses)
            if (given == use.option && (use.of & shown) == 0)
                throw UsageError(fmt::format("{}: {} is {}; leave it out", given,
                                             options.volume.file, words_for(shown)));
    if (shown == kData && options.replace == Replace::any)
        throw UsageError("--force: a page that explores data replaces nothing; leave it out");
}

int view(const ViewOptions& given) {
    const ViewOptions options = with_recording(given);
    const std::filesystem::path what = options.volume.file;
    const bool is_of_pictures = has_pictures(options.pictures);
    const bool is_played = is_recording(what);
    if (is_of_pictures && !is_played)
        throw UsageError(
            fmt::format("{}: is no recording (.h5), and pictures are of one; trace the "
                        "scene, or record while you look at it",
                        what.string()));
    std::error_code ignored;
    if (!is_played && what.extension() != ".toml" && std::filesystem::exists(what, ignored)) {
        check_used(options, kData);
        return view_explore(options);
    }
    check_used(options, !is_played ? kScene : is_of_pictures ? kPictures : kPage);
    static_cast<void>(read_settings(options.volume, options.mesh)); // refuses those of volumes
    if (is_played) return is_of_pictures ? view_pictures(options) : view_recording(options);
    return view_scene(options);
}

} // namespace

void add_view(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ViewOptions>();
    CLI::App* command = app.add_subcommand(
        "view", "shows a scene in a browser while it is felt, makes a page that plays a recording, "
                "or lets you look at data and choose what a scene feels");
    command
        ->add_option("SCENE|RECORDING|DATA", options->volume.file,
                     "scene (.toml), recording (.h5), or a volume, labels or a mesh, as for new")
        ->required();
    command->add_option("-o,--out", options->out,
                        "of a recording: HTML file to write; of a scene: folder for what is "
                        "recorded (default: the scene's name with -view); of data: scene to save "
                        "(default: the data's name with .toml)");
    command->add_option("--device", options->device,
                        "of a scene: page (its mouse moves the probe), or as for trace, instead of "
                        "the scene's; page where that has none");
    command->add_option("--hand", options->hand,
                        "of a scene or a recording with several hands: the one that is shown, by "
                        "its name (default: the first)");
    command->add_option("--port", options->port, "of the page (default: any that is free)")
        ->check(whole(0, 65535));
    command->add_flag("--open", options->open, "opens it in the desktop's browser");
    command->add_option("--seconds", options->seconds, "of a scene or data: ends after S seconds")
        ->check(between(1e-3, 1e6));
    command->add_option("--cpu", options->cpu, "processor for the loop, from 0")
        ->check(whole(0, 1023));
    command->add_flag("--no-button-marks", options->no_button_marks,
                      "of a scene: the device's button 0 drops no mark");
    add_listen(*command, options->listen,
               "others that have the link may see the scene and move the probe");
    command->add_option("--sub-steps", options->sub_steps,
                        "of a recording: FROM-TO, the frames whose sub-steps can be looked at, or "
                        "none (default: the 200 hardest)");
    command->add_option("--page", options->page, "another page than the one that is built in");
    add_pictures(*command, options->pictures);
    add_mesh_options(*command, options->mesh);
    add_volume_options(*command, options->volume);
    add_force(*command, options->replace);
    command->callback([options, command, &run] {
        for (const CLI::Option* option : command->get_options())
            if (option->count() > 0) options->given.push_back(option->get_name());
        run = [options] { return view(*options); };
    });
}
} // namespace palpate::command
