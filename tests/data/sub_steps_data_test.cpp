// SPDX-License-Identifier: Apache-2.0
// Any number of sub-steps on a real head CT, where the orbit presses into bone at 0.2 m/s.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/truth/surface_audit.h>
#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/sub_step_cases.h"

#ifdef PALPATE_WITH_CGAL
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/geometry/isosurface.h>
#endif

namespace palpate {
namespace {

using test::ContactLoop;
using Surfaces = std::vector<std::unique_ptr<SurfaceContact>>;

std::filesystem::path real_data(const std::string& name) {
    const char* folder = std::getenv("PALPATE_REAL_DATA");
    return std::filesystem::path(folder ? folder : "") / name;
}

struct Held {
    int in_contact = 0, stalled = 0;
    double lag_m = 0.0;       ///< mean distance from the reference's proxies
    double level_p99_m = 0.0; ///< distance from the level, of frames in contact
    std::vector<Vec3> proxies;
};

class SubStepsOnASkull : public testing::Test {
protected:
    void SetUp() override {
#ifdef PALPATE_WITH_CGAL
        if (!std::filesystem::exists(real_data("skull.nhdr")))
            GTEST_SKIP() << real_data("skull.nhdr")
                         << " is not there; scripts/fetch_data.sh gets it";
        SceneDescription scene; // as examples/skull.toml
        scene.volumes["head"].file = real_data("skull.nhdr");
        SurfaceDescription& bone = scene.surfaces["bone"];
        bone.volume = "head";
        bone.iso_value = 226.0;
        bone.smooth_voxels = 0.7;
        bone.keep.kind = ComponentPolicy::Kind::largest;
        bone.contact = ContactKind::guarded; // bakes and meshes for all
        scene.effects.push_back(effects::Surface{"bone"});
        DeviceDescription orbit;
        orbit.duration_s = 48.0;
        orbit.turns = 24;
        SceneResources resources;
        resources.files = scene_files(real_data("cache"));
        resources.extract = extract_isosurface;
        bone_ = Scene(scene, resources).surfaces().front();
        orbit_ = make_orbit(*bone_.baked.field, bone_.level.level, orbit, 1000.0);
#else
        GTEST_SKIP() << "this build extracts no mesh";
#endif
    }

    Surfaces direct() const {
        Surfaces surfaces;
        surfaces.push_back(
            std::make_unique<DirectContact>(bone_.mesh.scene, bone_.baked.field, bone_.level));
        return surfaces;
    }
    Surfaces mesh() const { return test::one_mesh(bone_.mesh.certified); }
    Surfaces guarded() const {
        Surfaces surfaces;
        surfaces.push_back(std::make_unique<GuardedContact>(bone_.baked.field, bone_.level,
                                                            bone_.mesh.certified, 1e-3));
        return surfaces;
    }

    /// So many frames of the orbit, from one of them on.
    Held hold(const test::SubStepCase& of, Surfaces surfaces, std::size_t first, std::size_t frames,
              const std::vector<Vec3>& reference = {}) const {
        ContactLoop loop(of.settings, std::move(surfaces), {}, of.reading_us);
        const auto sampler = bone_.baked.field->make_sampler();
        std::vector<double> level_m;
        Held held;
        for (std::size_t i = 0; i < frames; ++i) {
            const DeviceState& state = orbit_.at(first + i);
            if (i == 0 || state.trial != orbit_[first + i - 1].trial) loop.start(state.position);
            const SubdivisionResult frame = loop.move(state.position);
            held.proxies.push_back(loop.proxy());
            held.stalled += (frame.flags & kStalled) != 0;
            if (!reference.empty())
                held.lag_m +=
                    glm::length(loop.proxy() - reference[i]) / static_cast<double>(frames);
            if (!frame.felt) continue;
            ++held.in_contact;
            level_m.push_back(
                std::abs(level_distance(*sampler, loop.proxy(), bone_.level.level, 0.4e-3)));
        }
        std::sort(level_m.begin(), level_m.end());
        if (!level_m.empty()) held.level_p99_m = level_m[99 * level_m.size() / 100];
        return held;
    }

    /// Where the orbit presses for so many frames, nearly all of them in contact.
    std::size_t pressed_for(std::size_t frames, Surfaces surfaces) const {
        ContactLoop loop(test::adaptive_steps().settings, std::move(surfaces), {});
        std::vector<std::size_t> felt{0}; // before each frame
        for (std::size_t i = 0; i < orbit_.size(); ++i) {
            if (i == 0 || orbit_[i].trial != orbit_[i - 1].trial) loop.start(orbit_[i].position);
            felt.push_back(felt.back() + (loop.move(orbit_[i].position).felt != 0 ? 1 : 0));
            if (i >= frames && felt[i] - felt[i - frames] >= frames - frames / 20)
                return i - frames;
        }
        ADD_FAILURE() << "the orbit is nowhere in contact for so long";
        return 0;
    }

    /// Held for 1000 frames by any number as by adaptive steps; the more, the nearer to them.
    void expect_held_by_any(const std::function<Surfaces()>& surfaces) const {
        const std::size_t first = pressed_for(1000, surfaces());
        const Held best = hold(test::adaptive_steps(), surfaces(), first, 1000);
        EXPECT_GT(best.in_contact, 900);
        double last_m = 1.0;
        for (const test::SubStepCase& of : test::any_number_of_sub_steps()) {
            SCOPED_TRACE(of.name);
            const Held held = hold(of, surfaces(), first, 1000, best.proxies);
            EXPECT_NEAR(held.in_contact, best.in_contact, 0.01 * best.in_contact);
            if (of.settings.method == SteppingMethod::paper) {
                EXPECT_LE(held.lag_m, 1e-6);
                continue;
            }
            EXPECT_LE(held.lag_m, std::max(last_m, 1e-9)); // within it, facets are met
            last_m = held.lag_m;
        }
        EXPECT_LE(last_m, 1e-6);
    }

    SceneSurface bone_;
    std::vector<DeviceState> orbit_;
};

TEST_F(SubStepsOnASkull, DirectHoldsByAnyNumber) {
    expect_held_by_any([this] { return direct(); });
}

TEST_F(SubStepsOnASkull, MeshHoldsByAnyNumber) {
    expect_held_by_any([this] { return mesh(); });
}

// The certificate's edge used to stop it there: 2 % of all frames in contact, up to 120 in a row.
TEST_F(SubStepsOnASkull, GuardedGoesOnAtTheEdgeOfItsCertificate) {
    test::SubStepCase all = test::any_number_of_sub_steps().front();
    all.settings.method = SteppingMethod::fixed;
    all.settings.sub_steps = 46;
    const Held whole = hold(all, guarded(), 0, orbit_.size());
    EXPECT_GT(whole.in_contact, 40000);
    EXPECT_LE(whole.stalled, whole.in_contact / 1000); // seen: 20
    EXPECT_LE(whole.level_p99_m, 5e-6);                // seen: 3.8 um
    const std::size_t first = pressed_for(1000, guarded());
    double last_m = 1.0;
    for (const test::SubStepCase& of : test::any_number_of_sub_steps()) {
        if (of.settings.method == SteppingMethod::fixed && of.settings.sub_steps < 46) continue;
        SCOPED_TRACE(of.name);
        const Held held = hold(of, guarded(), first, 1000);
        EXPECT_EQ(held.stalled, 0);
        if (of.settings.method == SteppingMethod::fixed) {
            EXPECT_LE(held.level_p99_m, last_m);
            last_m = held.level_p99_m;
        }
    }
}

} // namespace
} // namespace palpate
