// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <palpate/engine/command/session.h>

namespace palpate::command {

/// What the command line of `palpate view` said.
struct ViewOptions {
    std::string what;      ///< the scene or recording
    std::string out;       ///< file or folder to write; empty: named after what is viewed
    std::string page;      ///< another page than the one that is built in; empty: that one
    std::string sub_steps; ///< as the command line has them
    std::string listen = "127.0.0.1";                         ///< address of this computer
    std::uint16_t port = 0;                                   ///< 0: any that is free
    bool allow_remote = false;                                ///< `listen` may be reached by others
    bool open = false;                                        ///< a browser is started
    bool no_button_marks = false;                             ///< buttons of the device drop none
    double seconds = std::numeric_limits<double>::infinity(); ///< of a scene, s
    std::optional<int> cpu;                                   ///< processor of the loop, from 0
    std::optional<std::string> device;                        ///< instead of the scene's
    Replace replace = Replace::own;                           ///< what of files that are there
};

/// Writes the page that plays a recording. Returns the exit code.                         [setup]
/// Throws std::runtime_error, UsageError: with what was asked for and what to do.
int view_recording(const ViewOptions& options);

/// Runs a scene in real time, and serves the page that shows it. Returns the exit code.   [setup]
/// Throws as view_recording().
int view_scene(const ViewOptions& options);

/// Starts the browser of the desktop. What comes of it is told by a thread of its own, as a browser
/// may take its time.                                                                     [setup]
void open_browser(const std::string& where);

} // namespace palpate::command
