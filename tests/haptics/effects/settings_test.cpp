// SPDX-License-Identifier: Apache-2.0
// Everything below the loop that takes settings refuses those that are no numbers, or out of range,
// and says which.
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/study/baselines.h>
#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/contact_vibration.h>
#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/effects/curve_guide.h>
#include <palpate/haptics/effects/gradient_force.h>
#include <palpate/haptics/effects/gradient_surface.h>
#include <palpate/haptics/effects/gravity_compensation.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/haptics/effects/vector_force.h>
#include <palpate/haptics/effects/vector_sheet.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/haptics/effects/workspace.h>
#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/hand/velocity_estimator.h>
#include <palpate/haptics/hand/virtual_coupling.h>
#include <palpate/haptics/stepping/subdivision.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// What making something complains of; empty where it does not.
std::string complaint(const std::function<void()>& make) {
    try {
        make();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

/// Something that is made with a number.
struct Case {
    std::string field; ///< that the message names
    std::function<void(double)> make;
    double good;
    bool may_be_zero = false;
    bool may_be_infinite = false;
};

std::shared_ptr<const ScalarField> ball() { return make_solid_sphere(0.02); }
std::shared_ptr<const VectorField> helix() { return make_helix(0.03, 0.03); }

template <class Settings, class Thing>
Case of(const std::string& field, double Settings::*member, Thing make) {
    return {field,
            [=](double value) {
                Settings settings;
                settings.*member = value;
                make(settings);
            },
            Settings{}.*member};
}

std::vector<Case> cases() {
    const auto constant = TransferFunction::constant;
    const auto chain = [](const SafetySettings& s) { SafetyChain made(s); };
    const auto passivity = [](const PassivitySettings& s) { PassivityControl made(s); };
    const auto vibration = [](const ContactVibrationSettings& s) { ContactVibration made(s); };
    const auto velocity = [](const VelocitySettings& s) { VelocityEstimator made(s); };
    const auto level = [](const LevelSettings& s) { VolumeContact made(ball(), s); };
    const auto stepping = [](const SteppingSettings& s) {
        test::ScriptedClock clock;
        Subdivision made(s, {}, {}, clock);
    };
    const auto texture = [](const TextureSettings& s) { SurfaceTexture made(s, 0.01); };
    std::vector<Case> cases{
        of("force_n", &SafetySettings::force_n, chain),
        of("slew_n_per_s", &SafetySettings::slew_n_per_s, chain),
        of("period_s", &SafetySettings::period_s, chain),
        of("small_force_n", &SafetySettings::small_force_n, chain),
        of("calm_s", &SafetySettings::calm_s, chain),
        of("ramp_s", &SafetySettings::ramp_s, chain),
        of("soften_s", &SafetySettings::soften_s, chain),
        of("stiffen_s", &SafetySettings::stiffen_s, chain),
        of("fade_s", &SafetySettings::fade_s, chain),
        of("fastest_m_per_s", &SafetySettings::fastest_m_per_s, chain),
        of("unasked_w", &SafetySettings::unasked_w, chain),
        of("period_s", &PassivitySettings::period_s, passivity),
        of("force_n", &PassivitySettings::force_n, passivity),
        of("stiffness_n_per_m", &PassivitySettings::stiffness_n_per_m, passivity),
        of("damping_n_s_per_m", &PassivitySettings::damping_n_s_per_m, passivity),
        of("delay_s", &PassivitySettings::delay_s, passivity),
        of("bank_j", &PassivitySettings::bank_j, passivity),
        of("reserve_j", &PassivitySettings::reserve_j, passivity),
        of("active_w", &PassivitySettings::active_w, passivity),
        of("amplitude_n_s_per_m", &ContactVibrationSettings::amplitude_n_s_per_m, vibration),
        of("frequency_hz", &ContactVibrationSettings::frequency_hz, vibration),
        of("decay_s", &ContactVibrationSettings::decay_s, vibration),
        of("most_n", &ContactVibrationSettings::most_n, vibration),
        of("step_m", &VelocitySettings::step_m, velocity),
        of("longest_s", &VelocitySettings::longest_s, velocity),
        of("period_s", &VelocitySettings::period_s, velocity),
        of("strength_n", &LevelSettings::strength_n, level),
        of("certificate_m", &LevelSettings::certificate_m, level),
        of("free_m", &LevelSettings::free_m, level),
        of("budget_us", &SteppingSettings::budget_us, stepping),
        of("tolerance_m", &SteppingSettings::tolerance_m, stepping),
        of("height_m", &TextureSettings::height_m, texture),
        {"wavelength_m",
         [](double x) {
             TextureSettings settings;
             settings.height_m = 1e-4;
             settings.wavelength_m = x;
             SurfaceTexture t(settings, 0.01);
         },
         2e-3},
        {"stiffness", [](double x) { VirtualCoupling coupling(x, 0.0); }, 500.0},
        {"damping", [](double x) { VirtualCoupling coupling(500.0, x); }, 0.0},
        {"damping", [](double x) { Viscosity effect(x); }, 1.0},
        {"mass_kg",
         [](double x) {
             GravityCompensation effect(x, {0, 0, -1});
         },
         0.1},
        {"radius_m", [](double x) { WorkspaceSphere effect(Vec3{0.0}, x, 1.0); }, 0.1},
        {"strength", [](double x) { WorkspaceSphere effect(Vec3{0.0}, 0.1, x); }, 1.0},
        {"strength",
         [](double x) {
             WorkspaceBox effect({Vec3{0.0}, Vec3{0.1}}, x);
         },
         1.0},
        {"strength_n", [](double x) { PointGuide effect(Vec3{0.0}, {x}); }, 1.0},
        {"capture_m",
         [](double x) {
             PointGuide effect(Vec3{0.0}, {1.0, x});
         },
         0.1},
        {"strength_n",
         [](double x) {
             CurveGuide effect(make_line(Vec3{0.0}, {1, 0, 0}), {x});
         },
         1.0},
        {"strength", [=](double x) { GradientForce effect(ball(), constant(x)); }, 1.0},
        {"strength", [=](double x) { GradientSurface effect(ball(), constant(x)); }, 1.0},
        {"strength", [=](double x) { Viscosity effect(ball(), constant(x)); }, 1.0},
        {"strength", [=](double x) { VectorForce effect(helix(), constant(x)); }, 1.0},
        {"strength", [=](double x) { VectorFollow effect(helix(), constant(x)); }, 1.0},
        {"strength", [=](double x) { VectorSheet effect(helix(), constant(x), SheetKind::front); },
         1.0},
        {"static_mu",
         [](double x) {
             CoulombFriction friction({{x, 0.0}});
         },
         0.3},
        {"dynamic_mu",
         [](double x) {
             CoulombFriction friction({{0.3, x}});
         },
         0.2},
        {"strength_n", [](double x) { LoopMagnet magnet({x}); }, 1.0},
        {"capture_m",
         [](double x) {
             LoopMagnet magnet({1.0, x});
         },
         1e-3},
        {"radius_m", [](double x) { make_baseline(BaselineKind::virtual_proxy, ball(), 0.0, x); },
         1e-3},
    };
    for (Case& c : cases) {
        // A guide, a level and their like may hold without end.
        c.may_be_infinite = complaint([&] { c.make(kInfinite); }).empty();
        c.may_be_zero = complaint([&] { c.make(0.0); }).empty();
    }
    return cases;
}

TEST(Settings, ThatAreNoNumbersAreRefusedByName) {
    for (const Case& c : cases()) {
        EXPECT_EQ(complaint([&] { c.make(c.good); }), "") << c.field;
        for (const double bad : {kNan, -1.0, -1e-300, -kInfinite}) {
            const std::string message = complaint([&] { c.make(bad); });
            EXPECT_NE(message.find(c.field), std::string::npos) << bad << ": " << message;
            EXPECT_NE(message.find("; give "), std::string::npos) << bad << ": " << message;
        }
    }
}

// What may be infinite or 0 is what means something then: never yields, none.
TEST(Settings, ThatAreInfiniteAreTakenWhereSomethingHolds) {
    std::size_t infinite = 0;
    for (const Case& c : cases())
        if (c.may_be_infinite) {
            ++infinite;
            EXPECT_TRUE(c.field.starts_with("strength") || c.field == "capture_m") << c.field;
        }
    // Level, both workspaces, both guides, their capture, three modes of volumes.
    EXPECT_EQ(infinite, 9u);
}

TEST(Settings, OfFunctionsIncrease) {
    const auto make = [](const TransferFunction& f) {
        return complaint([&] { GradientForce effect(ball(), f); });
    };
    TransferFunction f;
    EXPECT_NE(make(f).find("count = 0"), std::string::npos);
    f.count = 33;
    EXPECT_NE(make(f).find("count = 33"), std::string::npos);
    f.count = 2;
    f.nodes[1] = {1.0, 2.0};
    EXPECT_EQ(make(f), "");
    f.nodes[1].value = 0.0;
    EXPECT_NE(make(f).find("nodes[1].value = 0 is not above the value before it, 0"),
              std::string::npos)
        << make(f);
    f.nodes[1] = {1.0, kInfinite};
    EXPECT_NE(make(f).find("nodes[1].strength_n = inf is out of range; give a number in [0, inf)"),
              std::string::npos)
        << make(f);
    EXPECT_NE(complaint([&] { GradientSurface effect(ball(), f); }).find("nodes[1].strength_n"),
              std::string::npos)
        << "infinite as a single node alone";
    f.nodes[1] = {kNan, 1.0};
    EXPECT_NE(make(f).find("nodes[1].value = nan is not a number"), std::string::npos) << make(f);
}

TEST(Settings, PlacesAndDirectionsAreFinite) {
    const GuideSettings guide;
    for (const Vec3& bad : {Vec3{kNan, 0, 0}, Vec3{0, kInfinite, 0}}) {
        EXPECT_NE(complaint([&] { ConstantForce effect(bad); }), "");
        EXPECT_NE(complaint([&] { PointGuide effect(bad, guide); }), "");
        EXPECT_NE(complaint([&] { WorkspaceSphere effect(bad, 1.0, 1.0); }), "");
        EXPECT_NE(complaint([&] { WorkspaceBox effect({Vec3{0.0}, bad}, 1.0); }), "");
        EXPECT_NE(complaint([&] { GravityCompensation effect(1.0, bad); }), "");
    }
    EXPECT_NE(complaint([] { GravityCompensation effect(1.0, Vec3{0.0}); }), "");
    EXPECT_NE(complaint([] { WorkspaceBox effect({Vec3{1.0}, Vec3{0.0}}, 1.0); }), "");
}

TEST(Settings, PartsThatAreMissingAreNamed) {
    const auto one = TransferFunction::constant(1.0);
    EXPECT_EQ(complaint([&] { GradientForce effect(nullptr, one); }),
              "gradient_force: field is missing; give one");
    for (const auto& make : std::vector<std::function<void()>>{
             [&] { GradientSurface effect(nullptr, one); },
             [&] { Viscosity effect(nullptr, one); },
             [&] { VectorForce effect(nullptr, one); },
             [&] { VectorFollow effect(nullptr, one); },
             [&] { VectorSheet effect(nullptr, one, SheetKind::vortex); },
             [&] { VolumeContact contact(nullptr, {}); },
             [&] { MeshContact contact(nullptr, {}); },
             [&] { GuardedContact contact(ball(), {}, nullptr, 1e-3); },
             [&] { DirectContact contact(nullptr, ball(), {}); },
             [&] { make_baseline(BaselineKind::penalty, nullptr, 0.0); },
         })
        EXPECT_NE(complaint(make).find("is missing; give one"), std::string::npos)
            << complaint(make);
}

TEST(Settings, OfAChainAreMeasuredAgainstItsPeriod) {
    SafetySettings settings;
    settings.soften_s = settings.period_s;
    EXPECT_EQ(complaint([&] { SafetyChain chain(settings); }),
              "safety: soften_s = 0.001 is out of range; give a number in (0.001, inf)");
}

// What an effect adds that is no number counts as nothing, keeps its number, and is remembered.
TEST(PrimitivesThatAreNoNumbers, CountAsNothing) {
    PrimitiveSet set;
    set.add({{0, 0, 0}, {0, 0, 1}, 1.0});
    EXPECT_TRUE(set.all_finite());
    set.add({{kNan, 0, 0}, {0, 0, 1}, 1.0});
    EXPECT_FALSE(set.all_finite());
    set.add({{0, 0, 0}, {0, 0, 1}, kInfinite});
    set.add_line({{0, 0, 0}, {1, 0, 0}, kNan});
    set.add_point({{0, -kInfinite, 0}, 1.0});
    set.add_force({0, kNan, 0});
    set.add_force({1e-3, 0, 0});
    set.add_spring({0, 0, 0}, kNan);
    set.add_spring({kInfinite, 0, 0}, 1.0);
    ASSERT_EQ(set.planes().size(), 3u);
    EXPECT_EQ(set.planes()[1].strength_n, 0.0);
    EXPECT_EQ(set.planes()[2].strength_n, kInfinite);
    EXPECT_EQ(set.lines()[0].strength_n, 0.0);
    EXPECT_EQ(set.points()[0].strength_n, 0.0);
    EXPECT_EQ(set.force(), Vec3(1e-3, 0, 0));
    EXPECT_EQ(set.total_stiffness(500.0), 500.0);
    set.clear();
    EXPECT_TRUE(set.all_finite());
}

} // namespace
} // namespace palpate
