// SPDX-License-Identifier: Apache-2.0
#pragma once

/// The whole of a haptic loop in one include, <palpate/palpate.h>:
///
///     palpate::SceneDescription ball;                          // made in code
///     ball.volumes["ball"].analytic = "solid_sphere";
///     ball.volumes["ball"].parameters["radius_mm"] = 30.0;
///     ball.surfaces["ball"].volume = "ball";
///     ball.effects.push_back(palpate::effects::Surface{.surface = "ball"});
///     auto scene = std::make_shared<const palpate::Scene>(ball);
///     palpate::SteadyClock clock;
///     palpate::HapticLoop loop(scene, clock);
///     palpate::DeviceState probe;                              // time_s and position, each frame
///     const palpate::FrameReport report = loop.frame(probe);   // a thousand times a second
///
/// A scene is read from a file (scene_file.h) or made in code (scene_description.h,
/// effects/list.h); both are checked alike. One that names volumes, meshes or recordings needs
/// SceneResources::files of palpate::files. An effect of your own implements Effect (effect.h).
/// Recordings, pictures, studies, volumes and meshes have their own headers beside these.
///
/// Lengths are in metres, forces in newtons, times in seconds, unless a name ends in another unit
/// (_mm, _um, _us). The scene frame is the patient's: LPS, right-handed.
///
/// Every function says from which thread it may be called:
///   [setup]  before the loop runs, or beside it, but not on an object that a loop is using; it may
///            allocate, read files and throw
///   [loop]   from the one thread that calls frame(): it neither allocates, locks, throws nor
///            calls the system, and its work is bounded
///   [any]    from any thread at any time

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/effects/list.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/version.h>
