// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// What to say of probe positions (m, scene frame) that never touched anything: the boxes of the
/// probe and of the surfaces, the nearest distance, and, of a path from a file, what that would be
/// if the file's numbers were millimetres, or in RAS.                                    [setup]
/// Distances are of at most 500 of the positions.
std::string no_contact_in_words(const Scene& scene, std::span<const Vec3> probes);

/// The same for frames; empty where one of them was in contact, or the scene has no surface.
/// [setup]
std::string no_contact_warning(const Scene& scene, std::span<const FrameReport> frames);

} // namespace palpate
