// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/igtl_message.h>
#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/view/view_document.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A surface as other programs see it.
struct ServedSurface {
    std::string name;                         ///< 1 to 20 bytes, and no other one's
    std::array<float, 4> rgba{1, 1, 1, 1};    ///< sRGB and opacity, from 0 to 1
    std::shared_ptr<const TriangleMesh> mesh; ///< m, scene frame; not null
};

/// The surfaces that have something to draw, with at most so many triangles in all, about in
/// proportion (each has some hundreds). Names that OpenIGTLink cannot hold are cut, and numbered
/// where two are then the same.                                                          [setup]
std::vector<ServedSurface> served_surfaces(std::span<const ViewStructure> structures,
                                           std::size_t most_triangles);

/// A frame as other programs see it. Scene frame, SI.
struct ServedFrame {
    std::uint64_t frame = 0;   ///< FrameReport::frame
    std::uint32_t trial = 0;   ///< its trial
    double time_s = 0.0;       ///< the device's time
    double clock_s = 0.0;      ///< when it was shown, s since 1970
    ToolPose stylus;           ///< the probe, m
    Vec3 velocity{0.0};        ///< of the probe, m/s
    std::uint32_t buttons = 0; ///< bit i: button i is down
    Vec3 force{0.0};           ///< on the hand, N
    Vec3 proxy{0.0};           ///< m
};

/// Of a frame, without its velocity, shown at `clock_s`.                                   [any]
ServedFrame served_frame(const RunFrame& run, double clock_s) noexcept;

/// How fast the probe went from `before` to `now`, on average, m/s; zero where that says nothing:
/// in another trial, or at no later time.                                                  [any]
Vec3 velocity_between(const ServedFrame& before, const ServedFrame& now) noexcept;

/// The TRANSFORMs of a frame, with the names that PLUS gives those of a haptic device:
/// `Stylus` (the probe), `StylusVelocity` (mm/s in the last column), `Buttons` (0 or 1 of buttons
/// 0 to 2 down the first column, else zero), `Force` (N in the last column); and `Proxy`, turned as
/// the stylus. RAS, mm. Of version two their id is the frame's number.                   [setup]
std::vector<IgtlMessage> transforms_of(const ServedFrame& frame, IgtlVersion version);

/// The POLYDATA of a surface.                                                            [setup]
IgtlMessage poly_data_of(const ServedSurface& surface, IgtlVersion version, double clock_s);

} // namespace palpate
