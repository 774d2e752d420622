// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/output_files.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/record/internal/recording_store.h>
#include <palpate/engine/record/trace_files.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/text/internal/film_mark.h>
#include <palpate/engine/text/internal/front_mark.h>
#include <palpate/engine/text/internal/mcap_mark.h>
#include <palpate/engine/text/internal/png_mark.h>
#include <palpate/engine/text/internal/vtp_mark.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/formats/volume_sources.h>
#include <palpate/volume/label_volume.h>

namespace palpate {
namespace {

// --- What Palpate writes

constexpr std::size_t kBeginning = 4096; // bytes: what marks a file is there

std::string beginning_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string text(kBeginning, '\0');
    stream.read(text.data(), kBeginning);
    text.resize(static_cast<std::size_t>(stream.gcount()));
    return text;
}

/// drift.csv: one column per method that was run, and nothing else.
bool is_drift(std::string_view text) {
    constexpr std::string_view first = "frame,time_s";
    if (!text.starts_with(first)) return false;
    text = text.substr(0, text.find('\n'));
    text.remove_prefix(first.size());
    while (text.starts_with(',')) {
        const std::size_t end = std::min(text.find(',', 1), text.size());
        const std::string_view column = text.substr(0, end);
        if (!column.ends_with("_radius_mm") && !column.ends_with("_level_um")) return false;
        text.remove_prefix(end);
    }
    return text.empty();
}

/// summary.json, or markups that say whose they are.
bool is_own_json(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    const nlohmann::json json = nlohmann::json::parse(stream, nullptr, false);
    if (json.is_object() && json.contains("markups") && json.contains("written_by"))
        return json.at("written_by") == "palpate";
    if (!json.is_object() || !json.contains("version") || !json.contains("machine")) return false;
    const auto scene = json.find("scene");
    return scene != json.end() && scene->is_object() && scene->contains("sha256");
}

bool is_of_study(std::string_view text) {
    constexpr std::array<std::string_view, 6> beginnings{
        internal::kFrontBeginning,        "method,setting,pace,scenes_own,",
        "source,frames,position_rms_um,", "run,part,count_per_frame,",
        "what,price_us,price_p10_us,",    "sweep,value,unit,contact,"};
    return is_drift(text) || std::any_of(beginnings.begin(), beginnings.end(),
                                         [&](std::string_view of) { return text.starts_with(of); });
}

bool is_page(std::string_view text) {
    const std::size_t title = text.find("<title>");
    if (!text.starts_with("<!DOCTYPE html>") || title == std::string_view::npos) return false;
    text = text.substr(title, text.find("</title>") - title);
    return text == "<title>Palpate report" || text == "<title>Palpate" ||
           text.ends_with(" (Palpate study)");
}

bool is_film(std::string_view beginning, const std::filesystem::path& file) {
    constexpr auto length = static_cast<std::streamoff>(internal::kFilmMark.size());
    std::ifstream stream(file, std::ios::binary);
    std::string end(internal::kFilmMark.size(), '\0');
    stream.seekg(-length, std::ios::end);
    return stream.read(end.data(), length) && internal::is_own_film(beginning, end);
}

// --- Which files are one

/// What makes two names one file, whatever links lead to it.
using Identity = std::pair<std::uint64_t, std::uint64_t>;

std::optional<Identity> identity_of(const std::filesystem::path& file) {
    struct stat found {};
    if (::stat(file.c_str(), &found) != 0) return std::nullopt;
    return Identity{found.st_dev, found.st_ino};
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
}

void check_folder(const std::filesystem::path& output) {
    const std::filesystem::path folder = std::filesystem::absolute(output).parent_path();
    std::error_code ignored;
    if (!std::filesystem::is_directory(folder, ignored))
        refuse(output, "its folder does not exist; make " + folder.string() + " first");
    if (::access(folder.c_str(), W_OK) != 0)
        refuse(output, "its folder cannot be written; name another one, or change its rights");
}

void check_replaced(const std::filesystem::path& output,
                    std::span<const std::filesystem::path> inputs, Replace replace) {
    std::error_code error;
    if (!std::filesystem::exists(std::filesystem::symlink_status(output, error))) return;
    if (!std::filesystem::is_regular_file(output, error))
        refuse(output, "is there and no ordinary file; name another output");
    const auto own = identity_of(output);
    for (const std::filesystem::path& input : inputs)
        if (own && identity_of(input) == own)
            refuse(output, fmt::format("is what is read as {}, and would be replaced; name another "
                                       "output",
                                       input.string()));
    if (replace == Replace::own && !is_written_by_palpate(output))
        refuse(output, "was not written by Palpate, and would be replaced; name another output, or "
                       "let it be replaced with --force");
}

} // namespace

void check_outputs(std::span<const std::filesystem::path> outputs,
                   std::span<const std::filesystem::path> inputs, Replace replace) {
    for (const std::filesystem::path& output : outputs) {
        check_folder(output);
        check_replaced(output, inputs, replace);
    }
}

bool is_written_by_palpate(const std::filesystem::path& file) {
    const std::string text = beginning_of(file);
    if (text.starts_with(kFramesColumns) || text.starts_with(kTimingColumns)) return true;
    if (is_of_study(text)) return true;
    if (text.starts_with(kPlyBeginning) || internal::is_own_png(text) || is_page(text)) return true;
    if (is_film(text, file)) return true;
    if (text.starts_with('{')) return is_own_json(file);
    if (text.starts_with(internal::kVtpBeginning) || internal::is_own_mcap(text)) return true;
    return internal::is_sealed_recording(file) || is_journal(file) || is_written_volume(file);
}

std::vector<std::filesystem::path> input_files(const SceneDescription& scene) {
    std::vector<std::filesystem::path> files{scene.file};
    for (const auto& [name, volume] : scene.volumes) {
        if (volume.file.empty()) continue;
        const std::vector<std::filesystem::path> data = source_files(volume.file, volume.selection);
        files.insert(files.end(), data.begin(), data.end());
        files.push_back(volume.labels);
        files.push_back(find_name_table(volume.file));
    }
    for (const auto& [name, surface] : scene.surfaces)
        files.push_back(surface.mesh);
    for (const EffectDescription& effect : scene.effects)
        files.push_back(file_of(effect));
    const auto add_device = [&](const DeviceDescription& device) {
        files.push_back(device.kind == DeviceDescription::Kind::recording
                            ? found_recording(device.file)
                            : device.file);
    };
    add_device(scene.device);
    for (const DeviceDescription& hand : scene.hands)
        add_device(hand);
    std::erase_if(files, [](const std::filesystem::path& file) { return file.empty(); });
    return files;
}

std::vector<std::filesystem::path> input_files(const Recording& recording,
                                               const std::filesystem::path& file) {
    std::vector<std::filesystem::path> files;
    try {
        SceneDescription scene = parse_scene(recording.scene_text, recording.scene_file);
        apply(overrides_from_json(recording.overrides), scene);
        files = input_files(scene);
    } catch (const std::runtime_error&) { // what it names is not there any more
        if (!recording.scene_file.empty()) files.emplace_back(recording.scene_file);
    }
    files.push_back(file);
    return files;
}

} // namespace palpate
