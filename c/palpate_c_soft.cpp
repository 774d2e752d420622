// SPDX-License-Identifier: Apache-2.0
// How soft the surfaces of a scene are.
#include <palpate/palpate_c.h>

#include <cstddef>

#include <palpate/c/internal/call.h>
#include <palpate/c/internal/handles.h>
#include <palpate/engine/scene/felt_stiffness.h>
#include <palpate/engine/scene/scene_surface.h>

namespace {

using namespace palpate::c;

constexpr std::size_t kFirstSoftness = sizeof(palpate_softness);

/// Surface i of a scene; null where there is none.
const palpate::SceneSurface* surface_of(const palpate_scene* scene, std::size_t i) noexcept {
    return scene != nullptr && i < scene->scene->surfaces().size() ? &scene->scene->surfaces()[i]
                                                                   : nullptr;
}

} // namespace

palpate_code palpate_scene_softness(const palpate_scene* scene, size_t i,
                                    palpate_softness* softness) {
    const palpate::SceneSurface* surface = surface_of(scene, i);
    if (surface == nullptr || softness == nullptr || softness->size < kFirstSoftness)
        return PALPATE_BAD_CALL;
    return guarded(nullptr, [&] {
        const palpate::SceneDescription& description = scene->scene->description();
        const palpate::Softness& said = description.surfaces.at(surface->name).softness;
        const palpate::PressLaw law(said, description.coupling.stiffness_n_per_m);
        const palpate::BakedStiffness& beneath = surface->baked.stiffness;
        palpate_softness told{};
        told.is_soft = law.is_hard() ? 0 : 1;
        told.has_beneath = beneath.map ? 1 : 0;
        told.stiffness_n_per_m = law.slope(0.0);
        told.press_damping_n_s_per_m = said.damping;
        told.contact_radius_m = beneath.contact_radius_m;
        told.asked_radius_m = beneath.asked_radius_m;
        told.node_spacing_m = beneath.map ? beneath.map->lattice().spacing_m : 0.0;
        told.stiffest = beneath.stiffest;
        told.softest = beneath.softest;
        tell(told, *softness);
    });
}

palpate_code palpate_scene_stiffness_at(const palpate_scene* scene, size_t i,
                                        const double place_m[3], double* n_per_m) {
    const palpate::SceneSurface* surface = surface_of(scene, i);
    if (surface == nullptr || place_m == nullptr || n_per_m == nullptr) return PALPATE_BAD_CALL;
    return guarded(nullptr, [&] {
        *n_per_m =
            palpate::stiffness_at(*scene->scene, *surface, {place_m[0], place_m[1], place_m[2]});
    });
}
