// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/record/recording.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A place that somebody named during a run.
struct NamedPlace {
    std::string name;                  ///< that it was given
    Vec3 at{0.0};                      ///< m, scene frame
    std::optional<double> time_s = {}; ///< of the frame; none: not known
    std::string felt;                  ///< names of the surfaces that pushed there, joined by +
};

/// From when to when a surface pushed without a break.
struct TouchSpan {
    std::uint32_t surface = 0; ///< Scene::surfaces()[surface]
    double began_s = 0.0;      ///< time of the first frame
    double ended_s = 0.0;      ///< time of the last frame
    double force_n = 0.0;      ///< the greatest force of the surface on the proxy
    double strongest_s = 0.0;  ///< when that was
    Vec3 at{0.0};              ///< m: where its strongest contact was then
};

/// The spans of a run in the order in which they began. A run without touches has none: recordings
/// of before version 4.                                                                  [setup]
std::vector<TouchSpan> touch_spans(const Run& run);

/// A run as 3D Slicer's markups (.mrk.json 1.0.3), LPS, mm: for each trial the paths of probe and
/// proxy as curves with a point every `step_s` seconds, > 0, with time and force as columns of
/// measurements; the touches and the `named` places as points, each with its label.       [setup]
std::string markups_of(const Recording& recording, std::span<const NamedPlace> named,
                       double step_s);

/// A run as VTK's polygonal data (.vtp), LPS, mm: for each trial a line of the probe and one of the
/// proxy with every frame whose place is a number. Of points: time_s, force_n (vector, N); of
/// lines: trial, is_proxy (0 or 1). [setup]
std::string paths_as_vtp(const Recording& recording);

/// What was touched of a surface with that mesh (scene frame, m), as .vtp, LPS, mm. Of each vertex:
/// touched_s, for how long it was the vertex nearest to a contact; force_n, the greatest force of
/// such a contact.                                                                      [setup]
/// Throws std::invalid_argument as SurfaceScene does.
std::string touched_mesh_as_vtp(const Recording& recording, std::uint32_t surface,
                                const TriangleMesh& mesh);

} // namespace palpate
