// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/contact_choice.h>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_file.h>

namespace palpate {
namespace {

bool is_felt_as_it_is(const SceneDescription& scene, const SurfaceDescription& surface) {
    return !surface.volume.empty() && is_exact(scene.volumes.at(surface.volume));
}

std::string_view kind_of_field(const SceneDescription& scene, const SurfaceDescription& surface) {
    return scene.volumes.at(surface.volume).scalar_field ? "a field of the program's own"
                                                         : "a formula";
}

} // namespace

ContactChoice choose_contact(const SceneDescription& scene, const SurfaceDescription& surface,
                             Extraction extraction) {
    const auto chosen = [](ContactKind kind, std::string_view why) {
        return ContactChoice{kind, fmt::format("contact {}: {}", name(kind), why)};
    };
    if (surface.contact) return chosen(*surface.contact, "as the scene says");
    if (surface.volume.empty()) return chosen(ContactKind::mesh, "there is a mesh and no volume");
    if (has_mesh(surface))
        return chosen(ContactKind::guarded, "there are a volume and a mesh of it");
    if (is_felt_as_it_is(scene, surface))
        return chosen(ContactKind::volume,
                      fmt::format("{} has no mesh", kind_of_field(scene, surface)));
    if (extraction == Extraction::impossible)
        return chosen(ContactKind::volume, "no mesh can be extracted here for the guard");
    return chosen(ContactKind::guarded, "a mesh can be extracted from the volume");
}

bool needs_mesh(ContactKind kind) noexcept { return kind != ContactKind::volume; }
bool samples_field(ContactKind kind) noexcept { return kind != ContactKind::mesh; }

bool feels_texture(ContactKind kind) noexcept {
    return kind == ContactKind::volume || kind == ContactKind::guarded;
}

SceneDescription preview_of(SceneDescription scene) {
    for (auto& [name, surface] : scene.surfaces)
        if (!has_mesh(surface) &&
            needs_mesh(choose_contact(scene, surface, Extraction::possible).kind))
            surface.contact = ContactKind::volume;
    return scene;
}

std::optional<ContactObstacle> obstacle(const SceneDescription& scene,
                                        const SurfaceDescription& surface, ContactKind kind) {
    if (surface.volume.empty() && samples_field(kind))
        return ContactObstacle{"needs a volume, and the surface is a mesh alone",
                               "give a volume too, or take contact = \"mesh\""};
    if (needs_mesh(kind) && !has_mesh(surface) && is_felt_as_it_is(scene, surface))
        return ContactObstacle{fmt::format("needs a mesh, and a surface given by {} is not meshed",
                                           kind_of_field(scene, surface)),
                               "name a mesh file, or take contact = \"volume\""};
    return std::nullopt;
}

} // namespace palpate
