// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/view/label_slices.h>
#include <palpate/engine/view/slice_voxels.h>
#include <palpate/engine/view/sub_steps.h>
#include <palpate/engine/view/view_command.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// What a page is used for.
enum class ViewMode : std::uint8_t {
    live,     ///< while a loop runs
    playback, ///< of a recording
    explore   ///< of data that nothing is felt of yet
};

/// A surface to be drawn.
struct ViewStructure {
    std::string name;     ///< of the surface in the scene
    std::string material; ///< what it is made of and how it is felt, in words
    std::string color;    ///< sRGB, "#rrggbb"
    int bit = -1;         ///< of FrameReport::surfaces_felt, below 32; -1: it has none there
    std::shared_ptr<const TriangleMesh> mesh; ///< m, scene frame; null: nothing to draw
};

/// An effect whose gain a page may change.
struct ViewEffect {
    std::size_t id = 0; ///< index into SceneDescription::effects
    std::string name;   ///< of its surface or volume, or its kind where it has neither
    std::string kind;   ///< as scenes spell it
};

/// A place with a name.
struct ViewMark {
    std::string name;                  ///< given by a user
    Vec3 at{0.0};                      ///< m, scene frame
    std::optional<double> time_s = {}; ///< the device's time when it was dropped; none: not known
    std::string felt;                  ///< names of the surfaces that were felt then, "a+b"
};

/// What there is to choose of data that are explored.
struct ViewChoice {
    std::string data;                     ///< "volume", "labels" or "mesh"
    std::array<double, 2> range{};        ///< of a volume: smallest and largest value
    std::optional<double> iso;            ///< of a volume: Otsu's threshold, where there is one
    std::vector<std::uint32_t> histogram; ///< of a volume: voxels in equal steps of `bounds`
    std::array<double, 2> bounds{};       ///< of the histogram: nearly all values are in it
    Box bounds_m;                         ///< around the data, m, scene frame
    std::vector<std::size_t> chosen;      ///< of labels: structures that are shown at first
    std::string scene;                    ///< file that a scene is saved to
};

/// What a page shows, without its frames.
struct ViewDocument {
    ViewMode mode = ViewMode::live;        ///< what the page is for
    std::string title;                     ///< as "skull.toml"
    std::string method;                    ///< of the loop, as scenes spell it
    std::string device;                    ///< what moves the probe
    double rate_hz = 1000.0;               ///< frames a second, Hz
    double force_limit_n = 5.0;            ///< longest force, N
    std::vector<ViewStructure> structures; ///< in the order of Scene::surfaces()
    std::vector<SliceVoxels> volumes;      ///< for slices
    std::vector<std::string> not_shown;    ///< why a volume that nothing feels is not among them
    std::vector<LabelSlices> labels;       ///< for slices, over the volumes or alone
    std::vector<ViewEffect> effects;       ///< those that are on
    std::vector<ViewMark> marks;           ///< places that were marked
    std::vector<ViewFrameSteps> sub_steps; ///< of some frames of a playback
    std::optional<ViewChoice> choice;      ///< where data are explored
};

/// The document of a scene: its surfaces as meshes (their own, else the preview of their field, of
/// a formula on a grid of 96 nodes), in the colours of a segmentation or in ours; its volumes of
/// scalars and labels for slices. Reads their files again.                                [setup]
/// Throws std::runtime_error as read_volume() and read_label_volume().
ViewDocument view_document(const Scene& scene, ViewMode mode);

/// Its surfaces alone.                                                                   [setup]
/// Throws std::runtime_error as read_label_volume().
std::vector<ViewStructure> view_structures(const Scene& scene);

/// How detailed meshes are sent.
struct ViewDetail {
    /// Most triangles of all structures together, one number for each level of detail, rising.
    std::vector<std::size_t> triangles{30'000};
};

/// Frames in a row.
struct ViewFrames {
    std::span<const FrameReport> frames; ///< scene frame, SI
    std::uint64_t first = 0;             ///< index of the first one since the page's run began
    std::uint64_t lost = 0;              ///< how many before these were not sent
};

/// The container of kind "scene" (docs/view_protocol.md), with `frames` where there are any: null
/// of a live page. [setup]
std::string scene_message(const ViewDocument& document, const ViewDetail& detail,
                          const ViewFrames* frames = nullptr);

/// The container of kind "frames".                                                         [setup]
std::string frames_message(const ViewFrames& frames);

/// The container of kind "mesh": one structure, `id` counting document.structures, with at most
/// `most_triangles` of them, 1 or more.                                                     [setup]
/// Throws std::invalid_argument where there is no such structure, or nothing to draw.
std::string mesh_message(const ViewDocument& document, std::size_t id, std::size_t most_triangles);

/// The same of several structures, by `id`, for a page that draws them in the place of those that
/// it has: with every level of `detail`, and the iso-value where they are of one. [setup]
std::string chosen_message(const std::map<std::size_t, ViewStructure>& structures,
                           const ViewDetail& detail, std::optional<view_commands::Iso> iso = {});

/// The colour of the n-th structure of whose colour nothing is known: "#rrggbb". The first eight
/// stay apart for eyes that see few, on light and on dark (after Okabe and Ito 2008); the others
/// are made_up_color(). [any]
std::string structure_color(std::size_t n);

/// The bit of "felt" that stands for all surfaces from this place on: a page has 32 bits.
inline constexpr int kBitOfOthers = 31;

} // namespace palpate
