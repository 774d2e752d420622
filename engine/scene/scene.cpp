// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/internal/plan_warnings.h>
#include <palpate/engine/scene/internal/scene_sources.h>
#include <palpate/engine/scene/internal/soft_borders.h>
#include <palpate/engine/scene/loop_parts.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/scene/validation.h>
#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/haptics/effects/moving_effect.h>
#include <palpate/volume/fields/analytic_fields.h>

namespace palpate {
namespace {

Extraction extraction(const SceneResources& resources) {
    return resources.extract ? Extraction::possible : Extraction::impossible;
}

/// Where a strength is a function of a volume's value, strength_n is the greatest that there is.
void settle_strengths(SceneDescription& description) {
    for (auto& [name, surface] : description.surfaces)
        if (!surface.strength_volume.empty())
            surface.strength_n = surface.strength_over_value.strongest();
    const auto settle = []<class Settings>(Settings& effect) {
        if constexpr (requires { effect.strength_n = effect.strength.strongest(); })
            if (!effect.volume.empty()) effect.strength_n = effect.strength.strongest();
    };
    for (EffectDescription& effect : description.effects)
        std::visit(settle, effect.settings);
}

/// As it is, once it has been looked at.
SceneDescription checked(SceneDescription description) {
    validate(description);
    settle_strengths(description);
    return description;
}

/// Does a step of the set-up; what libraries complain of gets file, line and surface in front.
template <class Step>
auto at_place(const std::string& place, const Step& step) {
    try {
        return step();
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", place, error.what()));
    }
}

/// Refuses what no contact of that kind can do.
void check_contact(const SceneDescription& scene, const SurfaceDescription& description,
                   ContactKind kind, const std::string& place) {
    if (const auto no = obstacle(scene, description, kind))
        throw std::runtime_error(
            fmt::format("{}: contact = \"{}\" {}; {}", place, name(kind), no->what, no->remedy));
    if (kind == ContactKind::direct && std::isfinite(description.strength_n))
        throw std::runtime_error(
            fmt::format("{}: contact = \"direct\" never yields, and its strength_n = {}{} is "
                        "finite; take contact = \"volume\", or give it strength_n = inf",
                        place, description.strength_n,
                        description.material.empty() ? "" : " (its own, or of its material)"));
}

SceneSurface build_surface(const SceneDescription& scene, const std::string& name,
                           internal::SceneSources& sources, const SceneResources& resources) {
    const SurfaceDescription& description = scene.surfaces.at(name);
    const std::string place = place_of_surface(scene, name);
    SceneSurface surface;
    surface.name = name;
    surface.contact = choose_contact(scene, description, extraction(resources)).kind;
    check_contact(scene, description, surface.contact, place);
    if (!description.volume.empty()) surface.baked = sources.surface(name);
    surface.level.level = surface.baked.level;
    surface.level.strength_n = description.strength_n;
    surface.level.yielding = description.yielding;
    surface.leash_m = leash_of(description, surface.baked);
    if (surface.baked.field)
        at_place(fmt::format("{}: iso_value = {}", place, description.iso_value),
                 [&] { LevelScale::of(*surface.baked.field, surface.level); });
    at_place(place, [&] {
        if (needs_mesh(surface.contact))
            surface.mesh =
                make_surface_mesh(sources.mesh(name, surface.baked, surface.contact, place),
                                  surface.contact, resources.progress);
    });
    return surface;
}

/// A contact with a surface through `field` and with a texture: its own, or the same with shared
/// samples.
std::unique_ptr<SurfaceContact> make_contact_with(const SceneSurface& surface,
                                                  const std::shared_ptr<const ScalarField>& field,
                                                  const TextureSettings& texture) {
    switch (surface.contact) {
    case ContactKind::mesh: {
        MeshContactSettings settings;
        settings.strength_n = surface.level.strength_n;
        settings.yielding = surface.level.yielding;
        return std::make_unique<MeshContact>(surface.mesh.certified, settings);
    }
    case ContactKind::guarded:
        return std::make_unique<GuardedContact>(field, surface.level, surface.mesh.certified,
                                                surface.leash_m, texture);
    case ContactKind::direct:
        return std::make_unique<DirectContact>(surface.mesh.scene, field, surface.level);
    case ContactKind::volume:
        break;
    }
    return std::make_unique<VolumeContact>(field, surface.level, texture);
}

/// Effects that are on and more than a part of a surface: by turn, kind and content.
std::vector<std::size_t> order_of(const SceneDescription& scene, const EffectPlan& plan) {
    std::vector<std::pair<internal::OrderKey, std::size_t>> keys;
    for (const PlannedEffect& planned : plan.effects) {
        const EffectDescription& effect = scene.effects[planned.effect];
        if (planned.on && !internal::traits_of(effect).part)
            keys.emplace_back(internal::order_key(effect), planned.effect);
    }
    std::sort(keys.begin(), keys.end());
    std::vector<std::size_t> order;
    order.reserve(keys.size());
    for (const auto& [key, effect] : keys)
        order.push_back(effect);
    return order;
}

/// All of a surface's matter, as far as it is known to have an end: formulas and fields of the
/// program's own may go on beyond their bounds.
std::optional<Box> extent_of(const SceneDescription& scene, const SceneSurface& surface) {
    Box extent;
    if (surface.is_felt_by_mesh()) {
        for (const Vec3& vertex : surface.mesh.scene->mesh().vertices)
            extent.add(vertex);
        return extent;
    }
    const VolumeDescription& volume = scene.volumes.at(scene.surfaces.at(surface.name).volume);
    if (!is_exact(volume)) return surface.baked.field->bounds_at(surface.level.level);
    if (volume.analytic != "solid_sphere") return std::nullopt;
    const double radius_m = 1e-3 * volume.parameters.at("radius_mm") - surface.level.level;
    extent.add(Vec3{-radius_m});
    extent.add(Vec3{radius_m});
    return extent;
}

/// How far in front of its level a surface is felt at most, at any gain of what is on it.
double felt_in_front_m(const SceneDescription& scene, const EffectPlan& plan,
                       const SceneSurface& surface) {
    double in_front_m = 0.0;
    for (const PlannedEffect& planned : plan.effects) {
        const EffectDescription& effect = scene.effects[planned.effect];
        if (planned.on && surface_of(effect) == surface.name)
            in_front_m += internal::in_front_m(effect, surface);
    }
    return in_front_m;
}

/// Whether an effect that never yields keeps the proxy away from all of a surface.
bool is_out_of_reach(const SceneDescription& scene, const EffectPlan& plan,
                     const SceneSurface& surface) {
    // It may come there, or take the proxy out to what stands: a body that moves asks no workspace.
    for (const auto& [name, other] : scene.surfaces)
        if (other.moves && plan.uses_surface(scene, name)) return false;
    const std::optional<Box> extent = extent_of(scene, surface);
    if (!extent) return false;
    const double in_front_m = felt_in_front_m(scene, plan, surface);
    const Box felt{extent->lower - in_front_m, extent->upper + in_front_m};
    for (const PlannedEffect& planned : plan.effects) {
        if (!planned.on) continue;
        const std::optional<Box> within = internal::confines_of(scene.effects[planned.effect]);
        if (within &&
            Box{glm::max(within->lower, felt.lower), glm::min(within->upper, felt.upper)}.empty())
            return true;
    }
    return false;
}

} // namespace

std::shared_ptr<const ScalarField> make_analytic_field(const SceneDescription& scene,
                                                       const std::string& volume) {
    const VolumeDescription& description = scene.volumes.at(volume);
    const auto metres = [&](const char* key) { return 1e-3 * description.parameters.at(key); };
    try {
        if (description.analytic == "sphere_cavity") return make_sphere_cavity(metres("radius_mm"));
        if (description.analytic == "solid_sphere") return make_solid_sphere(metres("radius_mm"));
        if (description.analytic == "bumpy_cavity")
            return make_bumpy_cavity(metres("radius_mm"), metres("amplitude_mm"),
                                     metres("wavelength_mm"));
        if (description.analytic == "slab") return make_slab(metres("thickness_mm"));
        if (description.analytic == "wedge")
            return make_wedge(description.parameters.at("angle_deg"));
        if (description.analytic == "torus")
            return make_torus(metres("radius_mm"), metres("tube_mm"));
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(
            fmt::format("{}: {}", place_of_volume(scene, volume), error.what()));
    }
    throw std::runtime_error(
        fmt::format("{} is not given by a formula", place_of_volume(scene, volume)));
}

Scene::~Scene() = default;

Scene::Scene(SceneDescription description, const SceneResources& resources)
    : description_(checked(std::move(description))),
      plan_(plan_effects(description_, extraction(resources))), files_(resources.files) {
    internal::SceneSources sources(description_, resources);
    std::set<std::string> out_of_reach;
    for (const auto& [name, surface] : description_.surfaces) {
        if (!plan_.uses_surface(description_, name)) continue;
        SceneSurface built = build_surface(description_, name, sources, resources);
        if (is_out_of_reach(description_, plan_, built))
            out_of_reach.insert(name);
        else
            surfaces_.push_back(std::move(built));
    }
    if (!out_of_reach.empty())
        plan_ = plan_effects(description_, extraction(resources), out_of_reach);
    const auto fields = std::make_shared<internal::EffectFields>();
    for (const PlannedEffect& planned : plan_.effects)
        if (planned.on)
            internal::load_field_of(description_.effects[planned.effect], sources, *fields);
    for (const SceneSurface& surface : surfaces_)
        internal::load_scalar_field(description_.surfaces.at(surface.name).strength_volume, sources,
                                    *fields);
    fields->warnings = sources.warnings();
    effect_fields_ = fields;
    effect_order_ = order_of(description_, plan_);
    shape_surfaces();
    const LoopParts parts = make_parts();
    plan_.warnings = internal::warnings_of(*this, internal::felt_effects(*this, parts),
                                           description_.limits.force_n);
    for (std::string& warning : internal::warnings_of_soft_borders(*this))
        plan_.warnings.push_back(std::move(warning));
}

std::shared_ptr<const Scene> Scene::of_hand(const std::string& hand) const {
    std::shared_ptr<Scene> scene(new Scene(*this)); // the copy is nobody else's to make
    scene->description_ = palpate::of_hand(std::move(scene->description_), hand);
    return scene;
}

void Scene::shape_surfaces() {
    for (const PlannedEffect& planned : plan_.effects) {
        const EffectDescription& effect = description_.effects[planned.effect];
        if (!planned.on) continue;
        for (SceneSurface& surface : surfaces_)
            if (surface.name == surface_of(effect))
                at_place(place_of_effect(description_, planned.effect),
                         [&] { internal::give_shape(effect, surface, *effect_fields_); });
    }
}

std::unique_ptr<SurfaceContact> Scene::make_contact(const SceneSurface& surface) const {
    return make_contact_with(surface, surface.baked.field, surface.texture);
}

std::shared_ptr<const ScalarField> Scene::effect_field(const std::string& volume) const {
    const auto found = effect_fields_->scalars.find(volume);
    return found == effect_fields_->scalars.end() ? nullptr : found->second;
}

const VolumeWarnings& Scene::effect_warnings() const noexcept { return effect_fields_->warnings; }

std::optional<Box> Scene::effect_bounds(const std::string& volume) const {
    if (const auto field = effect_field(volume)) return field->bounds();
    for (const auto* vectors : {&effect_fields_->directed, &effect_fields_->axial})
        if (const auto found = vectors->find(volume); found != vectors->end())
            return found->second->bounds();
    return std::nullopt;
}

std::vector<SurfaceFinish> Scene::finish_with(const internal::EffectFields& fields) const {
    std::vector<SurfaceFinish> finish(surfaces_.size());
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const SurfaceDescription& surface = description_.surfaces.at(surfaces_[i].name);
        if (!surface.strength_volume.empty())
            finish[i].strength = {fields.scalars.at(surface.strength_volume),
                                  surface.strength_over_value};
        if (is_soft(description_, surface)) finish[i].softness = surface.softness;
        if (!finish[i].softness.none()) finish[i].stiffness = surfaces_[i].baked.stiffness.map;
        finish[i].strength_n = surface.strength_n;
    }
    for (const PlannedEffect& planned : plan_.effects) {
        const EffectDescription& effect = description_.effects[planned.effect];
        if (!planned.on) continue;
        for (std::size_t i = 0; i < surfaces_.size(); ++i)
            if (surfaces_[i].name == surface_of(effect))
                internal::give_finish(effect, finish[i], fields);
    }
    return finish;
}

/// The body with which an effect moves, among the contacts of surfaces(); null: it stands still.
const MovingSurface* Scene::body_among(const std::vector<std::unique_ptr<SurfaceContact>>& contacts,
                                       const EffectDescription& effect) const {
    const std::string& body = internal::body_of(description_, effect);
    for (std::size_t i = 0; i < surfaces_.size() && !body.empty(); ++i)
        if (surfaces_[i].name == body) return contacts[i]->moving();
    return nullptr;
}

LoopParts Scene::make_parts() const {
    LoopParts parts;
    const auto shared = [&](const auto& field) { return parts.fields.share(field); };
    for (const SceneSurface& surface : surfaces_) {
        TextureSettings texture = surface.texture;
        texture.field = shared(texture.field);
        auto contact = make_contact_with(surface, shared(surface.baked.field), texture);
        if (description_.surfaces.at(surface.name).moves)
            contact = std::make_unique<MovingContact>(std::move(contact));
        parts.contacts.push_back(std::move(contact));
    }
    internal::EffectFields fields = *effect_fields_;
    for (auto& [volume, field] : fields.scalars)
        field = shared(field);
    for (auto* vectors : {&fields.directed, &fields.axial})
        for (auto& [volume, field] : *vectors)
            field = shared(field);
    parts.finish = finish_with(fields);
    for (const std::size_t index : effect_order_) {
        const EffectDescription& effect = description_.effects[index];
        internal::EffectParts of{fields};
        for (std::size_t i = 0; i < surfaces_.size(); ++i) {
            if (surfaces_[i].name != surface_of(effect)) continue;
            of.surface = &surfaces_[i];
            of.surface_field = shared(surfaces_[i].baked.field);
            of.surface_bit = felt_bit(i);
        }
        std::unique_ptr<Effect> made = internal::make_effect(effect, of);
        if (const MovingSurface* body = body_among(parts.contacts, effect))
            made = std::make_unique<MovingEffect>(std::move(made), *body);
        parts.effects.push_back(std::move(made));
    }
    return parts;
}

} // namespace palpate
