// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/info/starter_scene.h>
#include <palpate/engine/view/explore_view.h>
#include <palpate/engine/view/view_page.h>

namespace palpate::command {
namespace {

/// skull.toml of scans/skull.nii.gz, where the command was started.
std::filesystem::path scene_name(const ViewOptions& options) {
    if (!options.out.empty()) {
        std::filesystem::path scene = options.out;
        if (scene.extension() != ".toml")
            throw UsageError(
                fmt::format("-o {}: is written as a scene; name it .toml", options.out));
        std::error_code ignored;
        const std::filesystem::path folder = std::filesystem::absolute(scene).parent_path();
        if (!std::filesystem::is_directory(folder, ignored))
            throw std::runtime_error(fmt::format("{}: its folder does not exist; make {} first",
                                                 options.out, folder.string()));
        return scene;
    }
    std::filesystem::path file = std::filesystem::absolute(options.volume.file).lexically_normal();
    if (!file.has_filename()) file = file.parent_path();
    const std::string name = file.filename().string();
    return name.substr(0, name.find('.', 1)) + ".toml";
}

} // namespace

int view_explore(const ViewOptions& options) {
    outlive_readers();
    check_listen(options.listen, kWhoSeesAPage);
    ExploreSettings settings;
    settings.scene = scene_name(options);
    settings.server.address = options.listen.address;
    settings.server.port = options.port;
    std::string page = view_page(options.page);
    DataFile data =
        read_data_file(options.volume.file, read_settings(options.volume, options.mesh));
    if (const auto* volume = std::get_if<VoxelVolume>(&data.content))
        for (const std::string& warning : volume->warnings)
            tell("palpate: warning: {}: {}\n", options.volume.file, warning);
    const ExploreView view(std::move(data), settings, std::move(page));
    print("view: " + view.server().link());
    if (options.open) open_browser(view.server().link());
    const auto end =
        std::chrono::steady_clock::now() + std::chrono::duration<double>(options.seconds);
    constexpr std::chrono::milliseconds kLook{50};
    while (!stop_wanted() && !(std::chrono::steady_clock::now() >= end))
        std::this_thread::sleep_for(kLook);
    return kDone;
}

} // namespace palpate::command
