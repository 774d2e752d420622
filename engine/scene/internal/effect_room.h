// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/effect_plan.h>
#include <palpate/engine/scene/internal/field_check.h>
#include <palpate/engine/scene/internal/scene_key.h>
#include <palpate/engine/scene/internal/toml_reader.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/surface_magnets.h>
#include <palpate/haptics/stepping/loop_surface.h>

/// What the engine asks of a kind of effect. Each kind answers in its own source in
/// engine/scene/effects/; whoever asks does so by effect_questions.h and names no kind.
namespace palpate {

class Scene;
struct SceneSurface;

namespace internal {

struct EffectFields;

/// Which kind of volume an effect samples.
enum class FieldNeed {
    none,
    scalar,
    vector, ///< with a sense: velocities, a helix
    axial,  ///< without: fibres, also the principal direction of tensors
};

/// When in a frame an effect is asked: each sees what those before it have added.
enum class EffectTurn {
    draws,  ///< forces and springs
    guides, ///< lines, points, sheets: they look where those draw
    limits, ///< and these where all the others lead
};

/// What is the same for all effects of a kind.
struct EffectTraits {
    std::string_view name;            ///< in scenes, under `type`
    std::span<const SceneKey> keys;   ///< in scenes, besides `type`
    FieldNeed need = FieldNeed::none; ///< of its volume
    EffectTurn turn = EffectTurn::draws;
    std::optional<SurfacePart> part = {}; ///< felt where a surface is, and only with it: no Effect
                                          ///< of its own; it names its surface
    bool beside_soft = false; ///< composed with a soft surface: it neither holds the proxy nor asks
                              ///< where that is; of a part: with a soft surface of its own
    bool stands_for_surface = false; ///< felt like a surface, at level 0 of its volume, but without
                                     ///< a certificate: nothing leads back to that level
};

/// An effect's table in a scene file.
struct EffectTable {
    const TomlTable& table;
    const SceneDescription& scene; ///< has its volumes, materials and surfaces
    std::string surface;           ///< that this effect is of, there; empty: of none
};

/// Checks an effect of a scene made in code, or from a file.
struct EffectCheck {
    const FieldCheck& fields;
    const SceneDescription& scene; ///< volumes and surfaces have been checked, and effects before
    std::size_t effect = 0;        ///< index into its effects

    /// An effect as messages about several things name it.                             [setup]
    std::string where(std::size_t of) const;
};

/// A field that is sampled.
struct SampledField {
    FieldNeed kind = FieldNeed::scalar;
    std::string volume;
    std::string baked_for; ///< surface whose own field it is; empty: the volume itself

    auto operator<=>(const SampledField&) const = default;
};

/// What one effect needs, before anybody shares.
struct EffectNeeds {
    PlannedEffect planned;                ///< without its index
    std::optional<SampledField> at_proxy; ///< in each evaluation, where others may sample it, too
    std::optional<SampledField> at_start; ///< the same once a frame, at its start
    bool any_surface = false;             ///< off where no surface at all is felt
};

/// What a plan knows so far.
struct PlanContext {
    const SceneDescription& scene;
    Extraction extraction = Extraction::possible;
    std::span<const PlannedEffect> earlier; ///< for the scene's effects before this one

    /// Whether one of those that are on is of one of these kinds and of that surface.  [setup]
    template <class... Kinds>
    bool has_earlier(const std::string& surface) const {
        for (const PlannedEffect& planned : earlier) {
            const EffectDescription& effect = scene.effects[planned.effect];
            if (planned.on && (std::holds_alternative<Kinds>(effect.settings) || ...) &&
                surface_of(effect) == surface)
                return true;
        }
        return false;
    }
};

/// What one loop makes its effects of.
struct EffectParts {
    const EffectFields& fields;            ///< with samples that the loop's parts share
    const SceneSurface* surface = nullptr; ///< that it is of, where that is felt
    std::shared_ptr<const ScalarField> surface_field = {}; ///< its baked one, shared as `fields`
    std::uint64_t surface_bit = 0; ///< in FrameOutcome::felt; 0 of those behind the 64th
};

/// What is priced of a surface.
struct PricedSurface {
    const Scene& scene;
    const SceneSurface& surface;
    const SurfaceFinish& finish;
    std::span<const Vec3> places; ///< of a hand that goes along its level, scene frame, m
};

/// Answers of a kind whose effects are Effects of their own. All functions are [setup].
template <class Settings>
struct OwnEffect {
    /// All that distinguishes it from others of its kind, as text: orders them, whatever the
    /// scene's order. order_text() makes it.
    std::string (*order)(const Settings&) = nullptr;
    /// A fresh one; the fields that it needs are loaded.
    std::unique_ptr<Effect> (*make)(const Settings&, const EffectParts&) = nullptr;
    /// Where to look for places where it is felt, scene frame, m; without: in its volume.
    std::vector<Vec3> (*places)(const Settings&) = nullptr;
    /// The box that the proxy can never leave for it, scene frame, m; nothing where it yields.
    std::optional<Box> (*confines)(const Settings&) = nullptr;
};

/// Answers of a kind whose effects are a part of a surface. All functions are [setup].
template <class Settings>
struct OnSurface {
    /// Gives the scene's surface what it is of; throws std::invalid_argument where that cannot be.
    void (*shape)(const Settings&, SceneSurface&, const EffectFields&) = nullptr;
    /// The same of a loop's surface.
    void (*finish)(const Settings&, SurfaceFinish&, const EffectFields&) = nullptr;
    /// How far in front of the surface's level it is felt at most, at any gain, m.
    double (*in_front_m)(const Settings&, const SceneSurface&) = nullptr;
    /// The most planes and lines that it adds in an evaluation.
    std::size_t (*most_primitives)(const Settings&, const SceneSurface&) = nullptr;
    /// What it adds to an evaluation that feels the surface, us.
    double (*price_us)(const Settings&, const PricedSurface&) = nullptr;
};

/// All answers of a kind. What is missing of the last two stands for nothing, 0, none.
template <class Settings>
struct EffectRoom {
    EffectTraits traits;
    /// Reads what a table says; throws as TomlTable does.                              [setup]
    Settings (*read)(const EffectTable&) = nullptr;
    /// Throws std::invalid_argument as FieldCheck does.                                [setup]
    void (*check)(const EffectCheck&, const Settings&) = nullptr;
    /// What it needs, or why it is off: but for whether its surface is felt.           [setup]
    EffectNeeds (*plan)(const PlanContext&, const Settings&) = nullptr;
    OwnEffect<Settings> own = {};
    OnSurface<Settings> on_surface = {};
};

// What rooms answer with.

/// Off, and asks for nothing.                                                           [setup]
EffectNeeds off(std::string reason);
/// On without asking for a sample; `how` it enters a frame, in words.                   [setup]
EffectNeeds on(std::string_view how);
/// On, with a sample of a field in each evaluation, or once a frame.                    [setup]
EffectNeeds on_at_proxy(std::string_view how, SampledField field);
EffectNeeds on_at_start(std::string_view how, SampledField field);
/// The same, but without a volume it needs no sample.                                   [setup]
EffectNeeds on_at_start_of(std::string_view how, const std::string& volume);

/// The field that a surface of a volume is felt in: of a formula the formula itself, of voxels one
/// of its own, baked.                                                                   [setup]
SampledField field_of_surface(const SceneDescription& scene, const std::string& surface);

// Texts by which effects are ordered.
std::string order_part(const std::string& text);
std::string order_part(double number);
std::string order_part(const Vec3& point);
std::string order_part(const Box& box);
std::string order_part(const TransferFunction& function);
std::string order_part(const std::vector<Vec3>& points);

/// Parts of an effect in a row, as OwnEffect::order wants them.                         [setup]
template <class... Parts>
std::string order_text(const Parts&... parts) {
    return (order_part(parts) + ...);
}

} // namespace internal
} // namespace palpate
