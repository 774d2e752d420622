// SPDX-License-Identifier: Apache-2.0
// No allocation below frame(), Embree and OpenVDB included: this program's own malloc counts for
// every library in it.
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

#include <palpate/drivers/simulated_hand.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/internal/servo_loop.h>
#include <palpate/haptics/effects/contact_vibration.h>
#include <palpate/haptics/effects/curve_guide.h>
#include <palpate/haptics/effects/gravity_compensation.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/haptics/effects/vector_force.h>
#include <palpate/haptics/effects/vector_sheet.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/haptics/effects/workspace.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_vector_field.h>

#include "tests/support/contact_loop.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/odd_meshes.h"
#include "tests/support/one_of_each.h"
#include "tests/support/phantom.h"

namespace heap { // what C asks it for is counted outside of every namespace
std::atomic<bool> counting{false};
std::atomic<long> allocations{0};
void count() noexcept {
    if (counting.load(std::memory_order_relaxed))
        allocations.fetch_add(1, std::memory_order_relaxed);
}
} // namespace heap

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
    heap::count();
    return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
    heap::count();
    return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
    heap::count();
    return __libc_realloc(p, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
    heap::count();
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    heap::count();
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
    heap::count();
    *p = __libc_memalign(alignment, size);
    return *p ? 0 : 12; // ENOMEM
}
void free(void* p) {
    heap::count();
    __libc_free(p);
}
}

namespace palpate {
namespace {

/// Ten thousand frames round a body and through it, after a warm-up of a hundred.
long allocations_of(const std::shared_ptr<const Scene>& scene) {
    SteadyClock clock;
    HapticLoop loop(scene, clock);
    DeviceState state;
    std::size_t touched = 0, known = 0; // what is asked for besides
    const auto step = [&](int i) {
        const double angle = 0.004 * i;
        const double radius = 0.028 + 0.006 * std::sin(0.01 * i);
        state.position =
            radius * Vec3{std::cos(angle), std::sin(angle), 0.3 * std::sin(0.37 * angle)};
        state.time_s = 1e-3 * i;
        loop.frame(state);
        touched += loop.touches().size();
        for (const SurfaceStatus& status : loop.surface_states())
            known += std::isfinite(status.depth_m) ? 1 : 0;
    };
    for (int i = 0; i < 100; ++i)
        step(i);
    heap::allocations = 0;
    heap::counting = true;
    for (int i = 100; i < 10100; ++i)
        step(i);
    heap::counting = false;
    if (!scene->surfaces().empty()) {
        EXPECT_GT(touched, 100u);
        EXPECT_GT(known, 100u);
    }
    return heap::allocations;
}

TEST(Allocation, TheCounterCounts) {
    heap::counting = true;
    heap::allocations = 0;
    std::unique_ptr<int> one(new int(1));
    heap::counting = false;
    EXPECT_GE(heap::allocations, 1);
}

TEST(Allocation, FramesOfContactVolumeMakeNone) {
    for (const char* method : {"adaptive", "fixed", "paper", "single"})
        EXPECT_EQ(allocations_of(test::phantom_scene("volume", method, "budget_us = 50\n")), 0)
            << method;
}

/// The whole safety chain, with faults, and the simulated hand itself.
TEST(Allocation, FramesOnADeviceWithMotorsMakeNone) {
    const auto scene = test::phantom_scene("volume", "adaptive");
    SteadyClock clock;
    SimulatedHand hand({}, {{0.0, {0.05, 0, 0}}, {5.0, {0.01, 0, 0}}, {10.0, {0.05, 0.01, 0}}});
    HapticLoop loop(scene, clock, scene->description().loop, hand.properties());
    long pressed = 0;
    const auto step = [&](int i) {
        DeviceState state;
        hand.read(state);
        if (i % 5500 == 500) state.freshness = Freshness::stale;
        const FrameReport report = loop.frame(state);
        hand.write(report.force);
        pressed += report.force != Vec3{0.0} ? 1 : 0;
    };
    for (int i = 1; i < 100; ++i)
        step(i);
    heap::allocations = 0;
    heap::counting = true;
    for (int i = 100; i < 10100; ++i)
        step(i);
    loop.release();
    heap::counting = false;
    EXPECT_EQ(heap::allocations, 0);
    EXPECT_GT(pressed, 1000);
}

TEST(Allocation, FramesOfContactDirectMakeNone) {
    if (!test::can_extract()) GTEST_SKIP() << "this build has no extraction";
    EXPECT_EQ(allocations_of(test::phantom_scene("direct", "adaptive")), 0);
}

/// On facets that are certified and on such that are not, off them, and yielding.
TEST(Allocation, FramesOfContactMeshMakeNone) {
    TriangleMesh mesh = test::spiky_ball(0.028, 3, 0.1, 5);
    test::append(mesh, test::icosphere(0.02, 3, {0.02, 0, 0}));
    const auto certified = test::certified(std::move(mesh));
    ASSERT_GT(certified->uncertain_count(), 0u);
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::fixed})
        for (const double strength : {std::numeric_limits<double>::infinity(), 1.0}) {
            SteppingSettings settings;
            settings.method = method;
            test::ContactLoop loop(settings, test::one_mesh(certified, {strength}));
            loop.start({0.05, 0, 0});
            const auto step = [&](int i) {
                const double angle = 0.004 * i;
                const double radius = 0.028 + 0.006 * std::sin(0.01 * i);
                loop.move(radius * Vec3{std::cos(angle), std::sin(angle), std::sin(0.37 * angle)});
            };
            for (int i = 0; i < 100; ++i)
                step(i);
            heap::allocations = 0;
            heap::counting = true;
            for (int i = 100; i < 10100; ++i)
                step(i);
            heap::counting = false;
            EXPECT_EQ(heap::allocations, 0);
        }
}

/// Fibres on a grid, a helix by formula, their fronts and tubes, in a medium, on a hard ball.
TEST(Allocation, FramesOfVectorEffectsMakeNone) {
    const std::shared_ptr<const VectorField> helix = make_helix(0.03, 0.03);
    VectorVolume fibres;
    fibres.size = {2, 2, 2};
    fibres.index_to_scene = {Mat3(0.08), Vec3(-0.04)};
    fibres.values = {1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1, -1, 0, 0};
    const auto grid = std::make_shared<GridVectorField>(fibres, VectorSense::axial);
    const TransferFunction strength = TransferFunction::constant(0.5);
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<VectorFollow>(helix, strength));
    effects.push_back(std::make_unique<VectorFollow>(grid, strength));
    effects.push_back(std::make_unique<VectorSheet>(helix, strength, SheetKind::front));
    effects.push_back(std::make_unique<VectorSheet>(helix, strength, SheetKind::vortex));
    effects.push_back(std::make_unique<VectorForce>(helix, strength));
    effects.push_back(std::make_unique<Viscosity>(1.0));
    SteppingSettings settings;
    test::ContactLoop loop(settings, test::one_surface(make_solid_sphere(0.028)),
                           std::move(effects));
    loop.start({0.03, 0, 0});
    const auto step = [&](int i) {
        const double angle = 0.004 * i;
        const double radius = 0.028 + 0.006 * std::sin(0.01 * i);
        loop.move(radius * Vec3{std::cos(angle), std::sin(angle), std::sin(0.37 * angle)});
    };
    for (int i = 0; i < 100; ++i)
        step(i);
    heap::allocations = 0;
    heap::counting = true;
    for (int i = 100; i < 2100; ++i)
        step(i);
    heap::counting = false;
    EXPECT_EQ(heap::allocations, 0);
}

/// Guides that snap on and let go beside a hard ball, within limits, with what rings and weighs.
TEST(Allocation, FramesOfGuidesAndLimitsMakeNone) {
    std::vector<Vec3> trajectory;
    for (int i = 0; i < 1000; ++i)
        trajectory.push_back(0.029 * Vec3{std::cos(0.006 * i), std::sin(0.006 * i), 0.0});
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<PointGuide>(Vec3{0.03, 0, 0}, GuideSettings{0.5, 3e-3}));
    effects.push_back(std::make_unique<CurveGuide>(Polyline(trajectory, PolylineEnds::open),
                                                   GuideSettings{0.5, 2e-3}));
    effects.push_back(std::make_unique<ContactVibration>(ContactVibrationSettings{}));
    effects.push_back(std::make_unique<GravityCompensation>(0.05, Vec3{0, 0, -1}));
    effects.push_back(std::make_unique<WorkspaceSphere>(Vec3{0.0}, 0.032, 5.0));
    effects.push_back(std::make_unique<WorkspaceBox>(Box{Vec3{-0.03}, Vec3{0.03}}, 5.0));
    SteppingSettings settings;
    test::ContactLoop loop(settings, test::one_surface(make_solid_sphere(0.028)),
                           std::move(effects));
    loop.start({0.03, 0, 0});
    const auto step = [&](int i) {
        const double angle = 0.004 * i;
        const double radius = 0.028 + 0.006 * std::sin(0.01 * i);
        loop.move(radius * Vec3{std::cos(angle), std::sin(angle), 0.1 * std::sin(0.37 * angle)});
    };
    for (int i = 0; i < 100; ++i)
        step(i);
    heap::allocations = 0;
    heap::counting = true;
    for (int i = 100; i < 2100; ++i)
        step(i);
    heap::counting = false;
    EXPECT_EQ(heap::allocations, 0);
}

TEST(Allocation, SwitchingEffectsMakesNone) {
    SteadyClock clock;
    HapticLoop loop(test::one_of_each_scene(), clock, test::fibres());
    std::mt19937_64 random(21);
    const auto step = [&](int i) {
        test::switch_at_random(loop, i, random);
        DeviceState state;
        state.position = test::dipping(i);
        loop.frame(state);
    };
    for (int i = 0; i < 100; ++i)
        step(i);
    heap::allocations = 0;
    heap::counting = true;
    for (int i = 100; i < 10100; ++i)
        step(i);
    heap::counting = false;
    EXPECT_EQ(heap::allocations, 0);
}

TEST(Allocation, RestoringALoopsStateMakesNone) {
    SteadyClock clock;
    HapticLoop loop(test::one_of_each_scene(), clock, test::fibres());
    std::mt19937_64 random(22);
    const auto step = [&](int i) {
        test::switch_at_random(loop, i, random);
        DeviceState state;
        state.position = test::dipping(i);
        loop.frame(state);
    };
    std::vector<LoopState> states;
    for (int i = 0; i < 1000; ++i) {
        if (i % 97 == 0) states.push_back(loop.save());
        step(i);
    }
    heap::allocations = 0;
    heap::counting = true;
    for (const LoopState& state : states) {
        loop.restore(state);
        step(1);
    }
    heap::counting = false;
    EXPECT_EQ(heap::allocations, 0);
}

/// Waiting for the clock, reading and writing the device and handing over to the recorder included;
/// frames that find no room as well.
TEST(Allocation, AServoLoopMakesNone) {
    class Circling final : public HapticDevice {
    public:
        DeviceProperties properties() const override { return {}; }
        bool read(DeviceState& state) noexcept override {
            if (reads_ == 100) {
                heap::allocations = 0;
                heap::counting = true;
            }
            if (reads_ == 4100) {
                heap::counting = false;
                return false;
            }
            const double angle = 0.004 * reads_++;
            state.time_s = 0.25 * angle;
            state.position = 0.03 * Vec3{std::cos(angle), std::sin(angle), 0.1};
            return true;
        }
        void write(const Vec3&) noexcept override {}

    private:
        int reads_ = 0;
    } device;
    const auto scene = test::phantom_scene("volume", "paper", "budget_us = 50\n");
    SteadyPacedClock clock;
    HapticLoop loop(scene, clock);
    internal::SpscRing<RunFrame> frames(16);
    internal::SpscRing<std::uint32_t> decisions(1u << 20);
    internal::ServoSettings settings;
    settings.period_us = 100.0;
    const DevicePlacement placement(DevicePlacementSettings{});
    internal::ServoLoop servo(loop, device, placement, clock, settings, frames, &decisions);
    servo.run();
    heap::counting = false;
    EXPECT_EQ(heap::allocations, 0);
    EXPECT_GT(servo.dropped(), 0u);
}

TEST(Allocation, FramesOfVolumeEffectsMakeNone) {
    EXPECT_EQ(allocations_of(test::gradient_surface_scene()), 0);
}

} // namespace
} // namespace palpate

#endif
