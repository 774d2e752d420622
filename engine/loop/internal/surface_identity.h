// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/engine/scene/scene.h>

namespace palpate::internal {

/// For each of Scene::surfaces() a text of all that decides where it is and with which contact it
/// is felt: its name, its field and level, its mesh. Two scenes with the same text have the same
/// surface there. How strong or rough it is plays no part.                              [setup]
std::vector<std::string> surface_identities(const Scene& scene);

} // namespace palpate::internal
