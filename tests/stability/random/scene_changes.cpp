// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/scene_changes.h"

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "tests/stability/random/random_volumes.h"

#include "tests/support/test_meshes.h"

namespace palpate::stability {
namespace {

/// A table's id that no other one has, nor those above it.
int free_id(const RandomCase& made) {
    int id = 0;
    for (const SceneTable& table : made.tables)
        id = std::max(id, table.id);
    return id + 1;
}

bool is_surface(const SceneTable& table) { return table.header.starts_with("[surface."); }

bool is_effect_of(const SceneTable& table, std::initializer_list<std::string_view> kinds) {
    return table.is_effect() && std::any_of(kinds.begin(), kinds.end(), [&](std::string_view kind) {
               return table.value("type") == fmt::format("\"{}\"", kind);
           });
}

void make_soft(SceneTable& surface, double size_m, test::Random& random) {
    if (test::chance(random, 0.3)) {
        // From a piece that is flat to one that is as good as hard; it may saturate.
        const double depth = 1e3 * size_m * test::between(random, 0.02, 0.2);
        const double force = test::of_any_size(random, 0.05, 5.0);
        surface.keys.emplace_back("stiffness_mm_n",
                                  fmt::format("[[{}, {}], [{}, {}], [{}, {}]]", depth,
                                              test::chance(random, 0.3) ? 0.0 : 0.3 * force,
                                              2.0 * depth, force, 3.0 * depth,
                                              (test::chance(random, 0.3) ? 1.0 : 1.5) * force));
    } else {
        surface.keys.emplace_back("stiffness_n_per_mm",
                                  fmt::format("{}", test::of_any_size(random, 0.005, 1.0)));
    }
    if (test::chance(random, 0.3))
        surface.keys.emplace_back("press_damping_n_s_per_m",
                                  fmt::format("{}", test::of_any_size(random, 0.1, 50.0)));
}

/// The only surface, without what is not composed with it.
void soften_alone(RandomCase& made, test::Random& random) {
    std::erase_if(made.tables, [](const SceneTable& table) {
        return table.is_effect() &&
               !is_effect_of(table, {"surface", "friction", "stick_slip", "texture",
                                     "constant_force", "gravity_compensation", "vibration"});
    });
    make_soft(*std::find_if(made.tables.begin(), made.tables.end(), is_surface), made.size_m,
              random);
}

/// Some of the surfaces that stand still, beside all else: without what would act on their fronts.
void soften_beside(RandomCase& made, test::Random& random) {
    std::vector<std::string> soft;
    for (SceneTable& table : made.tables) {
        if (!is_surface(table) || !table.value("moves").empty() || test::chance(random, 0.4))
            continue;
        std::erase_if(table.keys, [](const auto& key) {
            return key.first == "strength_n" || key.first == "yield";
        });
        make_soft(table, made.size_m, random);
        soft.push_back(fmt::format("\"{}\"", table.name()));
    }
    std::erase_if(made.tables, [&](const SceneTable& table) {
        return is_effect_of(table, {"friction", "stick_slip", "magnet"}) &&
               std::find(soft.begin(), soft.end(), table.value("surface")) != soft.end();
    });
}

/// Instead of all surfaces: one that has lumps beneath, with what only pushes.
void lay_lumps(RandomCase& made, test::Random& random) {
    std::erase_if(made.tables, [](const SceneTable& table) {
        return is_surface(table) ||
               (table.is_effect() &&
                !is_effect_of(table, {"constant_force", "gravity_compensation", "vibration"}));
    });
    made.volumes["lumps.nrrd"] = random_lumps(random, made.size_m, made.place);
    const int id = free_id(made);
    const auto ratio = [&] { return test::of_any_size(random, 0.1, 100.0); };
    SceneTable surface{
        "[surface.organ]",
        {{"volume", "\"lumps\""},
         {"label", "[1, 2, 3]"},
         {"contact", "\"volume\""},
         {"contact_radius_mm", fmt::format("{}", test::of_any_size(random, 1.5, 10.0))},
         {"beneath", fmt::format("{{ \"2\" = {}, \"3\" = {} }}", ratio(), ratio())}},
        id};
    make_soft(surface, made.size_m, random);
    made.tables.push_back({"[volume.lumps]", {{"file", "\"lumps.nrrd\""}}, id + 1});
    made.tables.push_back(std::move(surface));
    made.tables.push_back(
        {"[[effect]]", {{"type", "\"surface\""}, {"surface", "\"organ\""}}, id + 2});
}

} // namespace

void soften(RandomCase& made) {
    constexpr std::uint64_t kOwnDraws = 0x50f7, kDrawsOfLumps = 0x1032;
    test::Random lumps(made.seed ^ kDrawsOfLumps << 32);
    const bool is_small = made.size_m > 4e-3 && made.size_m < 0.05; // of a size that lumps have
    if (is_small && test::chance(lumps, 0.05)) return lay_lumps(made, lumps);
    test::Random random(made.seed ^ kOwnDraws << 32);
    const bool is_one = std::count_if(made.tables.begin(), made.tables.end(), is_surface) == 1;
    if (is_one && test::chance(random, 0.25)) return soften_alone(made, random);
    const bool is_adaptive =
        std::any_of(made.tables.begin(), made.tables.end(), [](const SceneTable& table) {
            return table.header == "[loop]" && table.value("method") == "\"adaptive\"";
        });
    if (is_adaptive && test::chance(random, 0.6)) soften_beside(made, random);
}

void guard_a_sieve(RandomCase& made) {
    constexpr std::uint64_t kOwnDraws = 0x51e7d;
    test::Random random(made.seed ^ kOwnDraws << 32);
    if (!test::chance(random, 0.03)) return;
    const double radius_m = made.size_m * test::between(random, 0.5, 0.9);
    std::erase_if(made.tables, [](const SceneTable& table) {
        return is_surface(table) || (table.is_effect() && !table.value("surface").empty());
    });
    const int id = free_id(made);
    const double leash_mm = std::min(10.0, 1e3 * made.size_m * test::between(random, 0.1, 0.4));
    made.volumes["sieve.nrrd"] =
        random_sieve(random, radius_m, 1e-3 * leash_mm, made.size_m, made.place);
    made.meshes["sieve.ply"] =
        std::make_shared<const TriangleMesh>(test::icosphere(radius_m, 3, made.place));
    made.tables.push_back({"[volume.sieve]", {{"file", "\"sieve.nrrd\""}}, id});
    made.tables.push_back({"[surface.sieve]",
                           {{"volume", "\"sieve\""},
                            {"iso_value", "0"},
                            {"mesh", "\"sieve.ply\""},
                            {"mesh_unit", "\"m\""},
                            {"mesh_frame", "\"LPS\""},
                            {"contact", "\"guarded\""},
                            {"leash_mm", fmt::format("{}", leash_mm)}},
                           id + 1});
    made.tables.push_back(
        {"[[effect]]", {{"type", "\"surface\""}, {"surface", "\"sieve\""}}, id + 2});
}

void join_labels(RandomCase& made) {
    constexpr std::uint64_t kOwnDraws = 0x101a7;
    constexpr int kLabels = 3;
    test::Random random(made.seed ^ kOwnDraws << 32);
    if (!test::chance(random, 0.03)) return;
    std::erase_if(made.tables,
                  [](const SceneTable& table) { return is_surface(table) || table.is_effect(); });
    int id = free_id(made);
    made.volumes["joined.nrrd"] = random_labels(random, kLabels, made.size_m, made.place);
    made.tables.push_back({"[volume.joined]", {{"file", "\"joined.nrrd\""}}, id});
    for (int label = 1; label <= kLabels; ++label) {
        made.tables.push_back({fmt::format("[surface.label{}]", label),
                               {{"volume", "\"joined\""},
                                {"label", fmt::format("[{}]", label)},
                                {"contact", "\"volume\""}},
                               ++id});
        made.tables.push_back(
            {"[[effect]]",
             {{"type", "\"surface\""}, {"surface", fmt::format("\"label{}\"", label)}},
             ++id});
    }
}

void step_finely(RandomCase& made) {
    constexpr std::uint64_t kOwnDraws = 0x57e9;
    test::Random random(made.seed ^ kOwnDraws << 32);
    for (SceneTable& table : made.tables) {
        if (table.value("method") != "\"fixed\"" || !test::chance(random, 0.3)) continue;
        std::erase_if(table.keys, [](const auto& key) { return key.first == "sub_steps"; });
        const double steps = test::of_any_size(random, 32.0, 4096.0);
        table.keys.emplace_back("sub_steps", std::to_string(static_cast<int>(steps)));
    }
}

} // namespace palpate::stability
