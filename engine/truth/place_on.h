// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>

namespace palpate {

/// Where frames are on one surface: at its front where it is soft, at the proxy where it is hard.
class PlaceOn {
public:
    /// The surface is one of the scene's.                                               [setup]
    PlaceOn(const Scene& scene, const SceneSurface& surface)
        : soft_(is_soft(scene.description(), scene.description().surfaces.at(surface.name))),
          alone_(is_soft_and_alone(scene)) {
        while (index_ < scene.surfaces().size() && &scene.surfaces()[index_] != &surface)
            ++index_;
    }

    /// m, scene frame; nothing where the report does not tell: of several soft surfaces it has the
    /// front of one.                                                                    [any]
    std::optional<Vec3> of(const FrameReport& frame) const noexcept {
        if (!soft_ || !(frame.indentation_m > 0.0)) return frame.proxy;
        if (frame.pressed_surface != index_) return std::nullopt;
        return frame.front;
    }
    /// Whether it is where HapticLoop::path() ends: of several surfaces that is the tip's. [any]
    bool has_path() const noexcept { return !soft_ || alone_; }

private:
    bool soft_, alone_;
    std::size_t index_ = 0;
};

} // namespace palpate
