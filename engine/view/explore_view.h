// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <palpate/engine/info/data_file.h>
#include <palpate/engine/view/live_server.h>

namespace palpate {

/// How data are explored.
struct ExploreSettings {
    LiveServerSettings server;   ///< where the page is
    std::filesystem::path scene; ///< that is saved (.toml); where another file of that name is, the
                                 ///< first free one of NAME-2.toml and so on
};

/// Shows a volume, labels or a mesh to pages that choose an iso-value or labels, and save a starter
/// scene. Nothing is felt. Surfaces are made in a thread of their own, for each page the one that
/// it asked for last.
class ExploreView {
public:
    /// Serves from here on.                                                              [setup]
    /// Throws as LiveServer; std::runtime_error where there is nothing to choose: a volume whose
    /// values are all equal, labels of which there are none.
    ExploreView(DataFile data, const ExploreSettings& settings, std::string page);
    ~ExploreView();
    ExploreView(const ExploreView&) = delete;
    ExploreView& operator=(const ExploreView&) = delete;

    const LiveServer& server() const noexcept; ///< for its link and its counts            [any]

private:
    class View;
    std::unique_ptr<View> view_;
};

} // namespace palpate
