// SPDX-License-Identifier: Apache-2.0
// Walls as thin as voxels, at any speed; and what simpler rules than the leash come to
// (contact.md 3.6 and 4).
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

using test::certified;
using test::ContactLoop;

constexpr double kVoxel = 1e-3, kLeash = 1e-3; // m
constexpr double kLevel = 100.0, kAir = 0.0;   // HU

/// One layer of voxels across z, `crest` HU above the level; all else is air.
std::shared_ptr<const ScalarField> one_layer(double crest) {
    VoxelVolume volume;
    volume.size = {24, 24, 24};
    volume.index_to_scene.linear = kVoxel * Mat3(1.0);
    volume.index_to_scene.offset = Vec3(-12.0 * kVoxel);
    volume.values.assign(volume.voxels(), static_cast<float>(kAir));
    for (int j = 1; j < 23; ++j)
        for (int i = 1; i < 23; ++i)
            volume.values[volume.index(i, j, 12)] = static_cast<float>(kLevel + crest);
    return std::make_shared<GridField>(volume, static_cast<float>(kAir));
}

/// Its isosurface but for the rim, as a box: the level is linear across the layer.
TriangleMesh its_mesh(double crest) {
    const double half = kVoxel * crest / (kLevel + crest - kAir);
    return test::box_mesh({-0.011, -0.011, -half}, {0.010, 0.010, half});
}

LevelSettings at_level() {
    LevelSettings level;
    level.level = kLevel;
    return level;
}

std::vector<std::unique_ptr<SurfaceContact>> guarded(double crest) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(one_layer(crest), at_level(),
                                                        certified(its_mesh(crest)), kLeash));
    return surfaces;
}

/// Strokes of 0.2 to 400 mm per frame across the wall; how many end behind it.
int passed(ContactLoop& loop, unsigned seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> beside(-0.005, 0.005), share;
    int count = 0;
    for (int stroke = 0; stroke < 500; ++stroke) {
        const double step = 0.2e-3 * std::pow(2000.0, share(random));
        const double x = beside(random), y = beside(random), u = beside(random), v = beside(random);
        const Vec3 start{x, y, 0.008}, end{u, v, -0.008};
        const int frames = 1 + static_cast<int>(glm::length(end - start) / step);
        loop.start(start);
        for (int i = 0; i <= frames; ++i)
            loop.move(start + (static_cast<double>(i) / frames) * (end - start));
        count += loop.proxy().z < 0.0;
    }
    return count;
}

// Crests below tau above the level are no walls (contact.md 1.6): tau is 25 um of a slope of
// (crest + 100) HU/mm here, at most 12.5 HU.
TEST(OneVoxelWall, IsNeverPassedAtAnySpeed) {
    for (const double crest : {15.0, 50.0, 400.0}) {
        ContactLoop volume({}, test::one_surface(one_layer(crest), at_level()));
        EXPECT_EQ(passed(volume, 1), 0) << "volume, crest " << crest;
        ContactLoop with_guard({}, guarded(crest));
        EXPECT_EQ(passed(with_guard, 2), 0) << "guarded, crest " << crest;
    }
}

/// A wall that leans, thinner than voxels: sampled, a sieve. Its mesh is whole.
struct Sieve {
    Vec3 normal{std::sin(0.3), 0.0, std::cos(0.3)};
    std::shared_ptr<const ScalarField> field() const {
        return test::voxels_of(
            [this](const Vec3& p) { return 0.15e-3 - std::abs(glm::dot(normal, p)); }, 0.02, 1e-3);
    }
    TriangleMesh mesh() const {
        const Vec3 u{std::cos(0.3), 0.0, -std::sin(0.3)};
        TriangleMesh box = test::box_mesh({-0.03, -0.03, -0.15e-3}, {0.03, 0.03, 0.15e-3});
        for (Vec3& p : box.vertices)
            p = p.x * u + p.y * Vec3{0, 1, 0} + p.z * normal;
        return box;
    }
};

/// The rule that was tried and rejected: the volume's proxy, but where the mesh's is more than the
/// leash away that one, from which the volume's goes on.
class HardSwitch {
public:
    explicit HardSwitch(const Sieve& sieve)
        : volume_({}, test::one_surface(sieve.field())),
          mesh_({}, test::one_mesh(certified(sieve.mesh()))) {}
    void start(const Vec3& proxy) {
        volume_.start(proxy);
        mesh_.start(proxy);
        proxy_ = proxy;
    }
    void move(const Vec3& probe) {
        volume_.move(probe);
        mesh_.move(probe);
        const bool apart = glm::length(volume_.proxy() - mesh_.proxy()) > kLeash;
        proxy_ = apart ? mesh_.proxy() : volume_.proxy();
        if (apart) volume_.start(mesh_.proxy());
    }
    const Vec3& proxy() const { return proxy_; }

private:
    ContactLoop volume_, mesh_;
    Vec3 proxy_{0.0};
};

/// Presses slowly onto the sieve and beyond, 10 um per frame: the longest way that the proxy is
/// thrown back in one, m.
template <class Loop>
double longest_throw_back(Loop& loop, const Sieve& sieve) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> beside(-0.008, 0.008);
    double longest = 0.0;
    for (int place = 0; place < 100; ++place) {
        const double x = beside(random), y = beside(random);
        const Vec3 above = Vec3{x, y, 0.0} + 0.003 * sieve.normal;
        loop.start(above);
        for (int i = 0; i <= 500; ++i) {
            const Vec3 before = loop.proxy();
            loop.move(above - 1e-5 * i * sieve.normal);
            longest = std::max(longest, glm::dot(sieve.normal, loop.proxy() - before));
        }
    }
    return longest;
}

TEST(LeashControl, HardSwitchingBetweenMeshAndVolumeThrowsTheProxyBack) {
    const Sieve sieve;
    HardSwitch loop(sieve);
    EXPECT_GT(longest_throw_back(loop, sieve), 0.9 * kLeash);
}

// A tenth of the leash: what the plane across it leaves to the solver when the guard comes along.
TEST(LeashControl, TheLeashDoesNot) {
    const Sieve sieve;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(sieve.field(), LevelSettings{},
                                                        certified(sieve.mesh()), kLeash));
    ContactLoop loop({}, std::move(surfaces));
    EXPECT_LT(longest_throw_back(loop, sieve), 0.1 * kLeash);
}

} // namespace
} // namespace palpate
