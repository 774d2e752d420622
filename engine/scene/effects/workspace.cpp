// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/workspace.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/workspace.h>

namespace palpate::internal::workspace_effect {
namespace {

using effects::Workspace;

constexpr std::array kKeys{
    SceneKey{"radius_mm", "mm", kRadiusMm, "required without box_mm", "The radius of a ball."},
    SceneKey{"center_mm", "mm", kPlaceMm, "required with radius_mm",
             "The centre [x, y, z] of the ball, scene frame (LPS)."},
    SceneKey{"box_mm", "mm", kPlaceMm, "required without radius_mm",
             "Two opposite corners [[x, y, z], [x, y, z]] of a box, scene frame (LPS)."},
    SceneKey{"strength_n", "N", kHoldingN, "inf",
             "The force above which it lets the proxy leave; inf: it never yields."},
    kPlaceVolumeKey};

constexpr double kOutside = 1e-3; // m behind the border, where it is felt

bool is_ball(const Workspace& effect) { return effect.radius_m > 0.0; }

bool has_volume(const Box& box) {
    const Vec3 extent = box.extent();
    return extent.x > 0.0 && extent.y > 0.0 && extent.z > 0.0;
}

Workspace read(const EffectTable& from) {
    const TomlTable& table = from.table;
    Workspace effect;
    StrengthByPlace strength = read_strength_by_place(from, kHoldingN, kInfinity);
    effect.strength_n = strength.strength_n;
    effect.volume = std::move(strength.volume);
    effect.strength = strength.strength;
    constexpr std::string_view remedy = "give radius_mm with center_mm, or box_mm with two corners";
    for (const std::string_view of_ball : {"radius_mm", "center_mm"})
        if (table.has("box_mm") && table.has(of_ball))
            table.fail(table.line_of(of_ball),
                       fmt::format("{} and box_mm {} exclude each other: a workspace is either a "
                                   "ball or a box",
                                   of_ball, table.where()),
                       remedy);
    if (!table.has("radius_mm") && !table.has("box_mm"))
        table.fail(table.line(),
                   fmt::format("a workspace {} is either a ball or a box", table.where()), remedy);
    if (table.has("radius_mm")) {
        effect.radius_m = 1e-3 * table.number("radius_mm", kRadiusMm, 0.0);
        effect.center_m = 1e-3 * read_triple(table, "center_mm", " in mm", kPlaceMm);
        return effect;
    }
    for (const Vec3& corner : read_points(table, "box_mm", 2, 2))
        effect.box_m.add(corner);
    if (!has_volume(effect.box_m))
        table.fail(table.line_of("box_mm"), fmt::format("box_mm {} has no volume", table.where()),
                   "give two opposite corners");
    return effect;
}

/// Whether two workspaces share a place at least.
bool overlap(const Workspace& a, const Workspace& b) {
    if (is_ball(a) && is_ball(b))
        return glm::distance(a.center_m, b.center_m) <= a.radius_m + b.radius_m;
    if (is_ball(b)) return overlap(b, a);
    if (is_ball(a))
        return glm::distance(a.center_m, glm::clamp(a.center_m, b.box_m.lower, b.box_m.upper)) <=
               a.radius_m;
    return !Box{glm::max(a.box_m.lower, b.box_m.lower), glm::min(a.box_m.upper, b.box_m.upper)}
                .empty();
}

bool never_yields(const Workspace& effect) {
    return effect.volume.empty() && std::isinf(effect.strength_n);
}

/// Refuses one that never yields and cannot hold the proxy beside an earlier one.
void check_overlap(const EffectCheck& check, const Workspace& effect) {
    if (!never_yields(effect)) return;
    for (std::size_t other = 0; other < check.effect; ++other) {
        const auto* const earlier = std::get_if<Workspace>(&check.scene.effects[other].settings);
        if (earlier == nullptr || !never_yields(*earlier) || overlap(*earlier, effect)) continue;
        const int line = check.scene.effects[other].line;
        throw std::invalid_argument(fmt::format(
            "the workspace {} has no place in common with that {}, and neither yields; move or "
            "enlarge one of them, or give one a finite strength_n",
            check.where(check.effect),
            line > 0 ? fmt::format("of line {}", line) : check.where(other)));
    }
}

void check_shape(const FieldCheck& fields, const Workspace& effect) {
    const Range place_m = scaled(kPlaceMm, 1e-3);
    if (effect.radius_m == 0.0 && effect.box_m.empty())
        fields.fail("radius_m", "= 0, and box_m is empty", "give a radius_m above 0, or a box_m");
    if (effect.radius_m != 0.0) {
        fields.number("radius_m", effect.radius_m, scaled(kRadiusMm, 1e-3));
        return fields.triple("center_m", effect.center_m, place_m);
    }
    fields.triple("box_m.lower", effect.box_m.lower, place_m);
    fields.triple("box_m.upper", effect.box_m.upper, place_m);
    if (!has_volume(effect.box_m))
        fields.fail("box_m", "has no volume", "give two opposite corners");
}

void check(const EffectCheck& check, const Workspace& effect) {
    check.fields.number("strength_n", effect.strength_n, kHoldingN);
    check_strength_by_place(check, effect.volume, effect.strength, kHoldingN);
    check_shape(check.fields, effect);
    check_overlap(check, effect);
}

EffectNeeds plan(const PlanContext&, const Workspace& effect) {
    if (effect.strength_n == 0.0) return off("strength_n is 0: it cannot be felt");
    return on_at_start_of("planes where the proxy could leave it", effect.volume);
}

std::string order(const Workspace& effect) {
    return order_text(effect.volume, effect.strength_n, effect.radius_m, effect.center_m,
                      effect.box_m, effect.strength);
}

std::unique_ptr<Effect> make(const Workspace& effect, const EffectParts& parts) {
    LocalStrength strength = LocalStrength::holding(
        effect.strength_n, strength_over(effect.volume, effect.strength, parts.fields));
    if (is_ball(effect))
        return std::make_unique<WorkspaceSphere>(effect.center_m, effect.radius_m,
                                                 std::move(strength));
    return std::make_unique<WorkspaceBox>(effect.box_m, std::move(strength));
}

/// Just outside of each side.
std::vector<Vec3> places(const Workspace& effect) {
    const Vec3 center = is_ball(effect) ? effect.center_m : effect.box_m.center();
    const Vec3 half = is_ball(effect) ? Vec3{effect.radius_m} : 0.5 * effect.box_m.extent();
    std::vector<Vec3> places;
    for (int axis = 2; axis >= 0; --axis)
        for (const double side : {1.0, -1.0}) {
            places.push_back(center);
            places.back()[axis] += side * (half[axis] + kOutside);
        }
    return places;
}

std::optional<Box> confines(const Workspace& effect) {
    if (!never_yields(effect)) return std::nullopt;
    Box box = effect.box_m;
    if (is_ball(effect)) {
        box.add(effect.center_m - effect.radius_m);
        box.add(effect.center_m + effect.radius_m);
    }
    return box;
}

} // namespace
} // namespace palpate::internal::workspace_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Workspace> Workspace::room{
    .traits = {.name = "workspace",
               .keys = internal::workspace_effect::kKeys,
               .need = internal::FieldNeed::scalar,
               .turn = internal::EffectTurn::limits},
    .read = internal::workspace_effect::read,
    .check = internal::workspace_effect::check,
    .plan = internal::workspace_effect::plan,
    .own = {.order = internal::workspace_effect::order,
            .make = internal::workspace_effect::make,
            .places = internal::workspace_effect::places,
            .confines = internal::workspace_effect::confines},
};

} // namespace palpate::effects
