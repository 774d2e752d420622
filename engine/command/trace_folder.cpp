// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/trace_folder.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/command/command.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/text/plain_text.h>

namespace palpate::command {
namespace {

// Of all hands, and of each.
constexpr const char* kJournal = "recording.h5.part";
constexpr std::array<const char*, 3> kTraceFiles{"summary.json", "recording.h5", kJournal};
constexpr std::array<const char*, 2> kHandFiles{"frames.csv", "timing.csv"};
constexpr std::array<const char*, 2> kTables{"summary.json", "timing.csv"}; // not of Tables::frames

/// The hands that a summary.json has; none where there is none that can be read.
std::vector<std::string> hands_of_summary(const std::filesystem::path& file) {
    std::vector<std::string> hands;
    std::ifstream stream(file, std::ios::binary);
    const nlohmann::json summary = nlohmann::json::parse(stream, nullptr, false);
    if (!summary.is_object() || !summary.contains("hands") || !summary["hands"].is_array())
        return hands;
    for (const nlohmann::json& one : summary["hands"])
        if (one.is_object() && one.contains("hand") && one["hand"].is_string() &&
            is_hand_name(one["hand"].get_ref<const std::string&>()))
            hands.push_back(one["hand"]);
    return hands;
}

bool is_table_of_a_trace(const std::filesystem::path& file) {
    return std::find(kTables.begin(), kTables.end(), file.filename()) != kTables.end();
}

bool is_own_file(const std::filesystem::path& file) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(std::filesystem::symlink_status(file, ignored)) &&
           is_written_by_palpate(file);
}

/// Whether it is a folder that a hand of some run was written into: not a link, which leads to what
/// is somebody else's, and without a run of its own.
bool is_of_a_hand(const std::filesystem::path& folder) {
    std::error_code ignored;
    const auto is_there = [&](const char* name) {
        return std::filesystem::exists(std::filesystem::symlink_status(folder / name, ignored));
    };
    return std::filesystem::is_directory(std::filesystem::symlink_status(folder, ignored)) &&
           std::none_of(kTraceFiles.begin(), kTraceFiles.end(), is_there);
}

} // namespace

TraceFolder::TraceFolder(const std::string& folder, const SceneDescription& scene, Replace replace,
                         Tables tables)
    : all_(folder) {
    const std::vector<std::string> hands = hand_names(scene);
    for (const std::string& hand : hands)
        hands_.push_back(std::make_unique<ResultFolder>((all_ / hand.c_str()).string()));
    std::vector<std::filesystem::path> files = all_.files(kTraceFiles);
    for (std::size_t i = 0; i < std::max<std::size_t>(1, hands_.size()); ++i)
        for (std::filesystem::path& file : of_hand(i).files(kHandFiles))
            files.push_back(std::move(file));
    if (tables == Tables::frames) // tables of somebody else stay
        std::erase_if(files, [](const std::filesystem::path& file) {
            return is_table_of_a_trace(file) && !is_own_file(file);
        });
    check_outputs(files, input_files(scene), replace);
    find_earlier(hands, tables);
}

/// Of the hands that the summary there names, and of a run of one, whose files are not in a folder
/// of their own.
void TraceFolder::find_earlier(const std::vector<std::string>& hands, Tables tables) {
    std::vector<std::filesystem::path> folders;
    for (const std::string& hand : hands_of_summary(all_ / "summary.json"))
        if (std::find(hands.begin(), hands.end(), hand) == hands.end() &&
            is_of_a_hand(all_ / hand.c_str()))
            folders.push_back(all_ / hand.c_str());
    if (!hands.empty()) folders.emplace_back(all_.string());
    for (const std::filesystem::path& folder : folders)
        for (const char* name : kHandFiles)
            if (is_own_file(folder / name)) earlier_.push_back(folder / name);
    if (tables == Tables::all) return;
    for (const char* name : kTables)
        if (is_own_file(all_ / name)) earlier_.push_back(all_ / name);
}

void TraceFolder::keep_cut_off() const {
    const std::filesystem::path journal = all_ / kJournal;
    if (!is_own_file(journal)) return;
    std::error_code error;
    std::filesystem::path kept;
    for (int i = 1; kept.empty() || std::filesystem::exists(kept, error); ++i)
        kept = all_ / fmt::format("cut-off-{}.h5.part", i).c_str();
    std::filesystem::rename(journal, kept, error);
    if (error)
        throw std::runtime_error(
            fmt::format("{}: is all that there is of a run that was cut off, and cannot be renamed "
                        "({}); move it, or name another folder",
                        journal.string(), error.message()));
    tell("palpate: note: of an earlier run that was cut off, {} is now {}; palpate replay and "
         "palpate view take it\n",
         plain_text(journal.string()), kept.filename().string());
}

void TraceFolder::remove_earlier() const {
    const std::filesystem::path whole(all_.string());
    std::string names;
    for (const std::filesystem::path& file : earlier_) {
        std::error_code error;
        if (!std::filesystem::remove(file, error)) continue;
        names += (names.empty() ? "" : ", ") + file.lexically_relative(whole).string();
        if (file.parent_path() != whole)
            std::filesystem::remove(file.parent_path(), error); // fails where there is more
    }
    if (!names.empty())
        tell("palpate: note: removed what an earlier run had left: {}\n", plain_text(names));
}

} // namespace palpate::command
