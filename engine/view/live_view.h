// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/view/live_server.h>
#include <palpate/engine/view/view_devices.h>
#include <palpate/engine/view/view_document.h>

namespace palpate {

/// How a scene is felt and shown at the same time.
struct LiveViewSettings {
    LiveServerSettings server;    ///< where the page is
    RealtimeSettings run;         ///< of the loop; `keep` is as recordings need it
    SceneOverrides overrides;     ///< that the scene was made with, for recordings
    std::filesystem::path folder; ///< of recordings; made with the first one
    ViewDetail detail;            ///< of the scene's first message
    bool button_marks = true;     ///< the device's button 0 drops a mark where the proxy is
};

/// Who moves the probe.
struct LiveDevice {
    SteeredDevice& device;       ///< what the loop reads
    DevicePlacement placement;   ///< device frame to scene frame
    PageDevice* mouse = nullptr; ///< what `device` steers where a page's mouse is the device
};

/// Runs a scene in real time, and shows it to pages that may change gains, move the mouse's probe,
/// freeze, begin anew, mark places and record. A recording is a run of its own: the loop begins
/// anew with it, so that it can be replayed from its first frame.
class LiveView {
public:
    /// Serves from here on; pages see the scene before it is felt. The device must outlive this.
    /// [setup] Throws as LiveServer.
    LiveView(std::shared_ptr<const Scene> scene, ViewDocument document, const LiveDevice& device,
             const LiveViewSettings& settings, std::string page);
    ~LiveView();
    LiveView(const LiveView&) = delete;
    LiveView& operator=(const LiveView&) = delete;

    const LiveServer& server() const noexcept; ///< for its link and its counts          [any]

    /// Until `watch.progress` says so, or a limit of the run is reached; `watch` is told as by
    /// run_realtime(). A recording that is under way is written.                          [setup]
    /// Throws as run_realtime().
    void run(const RunWatch& watch);

private:
    class View;
    std::unique_ptr<View> view_;
};

/// The file of marks beside a recording: recording.mrk.json of recording.h5 and of its journal.
/// [any]
std::filesystem::path marks_file(const std::filesystem::path& recording);

/// Marks as 3D Slicer reads them (markups, fiducials in mm, LPS).                         [setup]
std::string marks_as_json(const std::vector<ViewMark>& marks);

/// Marks beside a recording; none where there is no such file.                            [setup]
/// Throws std::runtime_error "FILE: what is wrong; what to do".
std::vector<ViewMark> read_marks(const std::filesystem::path& file);

} // namespace palpate
