// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene_description.h>

/// Scenes, loops and devices made in code, at random; and any field of them made absurd.
namespace palpate::test {

using Random = std::mt19937_64;

inline bool chance(Random& random, double share) {
    return std::bernoulli_distribution(share)(random);
}
inline int pick(Random& random, int count) {
    return std::uniform_int_distribution<int>(0, count - 1)(random);
}
inline double between(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
/// As many of each size.
inline double of_any_size(Random& random, double low, double high) {
    return low * std::pow(high / low, between(random, 0.0, 1.0));
}
inline double absurd(Random& random) {
    constexpr std::array numbers{std::numeric_limits<double>::quiet_NaN(),
                                 std::numeric_limits<double>::infinity(),
                                 -std::numeric_limits<double>::infinity(),
                                 -1.0,
                                 0.0,
                                 -0.0,
                                 1e300,
                                 -1e300,
                                 1e-300,
                                 -1e-12,
                                 1e12,
                                 4.9e-324};
    return numbers[static_cast<std::size_t>(pick(random, numbers.size()))];
}
inline Vec3 any_vector(Random& random, double size) {
    return {between(random, -size, size), between(random, -size, size),
            between(random, -size, size)};
}
inline Vec3 absurd_vector(Random& random) {
    Vec3 v = any_vector(random, 1.0);
    v[pick(random, 3)] = absurd(random);
    return v;
}

/// A field of a scene, a loop or a device.
struct Field {
    std::string name; ///< by which a refusal calls it; or of what it is a part, after a bar
    std::function<void(Random&)> spoil;
};

/// All that a loop is made of.
struct Made {
    SceneDescription scene;
    LoopDescription loop;
    DeviceProperties device;
    std::vector<Field> fields;

    void number(const std::string& name, double& value) {
        fields.push_back({name, [&value](Random& random) { value = absurd(random); }});
    }
    void number(const std::string& name, std::optional<double>& value) {
        fields.push_back({name, [&value](Random& random) { value = absurd(random); }});
    }
    void vector(const std::string& name, Vec3& value) {
        fields.push_back(
            {name, [&value](Random& random) { value[pick(random, 3)] = absurd(random); }});
    }
    void integer(const std::string& name, int& value) {
        fields.push_back({name, [&value](Random& random) {
                              constexpr std::array numbers{0, -1, 1 << 30, -(1 << 30), 5000};
                              value = numbers[static_cast<std::size_t>(pick(random, 5))];
                          }});
    }
    void text(const std::string& name, std::string& value) {
        fields.push_back({name, [&value](Random& random) {
                              value = chance(random, 0.5) ? "nobody" : value + "e";
                          }});
    }
    template <class Enum>
    void choice(const std::string& name, Enum& value) {
        fields.push_back({name, [&value](Random& random) {
                              value = static_cast<Enum>(chance(random, 0.5) ? 77 : 120);
                          }});
    }
    void function(TransferFunction& f) {
        for (std::size_t i = 0; i < f.count; ++i) {
            number("strength_n", f.nodes[i].strength_n);
            if (f.count > 1) number("value", f.nodes[i].value);
        }
    }
};

class Maker {
public:
    Maker(std::uint64_t seed, const std::filesystem::path& mesh) : random_(seed), mesh_(mesh) {}

    std::unique_ptr<Made> make() {
        made_ = std::make_unique<Made>();
        make_limits();
        make_volumes();
        make_surfaces();
        // Effects are referred to: none is moved once its fields are known.
        made_->scene.effects.resize(static_cast<std::size_t>(pick(random_, 7)));
        for (EffectDescription& effect : made_->scene.effects)
            make_effect(effect);
        make_device();
        return std::move(made_);
    }
    Random& random() { return random_; }

private:
    void make_limits() {
        SceneDescription& scene = made_->scene;
        scene.coupling.stiffness_n_per_m = of_any_size(random_, 1e-2, 1e5);
        scene.coupling.damping_n_s_per_m = chance(random_, 0.5) ? 0.0 : between(random_, 0.0, 10.0);
        scene.limits.force_n = of_any_size(random_, 1e-3, 1e3);
        scene.limits.slew_n_per_s = of_any_size(random_, 1e-2, 1e7);
        LoopDescription& loop = scene.loop;
        loop.rate_hz = chance(random_, 0.5) ? 1000.0 : of_any_size(random_, 50.0, 20000.0);
        loop.budget_us = 0.9e6 / loop.rate_hz;
        loop.method = static_cast<SteppingMethod>(pick(random_, 4));
        loop.sub_steps = 1 + pick(random_, 64);
        loop.tolerance_um = of_any_size(random_, 1e-3, 10.0);
        loop.evaluation_cap = 1 + pick(random_, 32);
        made_->loop = loop;
        made_->number("stiffness_n_per_m", scene.coupling.stiffness_n_per_m);
        made_->number("damping_n_s_per_m", scene.coupling.damping_n_s_per_m);
        made_->number("force_n", scene.limits.force_n);
        made_->number("slew_n_per_s", scene.limits.slew_n_per_s);
        for (LoopDescription* of : {&scene.loop, &made_->loop}) {
            made_->number("rate_hz", of->rate_hz);
            made_->number("budget_us", of->budget_us);
            made_->choice("method", of->method);
            made_->integer("sub_steps", of->sub_steps);
            made_->number("tolerance_um", of->tolerance_um);
            made_->integer("evaluation_cap", of->evaluation_cap);
        }
    }

    void make_volumes() {
        constexpr std::array<const char*, 5> formulas{"solid_sphere", "sphere_cavity", "slab",
                                                      "wedge", "torus"};
        for (const char* name : {"a", "b"}) {
            VolumeDescription& volume = made_->scene.volumes[name];
            volume.analytic = formulas[static_cast<std::size_t>(pick(random_, 5))];
            if (volume.analytic == "slab") {
                volume.parameters["thickness_mm"] = between(random_, 1.0, 20.0);
            } else if (volume.analytic == "wedge") {
                volume.parameters["angle_deg"] = between(random_, 20.0, 170.0);
            } else {
                volume.parameters["radius_mm"] = between(random_, 10.0, 40.0);
                if (volume.analytic == "torus")
                    volume.parameters["tube_mm"] = between(random_, 2.0, 8.0);
            }
            made_->text("analytic", volume.analytic);
            for (auto& [key, value] : volume.parameters)
                made_->number(key.substr(0, key.find('_')), value);
        }
        VolumeDescription& stream = made_->scene.volumes["stream"];
        stream.analytic = "helix";
        stream.parameters = {{"radius_mm", 30.0}, {"pitch_mm", 20.0}};
        for (auto& [key, value] : stream.parameters)
            made_->number(key.substr(0, key.find('_')), value);
    }

    void make_surfaces() {
        for (const char* name : {"s", "t"}) {
            SurfaceDescription& surface = made_->scene.surfaces[name];
            if (chance(random_, 0.15)) {
                surface.mesh = mesh_;
            } else {
                surface.volume = chance(random_, 0.5) ? "a" : "b";
                surface.iso_value = between(random_, -2e-4, 2e-4);
            }
            if (chance(random_, 0.4)) surface.strength_n = of_any_size(random_, 1e-3, 100.0);
            if (chance(random_, 0.3)) surface.yielding = Yielding::opens;
            if (chance(random_, 0.3)) surface.leash_mm = 1.0;
            surface.moves = chance(random_, 0.3);
            made_->text("volume", surface.volume);
            made_->text("material", surface.material);
            made_->number("iso_value", surface.iso_value);
            made_->number("smooth_voxels", surface.smooth_voxels);
            made_->number("strength_n", surface.strength_n);
            made_->choice("yielding", surface.yielding);
            made_->number("leash_mm", surface.leash_mm);
            made_->number("facet_size_mm", surface.facet_size_mm);
        }
    }

    TransferFunction strength(double most, bool may_be_hard) {
        if (may_be_hard && chance(random_, 0.3))
            return TransferFunction::constant(std::numeric_limits<double>::infinity());
        if (chance(random_, 0.5)) return TransferFunction::constant(between(random_, 0.0, most));
        TransferFunction f;
        f.count = 3;
        for (std::size_t i = 0; i < f.count; ++i)
            f.nodes[i] = {-0.01 + 0.01 * static_cast<double>(i), between(random_, 0.0, most)};
        return f;
    }

    /// A surface of a volume, which all that is of a surface goes with.
    std::string surface_of_volume() {
        for (const auto& [name, surface] : made_->scene.surfaces)
            if (!surface.volume.empty()) return name;
        return "";
    }

    /// Settings of one of all kinds, as they are by default.
    template <std::size_t... Kinds>
    static EffectSettings of_kind(std::size_t kind, std::index_sequence<Kinds...>) {
        EffectSettings settings;
        ((Kinds == kind ? static_cast<void>(settings.emplace<Kinds>()) : void()), ...);
        return settings;
    }

    void make_effect(EffectDescription& effect) {
        constexpr std::size_t kKinds = std::variant_size_v<EffectSettings>;
        effect.settings = of_kind(static_cast<std::size_t>(pick(random_, int{kKinds})),
                                  std::make_index_sequence<kKinds>());
        if (std::holds_alternative<effects::Texture>(effect.settings) &&
            surface_of_volume().empty())
            effect.settings = effects::Surface{};
        surface_ = chance(random_, 0.5) ? "s" : "t";
        std::visit([&](auto& settings) { fill(settings); }, effect.settings);
        if (!can_move(effect) || !chance(random_, 0.5)) return;
        for (const auto& [name, surface] : made_->scene.surfaces)
            if (surface.moves) effect.moves_with = name;
        made_->text("moves_with", effect.moves_with);
    }

    void fill(effects::Surface& effect) { on_surface(effect); }
    void fill(effects::Friction& effect) { rub(effect); }
    void fill(effects::StickSlip& effect) { rub(effect); }
    void fill(effects::Magnet& effect) {
        effect.strength_n = between(random_, 0.0, 3.0);
        effect.capture_m = of_any_size(random_, 1e-6, 1e-2);
        on_surface(effect);
        made_->number("strength_n", effect.strength_n);
        made_->number("capture_m", effect.capture_m);
    }
    void fill(effects::Texture& effect) {
        effect.surface = surface_of_volume();
        effect.height_m = between(random_, 0.0, 1e-4);
        effect.wavelength_m = between(random_, 1e-3, 5e-3);
        effect.pattern = static_cast<TexturePattern>(pick(random_, 2));
        made_->number("height", effect.height_m);
        made_->number("wavelength_m", effect.wavelength_m);
        made_->vector("direction", effect.direction);
    }
    void fill(effects::ConstantForce& effect) {
        effect.force_n = any_vector(random_, 3.0);
        for (int axis = 0; axis < 3; ++axis)
            made_->number("force_n", effect.force_n[axis]);
    }
    void fill(effects::Viscosity& effect) {
        effect.strength = TransferFunction::constant(between(random_, 0.0, 20.0));
        made_->function(effect.strength);
    }
    void fill(effects::GradientSurface& effect) { over(effect, scalars(), true); }
    void fill(effects::GradientForce& effect) { over(effect, scalars(), false); }
    void fill(effects::VectorForce& effect) { over(effect, "stream", false); }
    void fill(effects::FrontShape& effect) { over(effect, "stream", true); }
    void fill(effects::Vortex& effect) { over(effect, "stream", true); }
    void fill(effects::VectorFollow& effect) { follow(effect); }
    void fill(effects::FibreFollow& effect) { follow(effect); }
    void fill(effects::Guide& effect) {
        for (int i = 0; i < 1 + pick(random_, 3); ++i)
            effect.points_m.push_back(any_vector(random_, 0.05));
        for (Vec3& point : effect.points_m)
            made_->vector("points_m", point);
        hold(effect);
        if (chance(random_, 0.5)) effect.capture_m = of_any_size(random_, 1e-4, 0.1);
        made_->number("capture_m", effect.capture_m);
        made_->choice("ends", effect.ends);
    }
    void fill(effects::Workspace& effect) {
        hold(effect);
        if (chance(random_, 0.5)) {
            effect.radius_m = between(random_, 0.02, 0.2);
            made_->number("radius_m", effect.radius_m);
            made_->vector("center_m|workspace", effect.center_m);
        } else {
            effect.box_m = {Vec3{-0.05}, Vec3{0.05}};
            made_->vector("box_m|workspace", effect.box_m.lower);
            made_->vector("box_m|workspace", effect.box_m.upper);
        }
    }
    void fill(effects::Vibration& effect) {
        effect.frequency_hz = 20.0;
        made_->number("amplitude_n_s_per_m", effect.amplitude_n_s_per_m);
        made_->number("frequency_hz", effect.frequency_hz);
        made_->number("decay_s", effect.decay_s);
        made_->number("most_n", effect.most_n);
    }
    void fill(effects::GravityCompensation& effect) {
        effect.mass_kg = between(random_, 0.0, 0.3);
        effect.down = any_vector(random_, 1.0);
        made_->number("mass_kg", effect.mass_kg);
        made_->vector("down", effect.down);
    }

    std::string scalars() { return chance(random_, 0.5) ? "a" : "b"; }

    template <class Kind>
    void on_surface(Kind& effect) {
        effect.surface = surface_;
        made_->text("surface", effect.surface);
    }
    template <class Kind>
    void rub(Kind& effect) {
        effect.static_mu = between(random_, 0.0, 2.0);
        effect.dynamic_mu = between(random_, 0.0, 1.0) * effect.static_mu;
        on_surface(effect);
        made_->number("static_mu", effect.static_mu);
        made_->number("dynamic_mu", effect.dynamic_mu);
    }
    template <class Kind>
    void over(Kind& effect, const std::string& volume, bool may_be_hard) {
        effect.volume = volume;
        effect.strength = strength(2.0, may_be_hard);
        made_->text("volume", effect.volume);
        made_->function(effect.strength);
    }
    template <class Kind>
    void follow(Kind& effect) {
        over(effect, "stream", true);
        effect.guide = static_cast<FollowGuide>(pick(random_, 3));
    }
    template <class Kind>
    void hold(Kind& effect) {
        effect.strength_n = chance(random_, 0.3) ? std::numeric_limits<double>::infinity()
                                                 : between(random_, 0.0, 10.0);
        made_->number("strength_n", effect.strength_n);
    }

    void make_device() {
        DeviceProperties& device = made_->device;
        if (chance(random_, 0.3)) return; // takes no force
        device.force_n = of_any_size(random_, 1e-2, 100.0);
        if (chance(random_, 0.5)) device.stiffness_n_per_m = of_any_size(random_, 1.0, 1e5);
        device.damping_n_s_per_m = chance(random_, 0.5) ? 0.0 : of_any_size(random_, 1e-3, 10.0);
        device.delay_s = chance(random_, 0.5) ? 0.0 : of_any_size(random_, 1e-5, 0.1);
        device.position_step_m = chance(random_, 0.5) ? 0.0 : 30e-6;
        if (chance(random_, 0.5)) device.velocity_source = VelocitySource::device;
        made_->number("force_n", device.force_n);
        made_->number("stiffness", device.stiffness_n_per_m);
        made_->number("damping", device.damping_n_s_per_m);
        made_->number("delay_s", device.delay_s);
        made_->number("position_step_m", device.position_step_m);
        made_->choice("velocity_source", device.velocity_source);
    }

    Random random_;
    const std::filesystem::path& mesh_;
    std::string surface_; // of the effect that is being made
    std::unique_ptr<Made> made_;
};

} // namespace palpate::test
