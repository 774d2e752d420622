// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/curve_guide.h>
#include <palpate/haptics/effects/gradient_force.h>
#include <palpate/haptics/effects/gradient_surface.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/haptics/effects/vector_force.h>
#include <palpate/haptics/effects/vector_sheet.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/haptics/effects/workspace.h>
#include <palpate/haptics/stepping/subdivision.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_vector_field.h>

/// Random scenes in code, of any mix of effects: what a held probe must come to rest in.
namespace palpate::test {

struct HeldScene {
    SteppingSettings stepping;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    std::vector<SurfaceFinish> finish;
    std::vector<std::unique_ptr<Effect>> effects;
    std::vector<Vec3> way; ///< of the probe; it is held at the last place
    double stiffness = 500.0;
    double period_s = 1e-3;
    std::string words; ///< what is in it
};

/// The draw of one scene: the same seed, the same scene.
class HeldSceneDraw {
public:
    explicit HeldSceneDraw(std::uint64_t seed) : random_(seed) {}

    HeldScene scene(SteppingMethod method = SteppingMethod::adaptive) {
        HeldScene s;
        s.stepping.method = method;
        s.stepping.evaluation_cap = chance(0.6) ? 8 : 4 + static_cast<int>(46 * one());
        if (chance(0.3)) s.stepping.tolerance_m = log_between(1e-8, 1e-5);
        s.stepping.sub_steps = 1 + static_cast<int>(12 * one());
        if (chance(0.3)) s.period_s = 0.25e-3;
        if (chance(0.4)) s.stiffness = log_between(200.0, 2000.0);
        const int surfaces = chance(0.35) ? 0 : chance(0.6) ? 1 : 2;
        for (int i = 0; i < surfaces; ++i)
            add_surface(s);
        const int effects = surfaces > 0 && chance(0.15) ? 0 : 1 + static_cast<int>(4 * one());
        for (int i = 0; i < effects; ++i)
            add_effect(s, static_cast<int>(12 * one()));
        if (chance(0.25)) add_workspace(s);
        Vec3 probe = 0.016 * within_ball();
        const int moves = static_cast<int>(40 * one());
        const Vec3 step = 0.4e-3 * within_ball();
        s.way.push_back(probe);
        for (int i = 0; i < moves; ++i)
            s.way.push_back(probe += step + 0.1e-3 * within_ball());
        return s;
    }

private:
    double one() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
    bool chance(double p) { return one() < p; }
    double between(double low, double high) { return low + (high - low) * one(); }
    double log_between(double low, double high) {
        return std::exp(between(std::log(low), std::log(high)));
    }
    Vec3 within_ball() {
        for (;;) {
            const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
            if (x * x + y * y + z * z <= 1.0) return {x, y, z};
        }
    }
    double strength() {
        return chance(0.12) ? std::numeric_limits<double>::infinity() : log_between(0.1, 20.0);
    }
    double finite_strength() { return log_between(0.05, 5.0); }

    std::shared_ptr<const ScalarField> field(std::string& words) {
        switch (static_cast<int>(6 * one())) {
        case 0:
            words += "cavity";
            return make_sphere_cavity(between(8e-3, 16e-3));
        case 1:
            words += "ball";
            return make_solid_sphere(between(8e-3, 16e-3));
        case 2:
            words += "slab";
            return make_slab(between(2e-3, 12e-3));
        case 3: {
            const double angle = chance(0.5) ? between(20, 160) : between(200, 340);
            words += "wedge" + std::to_string(static_cast<int>(angle));
            return make_wedge(angle);
        }
        case 4: {
            const double radius = between(8e-3, 14e-3);
            words += "torus";
            return make_torus(radius, between(0.2, 0.6) * radius);
        }
        default:
            words += "bumpy";
            return make_bumpy_cavity(between(9e-3, 15e-3), between(0.2e-3, 1e-3),
                                     between(8e-3, 20e-3));
        }
    }

    void add_surface(HeldScene& s) {
        LevelSettings level;
        const auto of = field(s.words);
        if (chance(0.35)) level.strength_n = log_between(0.2, 5.0);
        if (chance(0.2)) level.yielding = Yielding::opens;
        SurfaceFinish finish;
        if (chance(0.35)) {
            finish.friction.static_mu = log_between(0.05, 3.0);
            finish.friction.dynamic_mu = between(0.3, 1.0) * finish.friction.static_mu;
            finish.friction.stick_slip = chance(0.3);
            s.words += "+friction";
        }
        if (chance(0.25)) {
            finish.magnet.strength_n = finite_strength();
            finish.magnet.capture_m = between(0.5e-3, 5e-3);
            s.words += "+magnet";
        }
        TextureSettings texture;
        if (chance(0.12)) {
            texture.wavelength_m = between(2e-3, 5e-3);
            texture.height_m = between(0.05, 0.5) * texture.wavelength_m / (2 * std::numbers::pi);
            s.words += "+texture";
        }
        s.words += level.strength_n < 1e9 ? "(yields) " : " ";
        s.surfaces.push_back(std::make_unique<VolumeContact>(of, level, texture));
        s.finish.push_back(finish);
    }

    std::shared_ptr<const VectorField> helix() {
        return make_helix(between(6e-3, 25e-3), between(5e-3, 40e-3));
    }
    /// Fibres on a grid of 2 mm: smooth, or of no order at all.
    std::shared_ptr<const VectorField> fibres(VectorSense sense) {
        VectorVolume volume;
        constexpr int kSize = 20;
        constexpr double kSpacing = 2e-3;
        volume.size = {kSize, kSize, kSize};
        volume.index_to_scene = {Mat3(kSpacing), Vec3(-0.5 * kSpacing * (kSize - 1))};
        const double noise = chance(0.5) ? between(0.0, 0.3) : between(0.5, 2.0);
        const Vec3 mean = within_ball();
        for (int i = 0; i < kSize * kSize * kSize; ++i) {
            const Vec3 v = mean + noise * within_ball();
            for (int axis = 0; axis < 3; ++axis)
                volume.values.push_back(static_cast<float>(v[axis]));
        }
        return std::make_shared<GridVectorField>(volume, sense);
    }

    void add_effect(HeldScene& s, int kind) {
        const auto felt = [](double n) { return TransferFunction::constant(n); };
        const auto guide = [&] {
            return chance(0.5)   ? FollowGuide::streamline
                   : chance(0.7) ? FollowGuide::midpoint
                                 : FollowGuide::tangent;
        };
        switch (kind) {
        case 0:
            s.words += "constant_force ";
            s.effects.push_back(
                std::make_unique<ConstantForce>(log_between(0.1, 20.0) * within_ball()));
            return;
        case 1:
            s.words += "viscosity ";
            s.effects.push_back(std::make_unique<Viscosity>(log_between(0.05, 5.0)));
            return;
        case 2: {
            s.words += "gradient_force:";
            auto of = field(s.words);
            TransferFunction f;
            f.nodes[0] = {-2e-3, 0.0};
            f.nodes[1] = {between(-1e-3, 3e-3), finite_strength()};
            f.count = 2;
            s.words += " ";
            s.effects.push_back(std::make_unique<GradientForce>(std::move(of), f));
            return;
        }
        case 3: {
            s.words += "gradient_surface:";
            auto of = field(s.words);
            s.words += " ";
            s.effects.push_back(
                std::make_unique<GradientSurface>(std::move(of), felt(finite_strength())));
            return;
        }
        case 4:
            s.words += "vector_force ";
            s.effects.push_back(std::make_unique<VectorForce>(
                chance(0.5) ? helix() : fibres(VectorSense::directed), felt(finite_strength())));
            return;
        case 5:
        case 6: {
            const double n = strength();
            s.words += "vector_follow ";
            s.effects.push_back(std::make_unique<VectorFollow>(helix(), felt(n), guide()));
            return;
        }
        case 7: {
            const double n = strength();
            s.words += "fibre_follow ";
            s.effects.push_back(
                std::make_unique<VectorFollow>(fibres(VectorSense::axial), felt(n), guide()));
            return;
        }
        case 8: {
            const bool front = chance(0.5);
            const double n = strength();
            s.words += front ? "front_shape " : "vortex ";
            s.effects.push_back(std::make_unique<VectorSheet>(
                chance(0.7) ? helix() : fibres(VectorSense::directed), felt(n),
                front ? SheetKind::front : SheetKind::vortex));
            return;
        }
        case 9: {
            std::vector<Vec3> points;
            const int count = 2 + static_cast<int>(4 * one());
            for (int i = 0; i < count; ++i)
                points.push_back(0.02 * within_ball());
            const PolylineEnds ends = count > 2 && chance(0.3) ? PolylineEnds::closed
                                      : chance(0.4)            ? PolylineEnds::endless
                                                               : PolylineEnds::open;
            s.words += "guide" + std::to_string(count) + " ";
            s.effects.push_back(
                std::make_unique<CurveGuide>(Polyline(points, ends), guide_settings()));
            return;
        }
        case 10:
            s.words += "point ";
            s.effects.push_back(
                std::make_unique<PointGuide>(0.015 * within_ball(), guide_settings()));
            return;
        default:
            add_workspace(s);
        }
    }

    GuideSettings guide_settings() {
        GuideSettings settings;
        settings.strength_n = strength();
        if (chance(0.3)) settings.capture_m = between(2e-3, 20e-3);
        return settings;
    }

    void add_workspace(HeldScene& s) {
        const double n = strength();
        const Vec3 center = 8e-3 * within_ball();
        if (chance(0.5)) {
            s.words += "ball_workspace ";
            s.effects.push_back(std::make_unique<WorkspaceSphere>(center, between(3e-3, 15e-3), n));
            return;
        }
        s.words += "box_workspace ";
        const Vec3 half{between(2e-3, 15e-3), between(2e-3, 15e-3), between(2e-3, 15e-3)};
        s.effects.push_back(std::make_unique<WorkspaceBox>(Box{center - half, center + half}, n));
    }

    std::mt19937_64 random_;
};

/// How a held probe's proxy went on.
struct HeldEnd {
    int last_moved = 0;                 ///< the last held frame that changed a bit, counted from 1
    double last_way_m = 0.0;            ///< the longest way of a frame among the last quarter
    double last_turn_n = 0.0;           ///< and how much its force changed at most
    std::uint32_t flags = 0;            ///< of the last quarter's frames
    double mean_evaluations = 0.0;      ///< of the last quarter's frames
    std::uint32_t most_evaluations = 0; ///< of all frames
    std::uint32_t most_work = 0;        ///< of all frames
    std::uint32_t moved_without_flag = 0; ///< frames of the last quarter
};

inline HeldEnd hold(HeldScene& s, int frames, Clock& clock) {
    std::vector<SurfaceContact*> surfaces;
    for (auto& surface : s.surfaces)
        surfaces.push_back(surface.get());
    std::vector<Effect*> effects;
    for (auto& effect : s.effects)
        effects.push_back(effect.get());
    Subdivision loop(s.stepping, surfaces, effects, clock, s.finish);
    Vec3 proxy = s.way.front();
    loop.restart(proxy);
    HeldEnd end;
    const auto move = [&](const Vec3& probe) {
        FrameContext frame{probe, proxy, s.stiffness, s.period_s};
        const SubdivisionResult result = loop.advance(frame);
        proxy = result.proxy;
        end.most_evaluations = std::max(end.most_evaluations, result.evaluations);
        end.most_work = std::max(end.most_work, result.work);
        return result;
    };
    for (const Vec3& probe : s.way)
        move(probe);
    int last = 0;
    for (int i = 1; i <= frames; ++i) {
        const Vec3 before = proxy;
        const SubdivisionResult result = move(s.way.back());
        const double way_m = glm::length(proxy - before);
        if (!(proxy == before)) end.last_moved = i;
        if (4 * i <= 3 * frames) continue;
        ++last;
        end.last_way_m = std::max(end.last_way_m, way_m);
        end.last_turn_n = s.stiffness * end.last_way_m;
        end.flags |= result.flags;
        end.mean_evaluations += result.evaluations;
        if (!(proxy == before) && result.flags == 0) ++end.moved_without_flag;
    }
    end.mean_evaluations /= last;
    return end;
}

} // namespace palpate::test
