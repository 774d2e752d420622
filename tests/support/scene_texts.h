// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <palpate/geometry/vec.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"

/// Random scenes as users write them, in TOML: every kind of effect, contact and method.
namespace palpate::test {

/// The draw of one scene and of a hand's way through it: the same seed, the same text and way.
/// Bodies are some 10 mm large and lie around the origin. Each draw is a statement of its own:
/// compilers differ in which argument of a call they evaluate first.
class SceneTextDraw {
public:
    explicit SceneTextDraw(std::uint64_t seed) : random_(seed) {}

    /// The meshes that scenes name, written into a folder.
    static void make_meshes(const std::filesystem::path& folder) {
        make_file(folder / "ball.ply", ascii_ply(icosphere(12.0, 3)));
        make_file(folder / "bumps.ply", ascii_ply(bumpy_sphere(12.0, 3)));
        make_file(folder / "box.ply", ascii_ply(box_mesh({-9, -7, -8}, {9, 8, 7})));
    }

    std::string text() {
        std::string loop = make_loop();
        for (int i = draw(1, 3); i > 0; --i)
            add_surface();
        if (!chance(0.2)) add_stream();
        for (int i = draw(0, 6); i > 0; --i)
            add_effect();
        return loop + volumes_ + surfaces_ + effects_;
    }

    /// The probe's places, `frames` of them: through the bodies, at rest, and in leaps.
    std::vector<Vec3> way(int frames) {
        std::vector<Vec3> way;
        Vec3 probe = 18e-3 * within_ball(), velocity{0.0};
        while (static_cast<int>(way.size()) < frames) {
            const double kind = one();
            velocity =
                kind < 0.15 ? Vec3{0.0} : (kind < 0.9 ? 2e-4 : 2e-3) * within_ball() - 3e-3 * probe;
            for (int i = draw(5, 60); i > 0; --i)
                way.push_back(probe += velocity);
        }
        way.resize(static_cast<std::size_t>(frames));
        return way;
    }

private:
    struct Surface {
        std::string name, volume; // volume: of itself; empty for a mesh alone
        bool textured = false;    // may have a texture
    };

    double one() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
    bool chance(double p) { return one() < p; }
    double between(double low, double high) { return low + (high - low) * one(); }
    int draw(int low, int high) { return low + static_cast<int>((high - low + 1) * one()); }
    double strength() { return std::exp(between(std::log(0.05), std::log(5.0))); }
    Vec3 within_ball() {
        for (;;) {
            const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
            if (x * x + y * y + z * z <= 1.0) return {x, y, z};
        }
    }
    static std::string triple(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }
    template <class Of>
    const Of& any_of(const std::vector<Of>& these) {
        return these[static_cast<std::size_t>(draw(0, static_cast<int>(these.size()) - 1))];
    }
    std::string word(const std::vector<std::string>& words) { return any_of(words); }

    std::string make_loop() {
        std::string text = fmt::format("[loop]\nmethod = \"{}\"\n",
                                       word({"single", "paper", "fixed", "adaptive", "adaptive"}));
        if (chance(0.3)) text += "rate_hz = 4000\n";
        if (chance(0.5)) {
            const double damping = chance(0.3) ? between(0, 1) : 0.0;
            text += fmt::format("[coupling]\nstiffness_n_per_m = {}\ndamping_n_s_per_m = {}\n",
                                between(100, 2000), damping);
        }
        if (chance(0.3)) text += fmt::format("[limits]\nforce_n = {}\n", between(1, 8));
        return text;
    }

    std::string add_volume() {
        const std::string name = fmt::format("volume{}", ++named_);
        std::string keys;
        switch (draw(0, 5)) {
        case 0:
            keys = fmt::format("sphere_cavity\"\nradius_mm = {}\n", between(8, 16));
            break;
        case 1: {
            const double wavelength = between(8, 20);
            const double amplitude = between(0.2, 1);
            keys = fmt::format("bumpy_cavity\"\nradius_mm = {}\namplitude_mm = {}\n"
                               "wavelength_mm = {}\n",
                               between(9, 15), amplitude, wavelength);
            break;
        }
        case 2:
            keys = fmt::format("slab\"\nthickness_mm = {}\n", between(2, 12));
            break;
        case 3:
            keys = fmt::format("wedge\"\nangle_deg = {}\n", between(20, 160));
            break;
        case 4: {
            const double tube = between(2, 6);
            keys = fmt::format("torus\"\nradius_mm = {}\ntube_mm = {}\n", between(8, 14), tube);
            break;
        }
        default:
            keys = fmt::format("solid_sphere\"\nradius_mm = {}\n", between(8, 16));
        }
        volumes_ += "[volume." + name + "]\nanalytic = \"" + keys;
        scalars_.push_back(name);
        return name;
    }

    void add_surface() {
        Surface surface;
        surface.name = fmt::format("surface{}", ++named_);
        std::string keys;
        bool may_yield = true;
        const std::string mesh_keys = "mesh_unit = \"mm\"\nmesh_frame = \"LPS\"\n";
        if (chance(0.6)) {
            surface.volume = add_volume();
            surface.textured = true;
            keys = fmt::format("volume = \"{}\"\niso_value = {}\n", surface.volume,
                               chance(0.7) ? 0.0 : between(-5e-4, 5e-4));
        } else if (chance(0.5)) {
            keys = fmt::format("mesh = \"{}\"\n", word({"ball.ply", "bumps.ply", "box.ply"})) +
                   mesh_keys;
        } else {
            surface.volume = fmt::format("volume{}", ++named_);
            volumes_ +=
                "[volume." + surface.volume + "]\nanalytic = \"solid_sphere\"\nradius_mm = 12\n";
            scalars_.push_back(surface.volume);
            const std::string contact = word({"guarded", "guarded", "direct", "mesh", "volume"});
            surface.textured = contact == "guarded" || contact == "volume";
            may_yield = contact != "direct";
            keys = fmt::format("volume = \"{}\"\niso_value = 0\nmesh = \"ball.ply\"\n"
                               "contact = \"{}\"\n",
                               surface.volume, contact) +
                   mesh_keys;
        }
        if (may_yield && chance(0.35)) keys += fmt::format("strength_n = {}\n", strength());
        if (may_yield && chance(0.3)) keys += "yield = \"opens\"\n";
        surfaces_ += "[surface." + surface.name + "]\n" + keys;
        effects_ += "[[effect]]\ntype = \"surface\"\nsurface = \"" + surface.name + "\"\n";
        bodies_.push_back(surface);
    }

    void add_stream() {
        const double pitch = between(5, 30);
        volumes_ += fmt::format("[volume.stream]\nanalytic = \"helix\"\nradius_mm = {}\n"
                                "pitch_mm = {}\n",
                                between(5, 15), pitch);
        vectors_.push_back("stream");
    }

    /// A number, or a function over a volume of scalars.
    std::string number_or_function(const std::string& key, double low, double high) {
        if (chance(0.6)) return fmt::format("{} = {}\n", key, between(low, high));
        const double last = between(low, high);
        const double first = between(low, high);
        return fmt::format("volume = \"{}\"\n{} = [[-0.004, {}], [0.004, {}]]\n",
                           scalars_.empty() ? add_volume() : any_of(scalars_), key, first, last);
    }

    std::string points(int count) {
        std::string text = "points_mm = [";
        for (int i = 0; i < count; ++i)
            text += (i > 0 ? ", " : "") + triple(14.0 * within_ball());
        return text + "]\n";
    }

    void add_effect() {
        const Surface& body = any_of(bodies_);
        const std::string of_body = "surface = \"" + body.name + "\"\n";
        const auto add = [&](const std::string& type, const std::string& keys) {
            effects_ += "[[effect]]\ntype = \"" + type + "\"\n" + keys;
        };
        const auto of_volume = [&](const std::vector<std::string>& volumes) {
            const double strength_n = strength();
            return fmt::format("volume = \"{}\"\nstrength_n = {}\n",
                               volumes.empty() ? add_volume() : any_of(volumes), strength_n);
        };
        switch (draw(0, 16)) {
        case 0:
            return add("gradient_surface", of_volume(scalars_));
        case 1:
            return add("gradient_force", of_volume(scalars_));
        case 2:
            return add("constant_force", "force_n = " + triple(0.5 * within_ball()) + "\n");
        case 3:
            return add("viscosity", number_or_function("damping_n_s_per_m", 0.0, 5.0));
        case 4:
        case 5:
            return add_friction(body);
        case 6: {
            if (!body.textured) return;
            const double height = between(0.01, 0.15);
            return add("texture", of_body + fmt::format("wavelength_mm = {}\nheight_mm = {}\n",
                                                        between(1, 4), height));
        }
        case 7: {
            const double capture = between(0.2, 3);
            return add("magnet", of_body + number_or_function("strength_n", 0.05, 1.5) +
                                     fmt::format("capture_mm = {}\n", capture));
        }
        case 8: {
            const std::string capture = chance(0.5) ? "capture_mm = 4\n" : "";
            const std::string strength_n = number_or_function("strength_n", 0.05, 4.0);
            return add("guide", points(draw(1, 5)) + strength_n + capture);
        }
        case 9: {
            if (chance(0.5))
                return add("workspace",
                           fmt::format("radius_mm = {}\ncenter_mm = [1, 0, 0]\n", between(10, 25)));
            const double strength_n = strength();
            return add("workspace", fmt::format("box_mm = [[-12, -11, -13], [{}, 10, 11]]\n"
                                                "strength_n = {}\n",
                                                between(5, 12), strength_n));
        }
        case 10:
            return add("vibration", chance(0.5) ? of_body : "");
        case 11:
            return add("gravity_compensation", "mass_kg = 0.05\ndown = [0, -1, 0.2]\n");
        default: {
            if (vectors_.empty()) return;
            const std::string keys = of_volume(vectors_);
            return add(
                word({"vector_force", "vector_follow", "fibre_follow", "front_shape", "vortex"}),
                keys);
        }
        }
    }

    /// Friction once on a surface at most, as scenes have it.
    void add_friction(const Surface& body) {
        if (std::find(rubbed_.begin(), rubbed_.end(), body.name) != rubbed_.end()) return;
        rubbed_.push_back(body.name);
        const double at_rest = between(0.05, 0.8);
        const double sliding = between(0.2, 1.0) * at_rest;
        effects_ += fmt::format("[[effect]]\ntype = \"{}\"\nsurface = \"{}\"\nstatic = {}\n"
                                "dynamic = {}\n",
                                word({"friction", "stick_slip"}), body.name, at_rest, sliding);
    }

    std::mt19937_64 random_;
    int named_ = 0;
    std::string volumes_, surfaces_, effects_;
    std::vector<Surface> bodies_;
    std::vector<std::string> scalars_, vectors_, rubbed_;
};

} // namespace palpate::test
