// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/engine/scene/scene.h>

namespace palpate::test {

/// make_phantom() as a file in a folder of this process, written once.
std::string phantom_file();

/// A scene that feels the phantom's level of 226 HU with the given contact and method.
std::shared_ptr<const Scene> phantom_scene(const std::string& contact, const std::string& method,
                                           const std::string& more = "");

/// The paper's own surface mode on the phantom.
std::shared_ptr<const Scene> gradient_surface_scene();

/// Whether this build can extract meshes (has CGAL).
bool can_extract();

} // namespace palpate::test
