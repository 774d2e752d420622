// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/contact_choice.h>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_file.h>

namespace palpate {
namespace {

bool is_formula(const SceneDescription& scene, const SurfaceDescription& surface) {
    return !surface.volume.empty() && scene.volumes.at(surface.volume).file.empty();
}

} // namespace

ContactChoice choose_contact(const SceneDescription& scene, const SurfaceDescription& surface,
                             Extraction extraction) {
    const auto chosen = [](ContactKind kind, const char* why) {
        return ContactChoice{kind, fmt::format("contact {}: {}", name(kind), why)};
    };
    if (surface.contact) return chosen(*surface.contact, "as the scene says");
    if (surface.volume.empty()) return chosen(ContactKind::mesh, "there is a mesh and no volume");
    if (!surface.mesh.empty())
        return chosen(ContactKind::guarded, "there are a volume and a mesh of it");
    if (is_formula(scene, surface)) return chosen(ContactKind::volume, "a formula has no mesh");
    if (extraction == Extraction::impossible)
        return chosen(ContactKind::volume, "no mesh can be extracted here for the guard");
    return chosen(ContactKind::guarded, "a mesh can be extracted from the volume");
}

bool needs_mesh(ContactKind kind) noexcept { return kind != ContactKind::volume; }
bool samples_field(ContactKind kind) noexcept { return kind != ContactKind::mesh; }

bool feels_texture(ContactKind kind) noexcept {
    return kind == ContactKind::volume || kind == ContactKind::guarded;
}

std::optional<ContactObstacle> obstacle(const SceneDescription& scene,
                                        const SurfaceDescription& surface, ContactKind kind) {
    if (surface.volume.empty() && samples_field(kind))
        return ContactObstacle{"needs a volume, and the surface is a mesh alone",
                               "give a volume too, or take contact = \"mesh\""};
    if (needs_mesh(kind) && surface.mesh.empty() && is_formula(scene, surface))
        return ContactObstacle{"needs a mesh, and a surface given by a formula is not meshed",
                               "name a mesh file, or take contact = \"volume\""};
    return std::nullopt;
}

} // namespace palpate
