// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/volume_contact.h>

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_field.h>

#include "tests/support/contact_loop.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::one_surface;

constexpr double kRadius = 0.05;       // m
constexpr double kCertificate = 25e-6; // m, default of LevelSettings

/// Deepest value over all chords of the last frame, m above the level 0 of a field.
double deepest(const ScalarField& field, std::span<const Vec3> path) {
    const auto sampler = field.make_sampler();
    double deep = -1.0;
    for (std::size_t i = 1; i < path.size(); ++i)
        for (int k = 0; k <= 50; ++k)
            deep =
                std::max(deep, sampler->value(path[i - 1] + (k / 50.0) * (path[i] - path[i - 1])));
    return deep;
}

Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(Vec3{normal(random), normal(random), normal(random)});
}

// The promise of the certificate: however fast the hand is, no chord gets deeper than tau. 1e-12 m
// is rounding of the value.
TEST(VolumeContact, NoChordIsDeeperThanTheCertificateAtAnySpeed) {
    const std::pair<const char*, std::shared_ptr<const ScalarField>> bodies[] = {
        {"cavity", make_sphere_cavity(kRadius)},
        {"ball", make_solid_sphere(kRadius)},
        {"bumpy", make_bumpy_cavity(kRadius, 1e-3, 15e-3)},
        {"plate", make_slab(1e-3)},
        {"wedge", make_wedge(40.0)},
        {"notch", make_wedge(300.0)},
        {"ring", make_torus(0.03, 0.01)}};
    for (const auto& [name, field] : bodies) {
        SCOPED_TRACE(testing::Message() << name << ", seed 3");
        std::mt19937_64 random(3);
        std::uniform_real_distribution<double> share;
        for (SteppingMethod method :
             {SteppingMethod::adaptive, SteppingMethod::fixed, SteppingMethod::single}) {
            SteppingSettings settings;
            settings.method = method;
            auto surfaces = one_surface(field);
            const double tau = static_cast<const VolumeContact&>(*surfaces[0]).scale().certificate;
            ContactLoop loop(settings, std::move(surfaces));
            Vec3 start{0, 0, 0};
            const auto sampler = field->make_sampler();
            while (sampler->value(start) > -1e-3)
                start = 0.06 * share(random) * random_direction(random);
            loop.start(start);
            Vec3 probe = start;
            for (int frame = 0; frame < 1500; ++frame) {
                // 0.2 to 140 mm per frame, around the body: 0.2 to 140 m/s at 1 kHz.
                probe += 0.2e-3 * std::pow(2000.0, share(random)) * random_direction(random);
                if (glm::length(probe) > 0.07) probe *= 0.07 / glm::length(probe);
                loop.move(probe);
                ASSERT_LE(deepest(*field, loop.subdivision().path()), tau + 1e-12)
                    << "frame " << frame;
            }
        }
    }
}

// Negative control: the same fuzz with the carrying switched off must go deeper, or the test above
// would prove nothing.
class Uncarried final : public SurfaceContact {
public:
    explicit Uncarried(std::shared_ptr<const ScalarField> field) : contact_(std::move(field), {}) {}
    bool restart(const Vec3& p) noexcept override { return contact_.restart(p); }
    void set_gain(const Gain& gain) noexcept override { contact_.set_gain(gain); }
    void offer(const Vec3& p, ContactSet& set, NearestPlane* nearest) noexcept override {
        contact_.offer(p, set, nearest);
    }
    void keep_active(const ProxySolution& s, std::size_t first) noexcept override {
        contact_.keep_active(s, first);
    }
    Chord carry(const Vec3&, const Vec3&) noexcept override { return {}; }
    double trust_m() const noexcept override { return contact_.trust_m(); }
    void commit(const Vec3& p, bool y, bool f) noexcept override { contact_.commit(p, y, f); }
    SurfaceState state() const noexcept override { return contact_.state(); }
    QueryCount queries() const noexcept override { return contact_.queries(); }
    std::any save_state() const override { return contact_.save_state(); }
    void restore_state(const std::any& state) override { contact_.restore_state(state); }

private:
    VolumeContact contact_;
};

// 25 um are several voxels of a micro-CT: no value was so far above the level, and no chord ended.
TEST(VolumeContact, TheCertificateIsReachedAlsoBetweenFineVoxels) {
    for (const double voxel_m : {1e-3, 0.2e-3, 25e-6, 10e-6, 1e-6}) {
        const AffineTransform frame{Mat3(voxel_m), Vec3(-9.5 * voxel_m)};
        const GridField field(
            test::sampled({20, 20, 20}, frame,
                          [&](const Vec3& p) { // an edge that was smoothed over a voxel
                              return std::erfc((glm::length(p) / voxel_m - 6.0) / 1.4) / 2.0;
                          }),
            0.0F);
        LevelSettings settings;
        settings.level = 0.5;
        const LevelScale scale = LevelScale::of(field, settings);
        EXPECT_LT(settings.level + scale.certificate, 0.9) << voxel_m;
        const double certificate_m = std::min(kCertificate, voxel_m / 8.0);
        EXPECT_DOUBLE_EQ(scale.certificate, certificate_m * scale.typical_slope) << voxel_m;
    }
}

TEST(VolumeContact, WithoutTheCertificateThePlateIsPassed) {
    std::shared_ptr<const ScalarField> field = make_slab(1e-3);
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<Uncarried>(field));
    ContactLoop loop({}, std::move(surfaces));
    loop.start({0, 0, 0.01});
    loop.move({0, 0, -0.01});
    EXPECT_LT(loop.proxy().z, 0.0);
}

TEST(VolumeContact, APlateIsNeverPassed) {
    ContactLoop loop({}, one_surface(make_slab(1e-3)));
    for (double step : {0.2e-3, 1e-3, 5e-3, 50e-3}) {
        loop.start({0, 0, 0.01});
        for (double z = 0.01; z > -0.12; z -= step)
            loop.move({0.3 * (0.01 - z), 0, z});
        EXPECT_NEAR(loop.proxy().z, 0.5e-3, 1e-12) << step;
    }
}

// Force-depth of a surface that yields: the play operator, exact on a ball pressed along a ray
// (numerics 3.2).
TEST(VolumeContact, AYieldingSurfaceIsThePlayOperator) {
    LevelSettings level;
    level.strength_n = 1.0; // s/k = 2 mm
    const double slack = level.strength_n / ContactLoop::kStiffness;
    SteppingSettings settings;
    settings.tolerance_m = 1e-12; // the proxy may rest anywhere within the tolerance
    ContactLoop loop(settings, one_surface(make_solid_sphere(kRadius), level));
    loop.start({0, 0, 0.06});
    double held = kRadius; // height at which the surface holds
    for (int i = 0; i < 4000; ++i) {
        const double z = 0.051 + 0.008 * std::cos(0.01 * i) - 0.004 * std::sin(0.0037 * i);
        loop.move({0, 0, z});
        held = std::min(kRadius, std::max(std::min(held, z + slack), z));
        const double expected = std::max(z, held);
        ASSERT_NEAR(loop.proxy().z, expected, 1e-10) << "frame " << i;
    }
}

TEST(VolumeContact, AHardSurfaceNeverMovesItsLevel) {
    std::shared_ptr<const ScalarField> field = make_bumpy_cavity(kRadius, 1e-3, 15e-3);
    auto surfaces = one_surface(field);
    const auto* contact = static_cast<const VolumeContact*>(surfaces[0].get());
    ContactLoop loop({}, std::move(surfaces));
    loop.start({0, 0, 0});
    std::mt19937_64 random(5);
    for (int i = 0; i < 2000; ++i) {
        loop.move(0.053 * random_direction(random));
        ASSERT_EQ(contact->anchored_level(), 0.0);
    }
}

/// Free space between two faces that meet in an edge along y, opening upwards; the probe is pushed
/// down into it.
double deepest_in_corner(double opening_deg) {
    std::shared_ptr<const ScalarField> field = make_wedge(360.0 - opening_deg);
    ContactLoop loop({}, one_surface(field));
    loop.start({0, 0, 0.02});
    double deep = 0.0;
    for (int i = 0; i <= 400; ++i) {
        loop.move({0.004 * std::sin(0.05 * i), 0.0002 * i, 0.02 - 0.0001 * i});
        deep = std::max(deep, deepest(*field, loop.subdivision().path()));
    }
    return deep;
}

// numerics 3.5: one plane cannot represent a corner; the bundle holds within the certificate, and
// its end in the edge.
TEST(VolumeContact, CornersOfEveryAngleHold) {
    for (double opening : {10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 175.0})
        EXPECT_LE(deepest_in_corner(opening), kCertificate + 1e-12) << opening;
}

TEST(VolumeContact, RestsInTheEdgeOfAConcaveCorner) {
    for (double opening : {30.0, 90.0, 150.0}) {
        ContactLoop loop({}, one_surface(make_wedge(360.0 - opening)));
        loop.start({0, 0, 0.02});
        for (int i = 0; i < 50; ++i)
            loop.move({0, 0.003, -0.01});
        EXPECT_LE(glm::length(loop.proxy() - Vec3(0, 0.003, 0)), 1e-9) << opening;
        const Vec3 held = loop.proxy();
        for (int i = 0; i < 1000; ++i)
            loop.move({0, 0.003, -0.01});
        EXPECT_EQ(loop.proxy(), held) << opening;
    }
}

TEST(VolumeContact, BeginningInsideIsFlaggedAndNotFeltUntilLeft) {
    ContactLoop loop({}, one_surface(make_solid_sphere(kRadius)));
    loop.start({0, 0, 0.04});
    EXPECT_TRUE(loop.flags_at_start() & kInsideAtStart);
    loop.move({0, 0, 0.045});
    EXPECT_EQ(loop.proxy(), Vec3(0, 0, 0.045));
    loop.move({0, 0, 0.055});
    loop.move({0, 0, 0.045});
    EXPECT_NEAR(loop.proxy().z, kRadius, 1e-9) << "felt again once it was outside";
}

// What planes may not be able to lead out of (contact.md 7.4): deeper than 0.7 of the certificate
// the field's own slope leads back to the level, and nothing on that chord is higher than its
// start.
TEST(VolumeContact, DeepInItsBandTheSlopeLeadsBackToTheLevel) {
    const std::pair<const char*, std::shared_ptr<const ScalarField>> bodies[] = {
        {"cavity", make_sphere_cavity(kRadius)},
        {"ball", make_solid_sphere(kRadius)},
        {"bumpy", make_bumpy_cavity(kRadius, 1e-3, 15e-3)},
        {"ring", make_torus(0.03, 0.01)}};
    std::mt19937_64 random(9);
    std::uniform_real_distribution<double> radius(0.0, 0.06); // m
    for (const auto& [name, field] : bodies) {
        VolumeContact contact(field, {});
        const double tau = contact.scale().certificate; // in the field's unit
        const auto sampler = field->make_sampler();
        int looked_at = 0;
        for (int chord = 0; chord < 400; ++chord) {
            const Vec3 from = radius(random) * random_direction(random);
            const Vec3 to = radius(random) * random_direction(random);
            if (sampler->value(from) >= 0.0) continue;
            for (const double share : {0.0, 0.5, 0.69, 0.71, 0.9, 0.999}) {
                const std::optional<double> root = sampler->first_root(from, to, share * tau);
                if (!root) break;
                SCOPED_TRACE(testing::Message() << name << ", seed 9, " << share << " of tau");
                const Vec3 proxy = from + *root * (to - from);
                const double value = sampler->value(proxy);
                ContactSet contacts;
                ASSERT_FALSE(contact.restart(from));
                contact.offer(proxy, contacts, nullptr);
                const std::optional<Vec3> nearer = contact.restore(proxy);
                ASSERT_EQ(nearer.has_value(), share > 0.7);
                if (!nearer) continue;
                ++looked_at;
                // A tenth of tau: the slope of the values' own interpolation is off by its bend.
                EXPECT_LE(std::abs(sampler->value(*nearer)), 0.1 * tau);
                EXPECT_LE(deepest(*field, std::array{proxy, *nearer}), value + 1e-9 * tau);
                contact.open(); // not felt any more: nothing to be led back to
                EXPECT_FALSE(contact.restore(proxy));
            }
        }
        EXPECT_GT(looked_at, 100);
    }
}

// The field's unit is a length: half a millimetre is the highest value of the slab.
TEST(VolumeContact, RefusesALevelThatIsNeverReached) {
    LevelSettings level;
    level.level = 0.5e-3;
    EXPECT_THROW(VolumeContact(make_slab(1e-3), level), std::invalid_argument);
    level.level = 0.49e-3;
    EXPECT_NO_THROW(VolumeContact(make_slab(1e-3), level));
}

TEST(VolumeContact, RefusesSettingsOutOfRange) {
    for (double LevelSettings::*const setting :
         {&LevelSettings::strength_n, &LevelSettings::certificate_m, &LevelSettings::free_m})
        for (const double bad : {0.0, -1.0, std::nan("")}) {
            LevelSettings level;
            level.*setting = bad;
            EXPECT_THROW(VolumeContact(make_slab(1e-3), level), std::invalid_argument) << bad;
        }
}

} // namespace
} // namespace palpate
