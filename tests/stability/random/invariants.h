// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/place_on.h>

#include "tests/stability/random/random_case.h"

namespace palpate::stability {

/// A frame as its watchers see it.
struct SeenFrame {
    int frame = 0;
    const DeviceState& state;
    bool begins_trial = false; ///< with the first place of the probe that is one
    const FrameReport& report;
    std::span<const Vec3> path;       ///< the proxy's corners, scene frame, m
    std::span<const RigidPose> poses; ///< of Scene::surfaces(), in this frame
    bool gains_moved = false;         ///< up to this frame
    bool bodies_moved = false;        ///< up to this frame
};

/// What must hold in every frame, found with code that is independent of the loop.
class Invariant {
public:
    virtual ~Invariant() = default;
    virtual const char* name() const = 0;
    /// What is wrong with the next frame; nothing where it holds.
    virtual std::optional<std::string> check(const SeenFrame& seen) = 0;
    /// How many frames it had something to look at.
    long checks() const { return checks_; }

protected: // NOLINT: the count is all that they share
    long checks_ = 0;
};

/// What of a case the invariants are told.
struct Watched {
    const Scene& scene;
    const std::vector<FileEvent>& events;
};

/// A surface that must not be passed: it never yields, it is felt, and its gain stays 1. Of a soft
/// one: by its front, where that has a path, i.e. where it is alone.
struct HardSurface {
    std::size_t index = 0; ///< of Scene::surfaces()
    const SceneSurface* surface = nullptr;
    PlaceOn place; ///< where a frame is on it
};
std::vector<HardSurface> hard_surfaces(const Watched& watched);
/// Whether one hard surface is all that is felt: no other effect, and no event but detours.
bool is_pure(const Watched& watched);
/// A place of the scene in the frame of a body.
inline Vec3 in_body(const RigidPose& pose, const Vec3& p) {
    return glm::conjugate(pose.orientation) * (p - pose.position);
}

// Each appends its own invariants.
void add_frame_invariants(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to);
void add_certificates(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to);
void add_press_invariant(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to);
void add_label_invariants(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to);
void add_mesh_invariants(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to);
/// Last, so that what a path does is noticed by who looks at it.
void add_path_invariant(std::vector<std::unique_ptr<Invariant>>& to);

} // namespace palpate::stability
