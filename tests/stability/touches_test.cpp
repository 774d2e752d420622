// SPDX-License-Identifier: Apache-2.0
// Where surfaces are all that is felt, what they push with is what the coupling pulls with: in
// every frame, whatever the surfaces, however they rub, yield or lead the proxy.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scene_texts.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

constexpr std::uint64_t kScenes = 120;
constexpr int kFrames = 400;
// A frame with one of these did not come to its balance, or a spring of its own held the proxy.
constexpr std::uint32_t kUnfinished =
    kEvaluationCap | kStalled | kSolverCap | kPrimitivesFull | kForceNotFinite | kCalmed;

/// One to three surfaces about the origin, some of which rub or yield.
class SurfacesDraw {
public:
    explicit SurfacesDraw(std::uint64_t seed) : random_(seed) {}

    std::string text() {
        std::string all = fmt::format("[coupling]\nstiffness_n_per_m = {}\n", between(200, 2000));
        const int count = 1 + pick(3);
        for (int i = 0; i < count; ++i)
            all += surface(fmt::format("s{}", i));
        return all;
    }
    /// In and out of what is about the origin, at up to half a metre a second, and now and then
    /// held.
    std::vector<Vec3> way(int frames) {
        std::vector<Vec3> way;
        Vec3 at{0, 0, 0.06}, to = at;
        while (static_cast<int>(way.size()) < frames) {
            to = 0.016 * Vec3{between(-1, 1), between(-1, 1), between(-1, 1)};
            const double step_m = between(2e-5, 5e-4);
            for (int held = pick(4) == 0 ? 20 : 1; held > 0 && at != to;) {
                const Vec3 left = to - at;
                at = glm::length(left) > step_m ? at + step_m / glm::length(left) * left : to;
                way.push_back(at);
                if (at == to)
                    for (; held > 0; --held)
                        way.push_back(at);
            }
        }
        way.resize(static_cast<std::size_t>(frames));
        return way;
    }

private:
    double between(double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random_);
    }
    int pick(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }

    std::string surface(const std::string& name) {
        const int kind = pick(6);
        std::string text;
        if (kind == 0) text = "analytic = \"slab\"\nthickness_mm = 8";
        if (kind == 1)
            text = fmt::format("analytic = \"wedge\"\nangle_deg = {}", between(190, 300));
        if (kind == 2) text = "analytic = \"torus\"\nradius_mm = 12\ntube_mm = 4";
        if (kind == 3)
            text = fmt::format("analytic = \"sphere_cavity\"\nradius_mm = {}", between(9, 14));
        if (kind == 4)
            text = fmt::format("analytic = \"solid_sphere\"\nradius_mm = {}", between(5, 12));
        if (kind < 5) text = "[volume." + name + "]\n" + text + "\n";
        text += "[surface." + name + "]\n";
        text += kind < 5 ? "volume = \"" + name + "\"\n"
                         : std::string("mesh = \"box.ply\"\nmesh_unit = \"mm\"\nmesh_frame = "
                                       "\"LPS\"\n");
        if (pick(4) == 0) text += fmt::format("strength_n = {}\n", between(0.3, 3.0));
        text += "[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
        if (pick(3) == 0)
            text += fmt::format("[[effect]]\ntype = \"friction\"\nsurface = \"{}\"\nstatic = {}\n"
                                "dynamic = 0.1\n",
                                name, between(0.1, 0.8));
        return text;
    }

    std::mt19937_64 random_;
};

TEST(Touches, OfSurfacesAloneBalanceTheCouplingInEveryFrame) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    int finished = 0, unfinished = 0, several = 0;
    std::vector<double> errors_m; // as a length of the coupling
    for (std::uint64_t seed = 0; seed < kScenes; ++seed) {
        SurfacesDraw draw(seed);
        const std::string text = draw.text();
        const auto scene =
            std::make_shared<const Scene>(parse_scene(text, folder.path() / "scene.toml"),
                                          SceneResources{.files = scene_files()});
        const double stiffness = scene->description().coupling.stiffness_n_per_m;
        test::ScriptedClock clock;
        HapticLoop loop(scene, clock);
        std::uint64_t held = 0; // surfaces that pushed in the frame before
        int frame = 0;
        for (const Vec3& probe : draw.way(kFrames)) {
            SCOPED_TRACE(fmt::format("seed {}, frame {}:\n{}", seed, frame++, text));
            DeviceState state;
            state.position = probe;
            const FrameReport report = loop.frame(state);
            Vec3 sum{0.0};
            std::uint64_t holds = 0;
            for (const Touch& touch : loop.touches()) {
                const std::uint64_t bit = std::uint64_t{1} << touch.surface;
                ASSERT_EQ((held & bit) != 0, touch.phase != Touch::Phase::began);
                ASSERT_NEAR(glm::length(touch.normal), 1.0, 1e-9);
                sum += touch.force;
                if (touch.phase != Touch::Phase::ended) holds |= bit;
            }
            ASSERT_EQ(holds, report.surfaces_felt);
            ASSERT_EQ(loop.touches().size() < 1, (held | holds) == 0);
            several += loop.touches().size() > 1 ? 1 : 0;
            held = holds;
            if ((report.flags & kUnfinished) != 0) {
                ++unfinished;
                continue;
            }
            if (holds == 0) continue;
            ++finished;
            // The forces balance where the last solution has the proxy. That is residual_m away
            // from where the evaluation was made, and so is where the last step went, within its
            // own length. (A surface that leads the proxy balances it where it is.) Rounding: of
            // 0.1 m in doubles, over some hundred operations.
            const double last_step_m =
                loop.path().size() < 2
                    ? 0.0
                    : glm::length(loop.path().back() - loop.path()[loop.path().size() - 2]);
            const double error_m =
                glm::length(sum - stiffness * (report.proxy - probe)) / stiffness;
            ASSERT_LE(error_m, report.residual_m + last_step_m + 1e-12);
            errors_m.push_back(error_m);
        }
    }
    std::sort(errors_m.begin(), errors_m.end());
    const auto share = [&](double s) {
        return errors_m[static_cast<std::size_t>(s * double(errors_m.size() - 1))];
    };
    RecordProperty("balance",
                   fmt::format("median {} m, p99 {} m, max {} m; {} frames, {} "
                               "unfinished, {} with several contacts",
                               share(0.5), share(0.99), share(1.0), finished, unfinished, several));
    // An adaptive frame ends when less than its tolerance, 0.1 um, is expected to be left of its
    // way, and within five of them in any case: a frame's last step leaves no more.
    EXPECT_LE(share(0.99), 0.1e-6);
    EXPECT_LE(share(1.0), 1e-6);
    EXPECT_GT(finished, kFrames * int(kScenes) / 5);
    EXPECT_GT(several, 1000);
    EXPECT_LT(unfinished, finished / 10);
}

} // namespace
} // namespace palpate
