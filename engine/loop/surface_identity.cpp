// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/internal/surface_identity.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate::internal {
namespace {

/// FNV-1a, 64 bits, over words of four bytes: a mesh has millions.
std::uint64_t hash_of(std::span<const std::byte> bytes, std::uint64_t hash) {
    std::uint32_t word = 0;
    for (; bytes.size() >= sizeof word; bytes = bytes.subspan(sizeof word)) {
        std::memcpy(&word, bytes.data(), sizeof word);
        hash = (hash ^ word) * 0x100000001b3;
    }
    return hash;
}

std::uint64_t hash_of(const TriangleMesh& mesh) {
    const std::uint64_t vertices =
        hash_of(std::as_bytes(std::span(mesh.vertices)), 0xcbf29ce484222325);
    return hash_of(std::as_bytes(std::span(mesh.triangles)), vertices);
}

/// A baked field by the hash of all that went in; a formula by its numbers; a field of the
/// program's own by itself.
std::string field_of(const Scene& scene, const SceneSurface& surface) {
    if (!surface.baked.field) return "no field";
    if (!surface.baked.key.empty()) return surface.baked.key;
    const SurfaceDescription& description = scene.description().surfaces.at(surface.name);
    const VolumeDescription& volume = scene.description().volumes.at(description.volume);
    if (volume.scalar_field)
        return fmt::format("{}", static_cast<const void*>(volume.scalar_field.get()));
    std::string text = volume.analytic;
    for (const auto& [key, value] : volume.parameters)
        text += fmt::format(" {} {:a}", key, value);
    return text;
}

} // namespace

std::vector<SurfaceIdentity> surface_identities(const Scene& scene) {
    std::vector<SurfaceIdentity> identities;
    for (const SceneSurface& surface : scene.surfaces()) {
        const bool moves = scene.description().surfaces.at(surface.name).moves;
        const std::string field = field_of(scene, surface);
        const auto felt_as = [&](ContactKind contact, const std::string& mesh) {
            const double leash_m = contact == ContactKind::guarded ? surface.leash_m : 0.0;
            return fmt::format("{}|{}|{}|{:a}|mesh {}|leash {:a}|{}", surface.name, name(contact),
                               field, surface.level.level, mesh, leash_m,
                               moves ? "moves" : "stands");
        };
        const std::string no_mesh = "none";
        const std::string mesh =
            surface.mesh.scene ? fmt::format("{:x}", hash_of(surface.mesh.scene->mesh())) : no_mesh;
        SurfaceIdentity identity{felt_as(surface.contact, mesh), {}};
        if (surface.contact == ContactKind::guarded)
            identity.before_mesh = felt_as(ContactKind::volume, no_mesh);
        identities.push_back(std::move(identity));
    }
    return identities;
}

} // namespace palpate::internal
