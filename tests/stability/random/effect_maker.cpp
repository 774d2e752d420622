// SPDX-License-Identifier: Apache-2.0
// The effects of SceneMaker, each with its own keys.
#include <fmt/format.h>

#include "tests/stability/random/scene_maker.h"

namespace palpate::stability {

using test::any_vector;

void SceneMaker::make_friction(Body& body) {
    if (body.rubs) return;
    body.rubs = true;
    const double at_rest = of_any_size(0.05, 2.0);
    effect(word({"friction", "stick_slip"}), {{"surface", quoted(body.name)},
                                              {"static", number(at_rest)},
                                              {"dynamic", number(between(0.2, 1.0) * at_rest)}});
}

void SceneMaker::make_guide() {
    std::string points;
    const int count = 1 + pick(5);
    for (int i = 0; i < count; ++i)
        points += (points.empty() ? "" : ", ") + triple(place_mm(1.0));
    Keys keys{{"points_mm", "[" + points + "]"}};
    for (auto& key : strength_over_volume("strength_n", 0.05, 4.0))
        keys.push_back(std::move(key));
    if (chance(0.5)) keys.emplace_back("capture_mm", number(size_mm() * between(0.05, 0.5)));
    if (count > 2 && chance(0.5))
        keys.emplace_back("ends", quoted(word({"open", "closed", "endless"})));
    effect("guide", std::move(keys));
}

void SceneMaker::make_workspace() {
    Keys keys;
    if (chance(0.5)) {
        keys = {{"radius_mm", number(size_mm() * between(0.5, 2.0))},
                {"center_mm", triple(place_mm(0.2))}};
    } else {
        const Vec3 half = size_mm() * (Vec3(1.0) + any_vector(random_, 0.5));
        const Vec3 center = place_mm(0.2);
        keys = {{"box_mm", "[" + triple(center - half) + ", " + triple(center + half) + "]"}};
    }
    if (chance(0.4)) keys.emplace_back("strength_n", strength());
    effect("workspace", std::move(keys));
}

void SceneMaker::make_field_effect(int kind) {
    Keys keys;
    std::string type;
    if (kind < 2) {
        type = kind == 0 ? "gradient_surface" : "gradient_force";
        keys = {{"volume", quoted(scalars())}, {"strength_n", strength()}};
    } else {
        type = word({"vector_force", "vector_follow", "fibre_follow", "front_shape", "vortex"});
        keys = {{"volume", quoted(vectors())}, {"strength_n", strength()}};
        if (type.ends_with("follow") && chance(0.5))
            keys.emplace_back("guide", quoted(word({"tangent", "midpoint", "streamline"})));
    }
    for (const Body& body : bodies_)
        if (body.moves && chance(0.2)) {
            keys.emplace_back("moves_with", quoted(body.name));
            break;
        }
    effect(type, std::move(keys));
}

void SceneMaker::make_effect(int kind) {
    if (kind < 5) return make_field_effect(kind);
    switch (kind) {
    case 5:
        return effect("constant_force", {{"force_n", triple(any_vector(random_, 0.7))}});
    case 6:
    case 7:
        // As strong as a frame's coupling at most some 20 times: else it creeps for minutes.
        return effect("viscosity", strength_over_volume("damping_n_s_per_m", 0.0, 0.5));
    case 8:
        return make_guide();
    case 9:
        return make_workspace();
    case 10:
        return effect("gravity_compensation",
                      {{"mass_kg", number(between(0.0, 0.1))}, {"down", triple({0.1, -1.0, 0.2})}});
    default:
        break;
    }
    if (bodies_.empty()) return;
    Body& body = bodies_[static_cast<std::size_t>(pick(static_cast<int>(bodies_.size())))];
    const std::string name = quoted(body.name);
    if (kind < 14) return make_friction(body);
    if (kind == 14) return effect("vibration", chance(0.5) ? Keys{{"surface", name}} : Keys{});
    if (kind == 15 && !body.volume.empty())
        return effect("viscosity",
                      {{"surface", name}, {"damping_n_s_per_m", number(between(0.0, 0.5))}});
    if (kind == 16 && body.textured) {
        const double wave = size_mm() * between(0.05, 0.3);
        return effect("texture", {{"surface", name},
                                  {"wavelength_mm", number(wave)},
                                  {"height_mm", number(wave * between(0.0, 0.15))}});
    }
    Keys keys{{"surface", name}, {"capture_mm", number(size_mm() * between(0.01, 0.2))}};
    for (auto& key : strength_over_volume("strength_n", 0.05, 2.0))
        keys.push_back(std::move(key));
    effect("magnet", std::move(keys));
}

} // namespace palpate::stability
