// SPDX-License-Identifier: Apache-2.0
// Contact guarded on a real head CT and a real brain: what contact.md 8 asks of it.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/volume/filters/volume_filters.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/contact_loop.h"
#include "tests/support/mesh_fuzz.h"

#ifdef PALPATE_WITH_CGAL
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/isosurface.h>
#endif

namespace palpate {
namespace {

std::filesystem::path real_data(const std::string& name) {
    const char* folder = std::getenv("PALPATE_REAL_DATA");
    return std::filesystem::path(folder ? folder : "") / name;
}

constexpr double kLeash = 1e-3;         // m: five facet distances
constexpr std::uint64_t kEventGap = 20; // frames: what is less apart is one event

/// The only process that makes a surface: the others wait until it is in the cache.
class Turn {
public:
    Turn() : file_(open(real_data("cache.lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666)) {
        flock(file_, LOCK_EX);
    }
    ~Turn() { close(file_); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

private:
    int file_;
};

/// A surface baked and meshed once, and kept beside the data: tests are processes of their own.
SceneSurface surface_of(const VolumeDescription& scan, double iso_value,
                        double smooth_voxels = 0.7) {
    const Turn turn;
    SceneDescription description;
    description.volumes["scan"] = scan;
    SurfaceDescription& surface = description.surfaces["surface"];
    surface.volume = "scan";
    surface.iso_value = iso_value;
    surface.smooth_voxels = smooth_voxels;
    surface.keep.kind = ComponentPolicy::Kind::largest;
    surface.contact = ContactKind::guarded;
    description.effects.push_back(effects::Surface{"surface"});
    SceneResources resources;
    resources.files = scene_files(real_data("cache"));
#ifdef PALPATE_WITH_CGAL
    resources.extract = extract_isosurface;
#endif
    return Scene(description, resources).surfaces().front();
}

SceneSurface surface_of(const std::string& file, double iso_value) {
    VolumeDescription scan;
    scan.file = real_data(file);
    return surface_of(scan, iso_value);
}

class GuardedScan : public testing::Test {
protected:
    void SetUp() override {
#ifndef PALPATE_WITH_CGAL
        GTEST_SKIP() << "this build extracts no mesh";
#endif
        for (const char* file : {"skull.nhdr", "brain.nii.gz"})
            if (!std::filesystem::exists(real_data(file)))
                GTEST_SKIP() << real_data(file) << " is not there; scripts/fetch_data.sh gets it";
    }
};

struct Outcome {
    std::uint64_t frames = 0, in_contact = 0, guarded_frames = 0, events = 0;
    std::uint64_t guards_checked = 0, guards_inside = 0;
    double deepest = -1e9; ///< of all chords, above the level, the field's unit
    double tolerance = 0.0;
};

/// Whether the guard is on one facet alone and a hair off it, away from what draws it, inside: by
/// the solid angles of all triangles. Nothing where it is elsewhere.
std::optional<bool> inside_of(const CertifiedMesh& mesh, const Vec3& guard, const Vec3& proxy) {
    constexpr double kHair = 1e-8; // m
    const Vec3 away = guard - proxy;
    if (glm::length(away) < 20e-6) return std::nullopt;
    std::vector<std::uint32_t> near;
    mesh.scene().triangles_near(guard, 1e-6, near);
    int on = 0;
    const TriangleMesh& triangles = mesh.scene().mesh();
    for (const std::uint32_t i : near) {
        const auto& t = triangles.triangles[i];
        const Vec3 closest = closest_point_on_triangle(
            guard, triangles.vertices[t[0]], triangles.vertices[t[1]], triangles.vertices[t[2]]);
        on += glm::length(closest - guard) < 1e-7;
    }
    if (on != 1) return std::nullopt;
    const Vec3 beside = guard + kHair * glm::normalize(away);
    return test::winding_number(mesh.scene().mesh(), beside) > 0.5;
}

Outcome follow(const SceneSurface& surface, const std::vector<DeviceState>& states) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(surface.baked.field, surface.level,
                                                        surface.mesh.certified, kLeash));
    const auto& contact = static_cast<const GuardedContact&>(*surfaces.front());
    test::ContactLoop loop({}, std::move(surfaces));
    const auto sampler = surface.baked.field->make_sampler();
    Outcome outcome;
    outcome.tolerance = LevelScale::of(*surface.baked.field, surface.level).certificate;
    std::uint64_t last_guarded = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
        if (i == 0 || states[i].trial != states[i - 1].trial) loop.start(states[i].position);
        const SubdivisionResult frame = loop.move(states[i].position);
        ++outcome.frames;
        outcome.in_contact += frame.felt != 0;
        if (frame.guarded) {
            if (outcome.guarded_frames == 0 || outcome.frames - last_guarded > kEventGap)
                ++outcome.events;
            last_guarded = outcome.frames;
            ++outcome.guarded_frames;
        }
        if (!frame.open) {
            const auto path = loop.subdivision().path();
            for (std::size_t c = 1; c < path.size(); ++c) {
                const Vec3 chord = path[c] - path[c - 1];
                const int samples = 1 + std::min(400, static_cast<int>(glm::length(chord) / 25e-6));
                for (int k = 0; k <= samples; ++k)
                    outcome.deepest =
                        std::max(outcome.deepest,
                                 sampler->value(path[c - 1] + (k / (1.0 * samples)) * chord) -
                                     surface.level.level);
            }
        }
        const bool look = i % 23 == 0 || frame.guarded;
        if (look && contact.guard() && outcome.guards_checked < 150) {
            if (const auto inside =
                    inside_of(*surface.mesh.certified, *contact.guard(), loop.proxy())) {
                ++outcome.guards_checked;
                outcome.guards_inside += *inside;
            }
        }
    }
    ::testing::Test::RecordProperty("in_contact", std::to_string(outcome.in_contact));
    ::testing::Test::RecordProperty("events", std::to_string(outcome.events));
    ::testing::Test::RecordProperty("guards_checked", std::to_string(outcome.guards_checked));
    ::testing::Test::RecordProperty("deepest", std::to_string(outcome.deepest));
    return outcome;
}

/// What holds on every path: the certificate (1e-6 of the field's unit is rounding), and that the
/// guard stays outside.
void expect_held(const Outcome& outcome) {
    EXPECT_LE(outcome.deepest, outcome.tolerance + 1e-6);
    EXPECT_EQ(outcome.guards_inside, 0u);
    EXPECT_GT(outcome.guards_checked, 20u);
}

std::vector<DeviceState> orbit_of(const SceneSurface& surface, double seconds) {
    DeviceDescription orbit;
    orbit.duration_s = seconds;
    return make_orbit(*surface.baked.field, surface.level.level, orbit, 1000.0);
}

std::vector<DeviceState> kept_path(const std::string& name) {
    return read_probe_path(std::filesystem::path(PALPATE_PATHS) / name, 1000.0, 1);
}

TEST_F(GuardedScan, SkullOrbitIsTheVolumesBitForBitWithoutALeashEvent) {
    const SceneSurface surface = surface_of("skull.nhdr", 226.0);
    const std::vector<DeviceState> states = orbit_of(surface, 24.0);
    const Outcome outcome = follow(surface, states);
    expect_held(outcome);
    EXPECT_GT(outcome.in_contact, 15000u);
    EXPECT_EQ(outcome.events, 0u);
    std::vector<std::unique_ptr<SurfaceContact>> both[2];
    both[0].push_back(std::make_unique<GuardedContact>(surface.baked.field, surface.level,
                                                       surface.mesh.certified, kLeash));
    both[1].push_back(std::make_unique<VolumeContact>(surface.baked.field, surface.level));
    test::ContactLoop guarded({}, std::move(both[0])), volume({}, std::move(both[1]));
    for (std::size_t i = 0; i < states.size(); ++i) {
        for (test::ContactLoop* loop : {&guarded, &volume}) {
            if (i == 0 || states[i].trial != states[i - 1].trial) loop->start(states[i].position);
            loop->move(states[i].position);
        }
        ASSERT_EQ(guarded.proxy(), volume.proxy()) << i;
    }
}

TEST_F(GuardedScan, SkullHeldProbesMoveNoBit) {
    const SceneSurface surface = surface_of("skull.nhdr", 226.0);
    const std::vector<DeviceState> states = orbit_of(surface, 24.0);
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(surface.baked.field, surface.level,
                                                        surface.mesh.certified, kLeash));
    test::ContactLoop loop({}, std::move(surfaces));
    int places = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
        if (i == 0 || states[i].trial != states[i - 1].trial) loop.start(states[i].position);
        SubdivisionResult frame = loop.move(states[i].position);
        if (i % 200 != 199 || !frame.felt) continue;
        // A frame that ended at its evaluation cap goes on in the next ones.
        for (int settle = 0; settle < 50 && (frame.flags & kEvaluationCap); ++settle)
            frame = loop.move(states[i].position);
        loop.move(states[i].position);
        const Vec3 held = loop.proxy();
        ++places;
        for (int k = 0; k < 150; ++k) {
            frame = loop.move(states[i].position);
            ASSERT_EQ(loop.proxy(), held) << "place " << i;
            ASSERT_EQ(frame.guarded, 0u);
        }
    }
    EXPECT_GE(places, 75);
}

// The face, the teeth and the thinnest bone: scripts/make_skull_strokes.py finds them in the field.
TEST_F(GuardedScan, SkullStrokesHaveFewLeashEvents) {
    const SceneSurface surface = surface_of("skull.nhdr", 226.0);
    for (const char* name : {"skull_face.csv", "skull_teeth.csv", "skull_thin.csv"}) {
        SCOPED_TRACE(name);
        const Outcome outcome = follow(surface, kept_path(name));
        expect_held(outcome);
        EXPECT_GT(outcome.in_contact, 2500u);
        EXPECT_LE(outcome.events, 5u);
    }
}

// Straight through the head, from one side to the other.
TEST_F(GuardedScan, SkullIsNotPassedAtAnySpeed) {
    const SceneSurface surface = surface_of("skull.nhdr", 226.0);
    std::mt19937_64 random(21);
    std::normal_distribution<double> normal;
    const Vec3 center = surface.baked.field->bounds().center();
    for (const double speed : {1.0, 10.0, 100.0, 400.0}) { // m/s
        SCOPED_TRACE(speed);
        std::vector<DeviceState> states;
        for (std::uint32_t stroke = 0; stroke < 60; ++stroke) {
            const double x = normal(random), y = normal(random), z = normal(random),
                         u = normal(random), v = normal(random), w = normal(random);
            const Vec3 direction = glm::normalize(Vec3{x, y, z});
            const Vec3 through = center + 0.02 * Vec3{u, v, w};
            const Vec3 start = through - 0.16 * direction;
            const int frames = 1 + static_cast<int>(0.32 / (1e-3 * speed));
            for (int i = 0; i <= frames; ++i) {
                DeviceState state;
                state.position = start + (0.32 * i / frames) * direction;
                state.trial = stroke;
                states.push_back(state);
            }
            for (int i = 0; i < 5; ++i)
                states.push_back(states.back()); // what the caps left to do
        }
        const Outcome outcome = follow(surface, states);
        EXPECT_LE(outcome.deepest, outcome.tolerance + 1e-6);
        EXPECT_EQ(outcome.guards_inside, 0u);
        EXPECT_GT(outcome.in_contact, 60u);
    }
}

TEST_F(GuardedScan, BrainOrbitHasNoLeashEvent) {
    const SceneSurface surface = surface_of("brain.nii.gz", 60.0);
    const Outcome outcome = follow(surface, orbit_of(surface, 20.0));
    expect_held(outcome);
    EXPECT_GT(outcome.in_contact, 10000u);
    EXPECT_EQ(outcome.events, 0u);
}

// Mesh and volume must be of one field: with the mesh of the field before smoothing the guard holds
// the proxy where the smoothed one has no wall any more.
TEST_F(GuardedScan, ControlAMeshOfTheFieldBeforeSmoothingDisagrees) {
    SceneSurface mixed = surface_of("skull.nhdr", 226.0);
    const std::vector<DeviceState> path = kept_path("skull_thin.csv");
    Box around; // as much of the head as the path gets to: all of it takes a minute
    for (const DeviceState& state : path)
        for (const double reach_m : {-0.012, 0.012})
            around.add(state.position + Vec3{reach_m});
    VolumeDescription part;
    part.voxels =
        std::make_shared<VoxelVolume>(cropped(read_volume(real_data("skull.nhdr")), around));
    mixed.mesh = surface_of(part, 226.0, 0.0).mesh;
    EXPECT_GT(follow(mixed, path).events, 15u);
}

// Skin that yields at 2 N over bone, pressed into the forehead and drawn out again.
TEST_F(GuardedScan, SkinYieldsAtItsStrengthOverBone) {
    const SceneSurface bone = surface_of("skull.nhdr", 226.0);
    SceneSurface pressed = surface_of("skull.nhdr", -300.0);
    pressed.level.strength_n = 2.0;
    const SceneSurface& skin = pressed;
    for (const double speed : {0.05e-3, 0.2e-3, 2e-3}) { // m per frame
        SCOPED_TRACE(speed);
        std::vector<std::unique_ptr<SurfaceContact>> both;
        for (const SceneSurface* surface : {&bone, &skin})
            both.push_back(std::make_unique<GuardedContact>(surface->baked.field, surface->level,
                                                            surface->mesh.certified, kLeash));
        test::ContactLoop loop({}, std::move(both));
        double y = -0.085; // in front of the forehead, which is towards -y
        const auto probe = [&] { return Vec3{0.012, y, 0.035}; };
        loop.start(probe());
        int yielding = 0, on_bone = 0;
        const auto press = [&](double target) {
            while (y != target) {
                y = target > y ? std::min(target, y + speed) : std::max(target, y - speed);
                const SubdivisionResult frame = loop.move(probe());
                const double force =
                    test::ContactLoop::kStiffness * glm::length(loop.proxy() - probe());
                const bool bone_felt = frame.felt & 1, skin_felt = frame.felt & 2;
                on_bone += bone_felt;
                if (bone_felt || frame.flags) continue;
                ASSERT_LE(force, 2.0 + 1e-3) << "at " << y;
                if (skin_felt && loop.surface(1).state() == SurfaceState::yielded &&
                    target > -0.07) {
                    // Pushed along it gives way with its strength.
                    ASSERT_NEAR(force, 2.0, 1e-3) << "at " << y;
                    ++yielding;
                }
            }
        };
        press(-0.062);
        EXPECT_GT(yielding, 0);
        EXPECT_GT(on_bone, 0);
        EXPECT_GT(test::ContactLoop::kStiffness * glm::length(loop.proxy() - probe()), 2.0);
        press(-0.085);
        EXPECT_LE(glm::length(loop.proxy() - probe()), 1e-12);
        EXPECT_EQ(loop.surface(1).state(), SurfaceState::free);
    }
}

} // namespace
} // namespace palpate
