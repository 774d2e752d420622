// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Each kind of effect has a struct of its own in this folder: plain settings, as a scene says
/// them, checked by validate(). Members of these names are the same in all of them:
///   surface   key of SceneDescription::surfaces
///   volume    key of SceneDescription::volumes
///   file      what some of the settings were read from; empty: the scene itself
/// `room` is for the engine alone: the one place where all is said that it knows of the kind.
namespace palpate::internal {

template <class Settings>
struct EffectRoom;

} // namespace palpate::internal
