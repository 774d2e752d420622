// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/scene_maker.h"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/stability/random/random_meshes.h"
#include "tests/stability/random/random_volumes.h"

#include "tests/support/test_meshes.h"

namespace palpate::stability {

using test::any_vector;

std::string SceneMaker::number(double value) { return fmt::format("{}", value); }

std::string SceneMaker::triple(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }

Vec3 SceneMaker::place_mm(double spread) {
    return 1e3 * made_.place + any_vector(random_, spread * size_mm());
}

std::string SceneMaker::strength() { return number(of_any_size(0.05, 5.0)); }

SceneTable& SceneMaker::add(const std::string& header, Keys keys) {
    made_.tables.push_back({header, std::move(keys), ++ids_});
    return made_.tables.back();
}

void SceneMaker::effect(const std::string& type, Keys keys) {
    keys.insert(keys.begin(), {"type", quoted(type)});
    add("[[effect]]", std::move(keys));
}

RandomCase SceneMaker::make() {
    made_.size_m = chance(0.6) ? between(8e-3, 20e-3) : of_any_size(1e-3, 1.0);
    if (chance(0.2)) made_.place = any_vector(random_, of_any_size(0.1, 1000.0));
    const bool plain = chance(0.15); // one surface and nothing else: the most is known of it
    make_loop();
    if (plain || chance(0.97))
        for (int i = 1 + (!plain && chance(0.4) ? pick(3) : 0); i > 0; --i)
            make_surface();
    if (!plain && chance(0.75))
        for (int i = pick(6); i > 0; --i)
            make_effect(pick(18));
    return std::move(made_);
}

void SceneMaker::make_loop() {
    const std::string method =
        word({"adaptive", "adaptive", "adaptive", "fixed", "paper", "single"});
    Keys loop{{"method", quoted(method)}};
    if (chance(0.3)) loop.emplace_back("rate_hz", word({"500", "2000", "4000", "10000"}));
    if (method == "adaptive" && chance(0.3))
        loop.emplace_back("evaluation_cap", word({"1", "2", "20", "64"}));
    if (method == "adaptive" && chance(0.2))
        loop.emplace_back("tolerance_um", number(of_any_size(0.01, 10.0)));
    if (method == "fixed" && chance(0.7))
        loop.emplace_back("sub_steps", std::to_string(1 + pick(20)));
    add("[loop]", loop);
    if (chance(0.5)) {
        Keys coupling{{"stiffness_n_per_m", number(of_any_size(100.0, 2000.0))}};
        if (chance(0.3)) coupling.emplace_back("damping_n_s_per_m", number(between(0.0, 1.0)));
        add("[coupling]", coupling);
    }
    if (chance(0.3)) {
        Keys limits{{"force_n", number(of_any_size(0.5, 20.0))}};
        if (chance(0.5)) limits.emplace_back("slew_n_per_s", number(of_any_size(50.0, 1e5)));
        add("[limits]", limits);
    }
}

void SceneMaker::make_surface() {
    if (atlas_) return by_labels();
    const double kind = between(0.0, 1.0);
    if (kind < 0.34) return by_formula();
    if (kind < 0.58) return by_voxels();
    if (kind < 0.88) return by_mesh();
    if (kind < 0.98) return by_both();
    by_labels();
}

SceneMaker::Keys SceneMaker::formula_keys() {
    const double size = size_mm();
    switch (pick(6)) {
    case 0:
        return {{"analytic", quoted("sphere_cavity")},
                {"radius_mm", number(size * between(0.5, 1))}};
    case 1: {
        const double wave = size * between(0.5, 1.5);
        return {{"analytic", quoted("bumpy_cavity")},
                {"radius_mm", number(size * between(0.6, 1))},
                {"amplitude_mm", number(wave * between(0.01, 0.08))},
                {"wavelength_mm", number(wave)}};
    }
    case 2:
        return {{"analytic", quoted("slab")},
                {"thickness_mm", number(size * of_any_size(0.02, 1))}};
    case 3: {
        const double angle = between(1.0, 175.0);
        return {{"analytic", quoted("wedge")},
                {"angle_deg", number(chance(0.5) ? angle : 360.0 - angle)}};
    }
    case 4:
        return {{"analytic", quoted("torus")},
                {"radius_mm", number(0.7 * size)},
                {"tube_mm", number(size * between(0.05, 0.6))}};
    default:
        return {{"analytic", quoted("solid_sphere")},
                {"radius_mm", number(size * between(0.5, 1))}};
    }
}

std::string SceneMaker::add_formula() {
    const std::string name = fresh("formula");
    add("[volume." + name + "]", formula_keys());
    scalars_.push_back(name);
    return name;
}

void SceneMaker::by_formula() {
    Body body{fresh("surface"), add_formula(), true, false, false};
    body.moves = made_.place != Vec3(0.0); // formulas are about the origin: only a pose puts them
    Keys keys{{"volume", quoted(body.volume)}};
    if (chance(0.3)) keys.emplace_back("iso_value", number(between(-0.05, 0.009) * made_.size_m));
    finish_surface(std::move(body), std::move(keys), true);
}

void SceneMaker::by_voxels() {
    const RandomVolume volume = random_volume(random_, made_.size_m, made_.place);
    Body body{fresh("surface"), fresh("voxels"), true, false, false};
    made_.volumes[body.volume + ".nrrd"] = volume.file;
    add("[volume." + body.volume + "]", {{"file", quoted(body.volume + ".nrrd")}});
    scalars_.push_back(body.volume);
    Keys keys{{"volume", quoted(body.volume)}, {"iso_value", number(volume.level)}};
    if (chance(0.06)) { // extracted: slow
        const Keys guarded = guarded_keys();
        keys.insert(keys.end(), guarded.begin(), guarded.end());
    } else {
        keys.emplace_back("contact", quoted("volume"));
    }
    if (chance(0.1)) keys.emplace_back("smooth_voxels", number(between(0.3, 1.5)));
    if (chance(0.1)) keys.emplace_back("keep", quoted("largest"));
    finish_surface(std::move(body), std::move(keys), true);
}

/// A mesh is extracted from the voxels.
SceneMaker::Keys SceneMaker::guarded_keys() {
    Keys keys{{"contact", quoted("guarded")}};
    keys.emplace_back("facet_size_mm", number(std::min(50.0, size_mm() * of_any_size(0.1, 0.5))));
    keys.emplace_back("facet_distance_mm",
                      number(std::min(10.0, size_mm() * of_any_size(0.01, 0.05))));
    return keys;
}

void SceneMaker::by_labels() {
    const std::string volume = fresh("labels");
    VoxelFile& file = made_.volumes[volume + ".nrrd"];
    file = atlas_ ? labels_of(*atlas_, random_, made_.size_m, made_.place)
                  : random_labels(random_, chance(0.6) ? 3 : 1, made_.size_m, made_.place);
    const auto labels =
        static_cast<int>(*std::max_element(file.volume->values.begin(), file.volume->values.end()));
    add("[volume." + volume + "]", {{"file", quoted(volume + ".nrrd")}});
    const Keys contact = chance(0.15) ? guarded_keys() : Keys{{"contact", quoted("volume")}};
    for (int label = 1; label <= labels; ++label) {
        Keys keys{{"volume", quoted(volume)}, {"label", "[" + std::to_string(label) + "]"}};
        keys.insert(keys.end(), contact.begin(), contact.end());
        finish_surface({fresh("surface"), volume, true, false, false}, std::move(keys), true);
    }
}

void SceneMaker::by_mesh() {
    RandomMesh mesh = random_mesh(random_, made_.size_m);
    for (Vec3& p : mesh.mesh.vertices)
        p += made_.place;
    const Body body{fresh("surface"), "", false, false, false};
    made_.meshes[body.name + ".ply"] = std::make_shared<const TriangleMesh>(std::move(mesh.mesh));
    finish_surface(body,
                   {{"mesh", quoted(body.name + ".ply")},
                    {"mesh_unit", quoted("m")},
                    {"mesh_frame", quoted("LPS")}},
                   true);
}

/// A ball by a formula or by voxels, and its mesh.
void SceneMaker::by_both() {
    const double radius_m = made_.size_m * between(0.5, 0.9);
    Body body{fresh("surface"), fresh("ball"), false, false, false};
    const bool by_formula = made_.place == Vec3(0.0) && chance(0.5);
    if (by_formula) {
        add("[volume." + body.volume + "]",
            {{"analytic", quoted("solid_sphere")}, {"radius_mm", number(1e3 * radius_m)}});
    } else {
        auto volume = std::make_shared<VoxelVolume>();
        constexpr int kVoxels = 20;
        const double h = 2.4 * made_.size_m / kVoxels;
        volume->size = {kVoxels, kVoxels, kVoxels};
        volume->index_to_scene = {Mat3(h), made_.place - Vec3(0.5 * h * (kVoxels - 1))};
        for (int k = 0; k < kVoxels; ++k)
            for (int j = 0; j < kVoxels; ++j)
                for (int i = 0; i < kVoxels; ++i)
                    volume->values.push_back(static_cast<float>(
                        radius_m -
                        glm::length(volume->index_to_scene.point(Vec3(i, j, k)) - made_.place)));
        made_.volumes[body.volume + ".nrrd"] = {volume, false};
        add("[volume." + body.volume + "]", {{"file", quoted(body.volume + ".nrrd")}});
    }
    scalars_.push_back(body.volume);
    made_.meshes[body.name + ".ply"] =
        std::make_shared<const TriangleMesh>(test::icosphere(radius_m, 3, made_.place));
    const std::string contact = word({"guarded", "guarded", "guarded", "direct", "mesh", "volume"});
    body.textured = contact == "guarded" || contact == "volume";
    Keys keys{{"volume", quoted(body.volume)},      {"iso_value", "0"},
              {"mesh", quoted(body.name + ".ply")}, {"mesh_unit", quoted("m")},
              {"mesh_frame", quoted("LPS")},        {"contact", quoted(contact)}};
    // The mesh is within 3 % of the radius from the voxels' level, and has to be within the leash.
    if (size_mm() > 20.0 || chance(0.5))
        keys.emplace_back("leash_mm", number(std::min(10.0, size_mm() * between(0.05, 0.2))));
    finish_surface(std::move(body), std::move(keys), contact != "direct");
}

void SceneMaker::finish_surface(Body body, Keys keys, bool may_yield) {
    if (may_yield && chance(0.25)) {
        keys.emplace_back("strength_n", strength());
        if (chance(0.4)) keys.emplace_back("yield", quoted("opens"));
    }
    if (!body.moves) body.moves = chance(0.2);
    if (body.moves) keys.emplace_back("moves", "true");
    const SceneTable& table = add("[surface." + body.name + "]", std::move(keys));
    if (body.moves && made_.place != Vec3(0.0) && body.volume.starts_with("formula")) {
        CaseEvent pose;
        pose.kind = CaseEvent::Kind::pose;
        pose.table = table.id;
        pose.pose.position = made_.place;
        made_.events.push_back(pose);
    }
    effect("surface", {{"surface", quoted(body.name)}});
    bodies_.push_back(std::move(body));
}

std::string SceneMaker::scalars() {
    if (scalars_.empty()) return add_formula();
    return word(scalars_);
}

std::string SceneMaker::vectors() {
    if (!vectors_.empty() && chance(0.5)) return word(vectors_);
    const std::string name = fresh("stream");
    if (chance(0.5)) {
        add("[volume." + name + "]", {{"analytic", quoted("helix")},
                                      {"radius_mm", number(size_mm() * between(0.3, 1.0))},
                                      {"pitch_mm", number(size_mm() * between(0.3, 2.0))}});
    } else {
        made_.vectors[name + ".nrrd"] = random_vectors(random_, made_.size_m, made_.place);
        add("[volume." + name + "]", {{"file", quoted(name + ".nrrd")}});
    }
    vectors_.push_back(name);
    return name;
}

SceneMaker::Keys SceneMaker::strength_over_volume(const std::string& key, double low, double high) {
    if (chance(0.65)) return {{key, number(between(low, high))}};
    const double reach = 0.2 * made_.size_m;
    return {{"volume", quoted(scalars())},
            {key, fmt::format("[[{}, {}], [{}, {}]]", -reach, between(low, high), reach,
                              between(low, high))}};
}

} // namespace palpate::stability
