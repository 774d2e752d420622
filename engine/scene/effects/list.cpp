// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/list.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {
namespace {

template <class... Kinds>
constexpr auto traits_of_all(std::type_identity<std::variant<Kinds...>>) {
    return std::array{&Kinds::room.traits...};
}

template <class... Kinds>
constexpr auto readers_of_all(std::type_identity<std::variant<Kinds...>>) {
    using Reader = EffectSettings (*)(const internal::EffectTable&);
    return std::array<Reader, sizeof...(Kinds)>{[](const internal::EffectTable& table) {
        return EffectSettings(Kinds::room.read(table));
    }...};
}

} // namespace

std::string_view name(const EffectDescription& effect) noexcept {
    return internal::traits_of(effect).name;
}

const std::string& surface_of(const EffectDescription& effect) noexcept {
    static const std::string none;
    return std::visit(
        [](const auto& settings) -> const std::string& {
            if constexpr (requires { settings.surface; }) return settings.surface;
            return none;
        },
        effect.settings);
}

const std::string& volume_of(const EffectDescription& effect) noexcept {
    static const std::string none;
    return std::visit(
        [](const auto& settings) -> const std::string& {
            if constexpr (requires { settings.volume; }) return settings.volume;
            return none;
        },
        effect.settings);
}

const std::filesystem::path& file_of(const EffectDescription& effect) noexcept {
    static const std::filesystem::path none;
    return std::visit(
        [](const auto& settings) -> const std::filesystem::path& {
            if constexpr (requires { settings.file; }) return settings.file;
            return none;
        },
        effect.settings);
}

bool can_move(const EffectDescription& effect) noexcept {
    return internal::can_move(internal::traits_of(effect));
}

bool makes_surface_felt(const EffectDescription& effect) noexcept {
    return internal::traits_of(effect).part == SurfacePart::strength;
}

namespace internal {

bool can_move(const EffectTraits& traits) noexcept {
    return std::any_of(traits.keys.begin(), traits.keys.end(),
                       [](const SceneKey& key) { return key.name == kMovesWithKey.name; });
}

const std::string& body_of(const SceneDescription& scene, const EffectDescription& effect) {
    static const std::string none;
    if (!effect.moves_with.empty()) return effect.moves_with;
    const std::string& surface = surface_of(effect);
    const bool goes_along =
        !surface.empty() && can_move(traits_of(effect)) && scene.surfaces.at(surface).moves;
    return goes_along ? surface : none;
}

namespace {

/// What a kind answers to a question that `pick` picks from its room; `none` where it has nothing
/// to say.
template <class Answer, class Pick, class... Subject>
Answer answer(const EffectDescription& effect, const Answer& none, const Pick& pick,
              const Subject&... subject) {
    return std::visit(
        [&](const auto& settings) -> Answer {
            const auto function = pick(settings.room);
            return function == nullptr ? none : function(settings, subject...);
        },
        effect.settings);
}

} // namespace

const EffectTraits& traits_of(const EffectDescription& effect) noexcept {
    return *all_traits()[effect.settings.index()];
}

std::span<const EffectTraits* const> all_traits() noexcept {
    static constexpr auto kTraits = traits_of_all(std::type_identity<EffectSettings>{});
    return kTraits;
}

EffectSettings read_settings(std::size_t kind, const EffectTable& table) {
    static constexpr auto kReaders = readers_of_all(std::type_identity<EffectSettings>{});
    return kReaders[kind](table);
}

void check_effect(const SceneDescription& scene, std::size_t effect) {
    const FieldCheck fields(fmt::format("effects[{}]", effect));
    const EffectCheck check{fields, scene, effect};
    std::visit([&](const auto& settings) { settings.room.check(check, settings); },
               scene.effects[effect].settings);
    check_moves_with(check);
}

EffectNeeds needs_of(const EffectDescription& effect, const PlanContext& context) {
    return std::visit([&](const auto& settings) { return settings.room.plan(context, settings); },
                      effect.settings);
}

OrderKey order_key(const EffectDescription& effect) {
    return {traits_of(effect).turn, effect.settings.index(),
            std::visit([](const auto& settings) { return settings.room.own.order(settings); },
                       effect.settings) +
                effect.moves_with};
}

std::unique_ptr<Effect> make_effect(const EffectDescription& effect, const EffectParts& parts) {
    return std::visit([&](const auto& settings) { return settings.room.own.make(settings, parts); },
                      effect.settings);
}

std::vector<Vec3> places_of(const EffectDescription& effect) {
    return answer(effect, std::vector<Vec3>{}, [](const auto& room) { return room.own.places; });
}

std::optional<Box> confines_of(const EffectDescription& effect) {
    return answer(effect, std::optional<Box>{}, [](const auto& room) { return room.own.confines; });
}

void give_shape(const EffectDescription& effect, SceneSurface& surface,
                const EffectFields& fields) {
    std::visit(
        [&](const auto& settings) {
            if (settings.room.on_surface.shape != nullptr)
                settings.room.on_surface.shape(settings, surface, fields);
        },
        effect.settings);
}

void give_finish(const EffectDescription& effect, SurfaceFinish& finish,
                 const EffectFields& fields) {
    std::visit(
        [&](const auto& settings) {
            if (settings.room.on_surface.finish != nullptr)
                settings.room.on_surface.finish(settings, finish, fields);
        },
        effect.settings);
}

double in_front_m(const EffectDescription& effect, const SceneSurface& surface) {
    return answer(
        effect, 0.0, [](const auto& room) { return room.on_surface.in_front_m; }, surface);
}

std::size_t most_primitives_on(const EffectDescription& effect, const SceneSurface& surface) {
    return answer(
        effect, std::size_t{0}, [](const auto& room) { return room.on_surface.most_primitives; },
        surface);
}

double price_on(const EffectDescription& effect, const PricedSurface& priced) {
    return answer(
        effect, 0.0, [](const auto& room) { return room.on_surface.price_us; }, priced);
}

} // namespace internal
} // namespace palpate
