// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/volume_options.h>
#include <palpate/engine/record/recording.h>

namespace palpate::command {

/// Of check_listen(): those who have a page's link.
inline constexpr const char* kWhoSeesAPage =
    "whoever reaches this address and has the link sees the scene, which may be a patient's, and "
    "moves the probe";

/// What it said of pictures and films without a window.
struct PictureOptions {
    std::string png;                 ///< folder for pictures; empty: none are asked for
    std::string film;                ///< MP4 file; empty: none is asked for
    std::optional<double> from_s;    ///< of the recording's time, s; none: from its first frame
    std::optional<double> to_s;      ///< of the recording's time, s; none: to its last frame
    std::optional<double> every_s;   ///< between pictures, s
    std::optional<double> rate_hz;   ///< pictures of a film in a second of it, Hz
    std::optional<double> speed;     ///< the recording's seconds in a second of the film
    std::optional<std::string> size; ///< "1280x720", pixels
    std::string seen_from;           ///< letter of a side; empty: as the page begins
    bool dark = false;               ///< light on dark
};

/// What the command line of `palpate view` said.
struct ViewOptions {
    VolumeOptions volume;           ///< its file: the scene, the recording, or data to explore
    MeshOptions mesh;               ///< of a mesh to explore
    std::string out;                ///< file or folder to write; empty: named after what is viewed
    std::string page;               ///< another page than the one that is built in; empty: that one
    std::string sub_steps;          ///< as the command line has them
    std::vector<std::string> given; ///< names of the options that were given, as "--port"
    ListenOptions listen;           ///< who reaches the page
    std::uint16_t port = 0;         ///< 0: any that is free
    bool open = false;              ///< a browser is started
    bool no_button_marks = false;   ///< buttons of the device drop none
    double seconds = std::numeric_limits<double>::infinity(); ///< of a scene, s
    std::optional<int> cpu;                                   ///< processor of the loop, from 0
    std::optional<std::string> device;                        ///< instead of the scene's
    std::optional<std::string> hand;                          ///< of several, the one that is shown
    Replace replace = Replace::own;                           ///< what of files that are there
    PictureOptions pictures;                                  ///< instead of a page
};

/// Writes the page that plays a recording. Returns the exit code.                         [setup]
/// Throws std::runtime_error, UsageError: with what was asked for and what to do.
int view_recording(const ViewOptions& options);

/// Reads a recording that can be shown: it has frames. Of several hands the one that is asked for,
/// or the first. [setup] Throws std::runtime_error, UsageError.
Recording read_shown(const std::filesystem::path& file, const std::optional<std::string>& hand);

/// The scene that was felt in a recording that was read from `file`. A view needs its surfaces as
/// they were; what else a replay needs does not matter.                                  [setup]
/// Throws as recorded_scene(), and of a run in which bodies moved.
std::shared_ptr<const Scene> felt_scene(const Recording& recording,
                                        const std::filesystem::path& file);

/// The page that plays `recording`, which was read from `file`, with the sub-steps of these frames.
/// [setup] Throws as view_recording().
std::string recording_page(const Recording& recording, const std::filesystem::path& file,
                           std::string_view page, std::span<const std::uint64_t> sub_steps);

/// Writes recording_page() with the sub-steps that the words of --sub-steps ask for.      [setup]
/// Throws as view_recording().
void write_playback(const Recording& recording, const std::filesystem::path& file,
                    const std::filesystem::path& out, const std::string& sub_steps,
                    const std::string& page = {});

/// The options of pictures and films.                                                     [setup]
void add_pictures(CLI::App& command, PictureOptions& options);

/// Whether pictures or a film are asked for.                                              [setup]
/// Throws UsageError where options of pictures are given, and none are asked for.
bool has_pictures(const PictureOptions& options);

/// Writes pictures or a film of a recording. Returns the exit code.                       [setup]
/// Throws as view_recording().
int view_pictures(const ViewOptions& options);

/// Runs a scene in real time, and serves the page that shows it. Returns the exit code.   [setup]
/// Throws as view_recording().
int view_scene(const ViewOptions& options);

/// Serves the page that explores a volume, labels or a mesh, until Ctrl-C. Returns the exit code.
/// [setup] Throws as view_recording().
int view_explore(const ViewOptions& options);

/// Starts the browser of the desktop. What comes of it is told by a thread of its own, as a browser
/// may take its time.                                                                     [setup]
void open_browser(const std::string& where);

} // namespace palpate::command
