// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/scene/internal/effect_room.h>

/// What reader, plan, scene, loop, prices and warnings ask of an effect, of whatever kind: answered
/// by its room, engine/scene/effects/. All [setup] but traits_of().
namespace palpate::internal {

/// [any]
const EffectTraits& traits_of(const EffectDescription& effect) noexcept;
/// Of all kinds, in the order of EffectSettings: an index into these is a variant's.
std::span<const EffectTraits* const> all_traits() noexcept;
/// Whether the kind has the key moves_with.
bool can_move(const EffectTraits& traits) noexcept;
/// The surface with whose body an effect moves: the one that it names, or the one that it is of;
/// empty where it stands still, or is a part of its surface.
const std::string& body_of(const SceneDescription& scene, const EffectDescription& effect);

/// Settings of a kind, as an effect's table says them; throws as TomlTable does.
EffectSettings read_settings(std::size_t kind, const EffectTable& table);
/// Throws std::invalid_argument as FieldCheck does; volumes and surfaces have been checked, and the
/// effects before this one.
void check_effect(const SceneDescription& scene, std::size_t effect);
EffectNeeds needs_of(const EffectDescription& effect, const PlanContext& context);

// Of effects of their own: see OwnEffect.

/// By what effects of one loop are ordered, whatever the scene's order.
struct OrderKey {
    EffectTurn turn = EffectTurn::draws;
    std::size_t kind = 0;
    std::string content; ///< OwnEffect::order

    auto operator<=>(const OrderKey&) const = default;
};
OrderKey order_key(const EffectDescription& effect);
std::unique_ptr<Effect> make_effect(const EffectDescription& effect, const EffectParts& parts);
std::vector<Vec3> places_of(const EffectDescription& effect);
std::optional<Box> confines_of(const EffectDescription& effect);

// Of what is part of a surface: see OnSurface.

void give_shape(const EffectDescription& effect, SceneSurface& surface, const EffectFields& fields);
void give_finish(const EffectDescription& effect, SurfaceFinish& finish,
                 const EffectFields& fields);
double in_front_m(const EffectDescription& effect, const SceneSurface& surface);
std::size_t most_primitives_on(const EffectDescription& effect, const SceneSurface& surface);
double price_on(const EffectDescription& effect, const PricedSurface& priced);

} // namespace palpate::internal
