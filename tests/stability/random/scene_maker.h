// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/volume/label_volume.h>

#include "tests/stability/random/random_case.h"

#include "tests/support/random_scenes.h"

namespace palpate::stability {

/// Draws a scene: its tables and its data. All kinds of effects, contacts and methods; bodies of 1
/// mm to 1 m, up to 1 km from the origin.
class SceneMaker {
public:
    /// `atlas`: where labels are taken from, and all surfaces are of labels; null: labels are made,
    /// and few surfaces are of labels.
    explicit SceneMaker(test::Random& random, const LabelVolume* atlas = nullptr)
        : random_(random), atlas_(atlas) {}

    /// The scene alone: no steps, and no events but the first poses of bodies by a formula that lie
    /// away from the origin.
    RandomCase make();

private:
    using Keys = std::vector<std::pair<std::string, std::string>>;
    struct Body {
        std::string name, volume; // volume: of its own; empty for a mesh alone
        bool textured = false, moves = false, rubs = false;
    };

    SceneTable& add(const std::string& header, Keys keys);
    bool chance(double share) { return test::chance(random_, share); }
    double between(double low, double high) { return test::between(random_, low, high); }
    double of_any_size(double low, double high) { return test::of_any_size(random_, low, high); }
    int pick(int count) { return test::pick(random_, count); }
    std::string word(const std::vector<std::string>& words) {
        return words[static_cast<std::size_t>(pick(static_cast<int>(words.size())))];
    }
    static std::string number(double value);
    static std::string quoted(const std::string& text) { return "\"" + text + "\""; }
    static std::string triple(const Vec3& v);
    double size_mm() const { return 1e3 * made_.size_m; }
    Vec3 place_mm(double spread);
    std::string strength();
    std::string fresh(const std::string& stem) { return stem + std::to_string(++named_); }

    void make_loop();
    void make_surface();
    void finish_surface(Body body, Keys keys, bool may_yield);
    Keys formula_keys();
    std::string add_formula();
    void by_formula();
    void by_voxels();
    void by_labels();
    Keys guarded_keys();
    void by_mesh();
    void by_both();
    void make_effect(int kind);
    void make_field_effect(int kind);
    void make_guide();
    void make_workspace();
    void make_friction(Body& body);
    Keys strength_over_volume(const std::string& key, double low, double high);
    std::string scalars();
    std::string vectors();
    std::string any_volume() { return chance(0.5) ? scalars() : vectors(); }
    void effect(const std::string& type, Keys keys);

    test::Random& random_;
    const LabelVolume* atlas_;
    RandomCase made_;
    std::vector<Body> bodies_;
    std::vector<std::string> scalars_, vectors_;
    int named_ = 0, ids_ = 0;
};

} // namespace palpate::stability
