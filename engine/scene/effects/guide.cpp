// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/guide.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/text/internal/csv_rows.h>
#include <palpate/haptics/effects/curve_guide.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/haptics/effects/polyline.h>

namespace palpate::internal::guide_effect {
namespace {

using effects::Guide;

constexpr std::array kKeys{
    SceneKey{"points_mm", "mm", kPlaceMm, "required without file",
             "A point, or a polyline's corners [[x, y, z], ...], scene frame (LPS)."},
    SceneKey{"file", "", {}, "none", "A CSV file of the points instead: x_m,y_m,z_m."},
    SceneKey{"strength_n", "N", kHoldingN, "required",
             "The force above which the guide lets the proxy slip."},
    SceneKey{"capture_mm", "mm", kPositiveOrInfinite, "inf",
             "It snaps on when the proxy is this near at a frame's start."},
    SceneKey{"ends",
             "",
             {},
             "open",
             "What a polyline does at its ends: \"open\", \"closed\", \"endless\"."},
    kPlaceVolumeKey,
    kMovesWithKey};

// In the order of PolylineEnds.
constexpr std::array<std::string_view, 3> kEndsNames{"open", "closed", "endless"};

/// A CSV file of points under the key `file`; m, scene frame.
std::vector<Vec3> read_points_file(const std::filesystem::path& file, std::size_t most) {
    CsvRows rows(file, "x_m,y_m,z_m");
    std::vector<Vec3> points;
    for (std::array<double, 3> numbers; rows.next(numbers);) {
        for (const double number : numbers)
            if (!kPlaceMm.contains(1e3 * number))
                rows.fail(fmt::format("{} is not a place in a scene", number),
                          "give metres, scene frame (LPS), finite");
        if (points.size() == most)
            rows.fail(fmt::format("more than {} points", most), "give fewer, farther apart");
        points.emplace_back(numbers[0], numbers[1], numbers[2]);
    }
    if (points.empty()) rows.fail("no rows after the header", "give a row per point");
    return points;
}

void read_curve(const EffectTable& from, Guide& effect) {
    const TomlTable& table = from.table;
    if (table.has("file") && table.has("points_mm"))
        table.fail(table.line_of("file"),
                   fmt::format("file and points_mm {} exclude each other", table.where()),
                   "keep one of them");
    if (table.has("file")) {
        effect.file = existing_file(table, "file", from.scene.file);
        effect.points_m = read_points_file(effect.file, Polyline::kMostPoints);
    } else {
        table.require("points_mm", "give points [[x, y, z], ...] in mm, scene frame (LPS), or name "
                                   "a CSV file of them with file = \"...\"");
        effect.points_m = read_points(table, "points_mm", 1, Polyline::kMostPoints);
    }
}

/// Refuses points of which no polyline can be made.
void check_polyline(const TomlTable& table, const Guide& effect) {
    if (effect.points_m.size() == 1) return;
    try {
        const Polyline curve(effect.points_m, effect.ends);
    } catch (const std::invalid_argument& error) {
        const std::string_view key = effect.file.empty() ? "points_mm" : "file";
        constexpr std::string_view kWhose = "polyline: "; // in words of its own
        std::string_view said = error.what();
        if (said.starts_with(kWhose)) said.remove_prefix(kWhose.size());
        const std::size_t end = std::min(said.find("; "), said.size());
        table.fail(table.line_of(key),
                   fmt::format("{} {}: {}", key, table.where(), said.substr(0, end)),
                   end < said.size() ? said.substr(end + 2) : "give different points");
    }
}

Guide read(const EffectTable& from) {
    const TomlTable& table = from.table;
    Guide effect;
    read_curve(from, effect);
    table.require("strength_n", "give the force in N above which the guide lets the proxy slip");
    StrengthByPlace strength = read_strength_by_place(from, kHoldingN, 0.0);
    effect.strength_n = strength.strength_n;
    effect.volume = std::move(strength.volume);
    effect.strength = strength.strength;
    effect.capture_m = 1e-3 * table.number("capture_mm", kPositiveOrInfinite, kInfinity);
    if (table.has("ends"))
        effect.ends = static_cast<PolylineEnds>(table.choice("ends", kEndsNames));
    const std::size_t needed = effect.ends == PolylineEnds::closed ? 3 : 2;
    if (table.has("ends") && effect.points_m.size() < needed)
        table.fail(table.line_of("ends"),
                   fmt::format("ends = \"{}\" {} needs {} points", table.text("ends"),
                               table.where(), needed),
                   "give more points, or leave ends out");
    check_polyline(table, effect);
    return effect;
}

void check_curve(const FieldCheck& fields, const Guide& effect) {
    const std::size_t count = effect.points_m.size();
    if (count < 1 || count > Polyline::kMostPoints)
        fields.fail("points_m", fmt::format("has {} points", count),
                    fmt::format("give 1 to {} of them", Polyline::kMostPoints));
    for (std::size_t i = 0; i < count; ++i)
        fields.triple(fmt::format("points_m[{}]", i), effect.points_m[i], scaled(kPlaceMm, 1e-3));
    fields.choice("ends", effect.ends, PolylineEnds::endless);
    if (count == 1 && effect.ends == PolylineEnds::open) return; // a point
    try {
        const Polyline curve(effect.points_m, effect.ends);
    } catch (const std::invalid_argument& error) {
        fields.fail("points_m", "make no curve", error.what());
    }
}

void check(const EffectCheck& check, const Guide& effect) {
    check.fields.number("strength_n", effect.strength_n, kHoldingN);
    check.fields.number("capture_m", effect.capture_m, kPositiveOrInfinite);
    check_strength_by_place(check, effect.volume, effect.strength, kHoldingN);
    check_curve(check.fields, effect);
}

EffectNeeds plan(const PlanContext&, const Guide& effect) {
    if (effect.strength_n == 0.0) return off("strength_n is 0: it cannot be felt");
    return on_at_start_of("a line or point at the nearest place of the curve", effect.volume);
}

std::string order(const Guide& effect) {
    return order_text(effect.volume, static_cast<double>(effect.ends), effect.strength_n,
                      effect.capture_m, effect.strength, effect.points_m);
}

std::unique_ptr<Effect> make(const Guide& effect, const EffectParts& parts) {
    const GuideSettings settings{effect.strength_n, effect.capture_m,
                                 strength_over(effect.volume, effect.strength, parts.fields)};
    if (effect.points_m.size() == 1)
        return std::make_unique<PointGuide>(effect.points_m.front(), settings);
    return std::make_unique<CurveGuide>(Polyline(effect.points_m, effect.ends), settings);
}

/// Places to look at when the effect is priced: the corners, and the middles of the pieces.
std::vector<Vec3> places(const Guide& effect) {
    const std::vector<Vec3>& corners = effect.points_m;
    std::vector<Vec3> places = corners;
    for (std::size_t i = 1; i < corners.size(); ++i)
        places.push_back(0.5 * (corners[i - 1] + corners[i]));
    return places;
}

} // namespace
} // namespace palpate::internal::guide_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Guide> Guide::room{
    .traits = {.name = "guide",
               .keys = internal::guide_effect::kKeys,
               .need = internal::FieldNeed::scalar,
               .turn = internal::EffectTurn::guides},
    .read = internal::guide_effect::read,
    .check = internal::guide_effect::check,
    .plan = internal::guide_effect::plan,
    .own = {.order = internal::guide_effect::order,
            .make = internal::guide_effect::make,
            .places = internal::guide_effect::places},
};

} // namespace palpate::effects
