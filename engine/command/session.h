// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_overrides.h>

namespace palpate::command {

/// A scene with a run's options applied; wrong options are usage errors.
SceneDescription changed_scene(SceneDescription scene, const SceneOverrides& overrides);

/// The overrides with what --device said, once or more; wrong words are usage errors.
SceneOverrides with_devices(SceneOverrides overrides, const std::vector<std::string>& words);

/// The recording of that name, or the one in a folder of `palpate trace`; of a run that was cut
/// off, its journal.
std::filesystem::path named_recording(const std::string& named);

/// Refuses a scene with several hands, for a command that is of one: a usage error that names them.
void require_one_hand(const SceneDescription& scene);

/// Whether a device is in somebody's hand, and moves by the clock alone.
bool is_attached(const DeviceDescription& device) noexcept;

/// Whether a device that a hand holds has failed: it said nothing more until the end of a run.
class LostDevice {
public:
    explicit LostDevice(const SceneDescription& scene);
    void add(const RunFrame& run); ///< each frame of the run, in order
    /// What is wrong and what to do; empty: nothing is, or nothing is known, as of a stick that
    /// speaks only when it moves. `name`: the device's.
    std::string in_words(const std::string& name, const HapticDevice& device) const;

private:
    DeviceDescription::Kind kind_;
    double rate_hz_;
    std::uint64_t frames_ = 0; ///< without a state, up to the last one
};

/// Says on stderr what a user should know of how the scene's volumes and mesh files were read, each
/// once.
void warn_of_sources(const Scene& scene);

/// Where a server is reached, and by whom.
struct ListenOptions {
    std::string address = "127.0.0.1"; ///< of this computer, in digits
    bool allow_remote = false;         ///< others may reach it
};

/// Adds --listen and --allow-remote; `what` do others then, as "others may see the scene". [setup]
void add_listen(CLI::App& command, ListenOptions& options, const std::string& what);

/// Refuses an address that others may reach without their being allowed to: UsageError. `who` can
/// do what, as "whoever reaches this address sees the scene".                             [setup]
void check_listen(const ListenOptions& options, const std::string& who);

/// A word as a shell takes it for one argument: quoted where it has to be.
std::string for_a_shell(const std::string& word);

/// Refuses a name for a page that says it is something else: UsageError.
void check_page_name(const std::filesystem::path& page);

/// Refuses --every where nothing is taken row by row.
void check_every(const SceneDescription& scene, bool is_given);

/// A folder for results, made before the work; if nothing comes of it, a folder that was made goes
/// again. While it lives no other command writes results into it: each would replace the other's.
class ResultFolder {
public:
    /// Makes it, and those above it; throws std::runtime_error naming it, also where another
    /// command has it.
    explicit ResultFolder(std::filesystem::path folder);
    ~ResultFolder();
    ResultFolder(const ResultFolder&) = delete;
    ResultFolder& operator=(const ResultFolder&) = delete;

    std::filesystem::path operator/(const char* name) const { return folder_ / name; }
    /// The files of these names in it.
    std::vector<std::filesystem::path> files(std::span<const char* const> names) const;
    std::string string() const { return folder_.string(); }

private:
    std::filesystem::path folder_;
    bool made_ = false;
    int lock_ = -1; ///< the open folder; -1 where its file system knows no locks
};

} // namespace palpate::command
