// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/engine/scene/scene.h>

namespace palpate::internal {

/// A text of all that decides where a surface is and with which contact it is felt: its name, its
/// field and level, its mesh. Two scenes with the same text have the same surface there. How strong
/// or rough it is plays no part.
struct SurfaceIdentity {
    std::string felt;
    /// The text that it would have without its mesh, felt by its volume alone, if its contact can
    /// go on from that; else empty.
    std::string before_mesh;

    /// Whether its contact goes on as that of `before` was (SurfaceContact::go_on_from()). [any]
    bool goes_on_from(const SurfaceIdentity& before) const noexcept {
        return felt == before.felt || (!before_mesh.empty() && before_mesh == before.felt);
    }
};

/// Of each of Scene::surfaces().                                                        [setup]
std::vector<SurfaceIdentity> surface_identities(const Scene& scene);

} // namespace palpate::internal
