// SPDX-License-Identifier: Apache-2.0
// A loop's state is a value, whatever the scene: frames after a restore are those that followed the
// save, to the last bit; and nothing of the state could be left out.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/loop/internal/loop_state_parts.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/same_reports.h"
#include "tests/support/scene_texts.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

constexpr std::uint64_t kScenes = 192;
constexpr int kFrames = 400;
constexpr int kSaves = 3;   // in each run
constexpr int kGoesOn = 60; // frames that are compared after each
constexpr double kClockStep_us = 7.0;
constexpr int kFoundOften = 3; // what was left out, before it is looked for no more

struct Input {
    DeviceState device;
    std::size_t effect = 0; // its gain is set before the frame
    double gain = -1.0;     // out of range: none is
};

/// A random scene with a hand's way through it: at rest and in leaps, in two trials, with gains
/// that move, and with silences and positions that are none.
struct Case {
    Case(std::uint64_t seed, const std::filesystem::path& folder) : draw(seed), random(seed) {
        text = draw.text();
        scene = std::make_shared<const Scene>(parse_scene(text, folder / "scene.toml"),
                                              SceneResources{.files = scene_files()});
        if (seed % 2 == 1) { // the whole safety chain
            device.name = "motors";
            device.force_n = 4.0;
            device.damping_n_s_per_m = 0.5;
            device.delay_s = 0.7e-3;
            device.position_step_m = 20e-6;
        }
        const std::size_t effects = loop()->effect_count();
        for (const Vec3& probe : draw.way(kFrames)) {
            const int frame = static_cast<int>(inputs.size());
            Input input;
            input.device.time_s = frame / scene->description().loop.rate_hz;
            input.device.position = probe;
            input.device.trial = frame < kFrames / 2 ? 0 : 1;
            const std::uint64_t event = random() % 80;
            if (event == 0) input.device.freshness = Freshness::stale;
            if (event == 1) input.device.position.x = std::numeric_limits<double>::quiet_NaN();
            if (event == 2) {
                input.effect = random() % (effects + 1);
                input.gain = 0.5 * double(random() % 4);
            }
            inputs.push_back(input);
        }
    }

    std::unique_ptr<HapticLoop> loop() {
        return std::make_unique<HapticLoop>(scene, clock, scene->description().loop, device);
    }
    FrameReport frame(HapticLoop& loop, int i) const {
        const Input& input = inputs[static_cast<std::size_t>(i)];
        loop.set_gain(input.effect, input.gain);
        return loop.frame(input.device);
    }
    static std::vector<Touch> touches(HapticLoop& loop) {
        return {loop.touches().begin(), loop.touches().end()};
    }
    int last_of(int first) const { return std::min(first + kGoesOn, kFrames); }
    /// The first frame from `first` on that is not as it was, with what differs; empty: none.
    std::string first_difference(HapticLoop& loop, int first) const {
        for (int i = first; i < last_of(first); ++i) {
            const std::string names =
                test::difference(frame(loop, i), reports[static_cast<std::size_t>(i)]);
            if (!names.empty()) return "frame " + std::to_string(i) + ": " + names;
            if (touches(loop) != touched[static_cast<std::size_t>(i)])
                return "frame " + std::to_string(i) + ": touches";
        }
        return {};
    }

    test::SceneTextDraw draw;
    std::mt19937_64 random;
    std::string text;
    std::shared_ptr<const Scene> scene;
    test::ScriptedClock clock{kClockStep_us};
    DeviceProperties device;
    std::vector<Input> inputs;
    std::vector<FrameReport> reports;        // of the run that the others are compared with
    std::vector<std::vector<Touch>> touched; // the same
};

struct Saved {
    int frame; // the first one after it
    LoopState state;
};

/// Runs a case for the first time, and saves its state in between.
std::vector<Saved> run(Case& one, HapticLoop& loop) {
    std::vector<int> at;
    for (int i = 0; i < kSaves; ++i)
        at.push_back(static_cast<int>(one.random() % (kFrames - 1)));
    std::vector<Saved> saved;
    for (int i = 0; i < kFrames; ++i) {
        if (std::find(at.begin(), at.end(), i) != at.end()) saved.push_back({i, loop.save()});
        one.reports.push_back(one.frame(loop, i));
        one.touched.push_back(Case::touches(loop));
    }
    std::shuffle(saved.begin(), saved.end(), one.random);
    return saved;
}

TEST(LoopState, OfRandomScenesOfEverythingGivesTheSameBitsAgain) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    for (std::uint64_t seed = 0; seed < kScenes; ++seed) {
        Case one(seed, folder.path());
        const auto loop = one.loop(), another = one.loop();
        for (const Saved& saved : run(one, *loop)) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", saved before frame " +
                         std::to_string(saved.frame) + ":\n" + one.text);
            for (HapticLoop* again : {loop.get(), another.get()}) {
                again->restore(saved.state);
                ASSERT_EQ(one.first_difference(*again, saved.frame), "");
            }
        }
    }
}

/// A part of the state, as it would be if it had been left out.
struct Part {
    const char* name;
    std::function<void(internal::LoopStateParts&, const internal::LoopStateParts& fresh)> leave_out;
};

/// Takes over one member of each part of a list.
template <class List, class Member>
void take_over(List& to, const List& from, Member member) {
    for (std::size_t i = 0; i < to.size(); ++i)
        to[i].*member = from[i].*member;
}

const std::vector<Part>& parts_of_a_state() {
    using Parts = internal::LoopStateParts;
    using Surface = LoopSurface::State;
    using OfEffect = LoopEffect::State;
    static const std::vector<Part> parts{
        {"all but the count of frames",
         [](Parts& p, const Parts& fresh) {
             const std::uint64_t frames = p.frames;
             p = fresh;
             p.frames = frames;
         }},
        {"contacts",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.surfaces, fresh.subdivision.surfaces, &Surface::contact);
         }},
        {"magnets",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.surfaces, fresh.subdivision.surfaces, &Surface::magnet);
         }},
        {"level banks",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.surfaces, fresh.subdivision.surfaces, &Surface::bank);
         }},
        {"what pushed",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.surfaces, fresh.subdivision.surfaces, &Surface::pushes_back);
         }},
        {"gains of surfaces",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.surfaces, fresh.subdivision.surfaces, &Surface::gains);
         }},
        {"effects",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.effects, fresh.subdivision.effects, &OfEffect::effect);
         }},
        {"gains of effects",
         [](Parts& p, const Parts& fresh) {
             take_over(p.subdivision.effects, fresh.subdivision.effects, &OfEffect::gain);
         }},
        {"targets of gains",
         [](Parts& p, const Parts&) {
             for (OfEffect& effect : p.subdivision.effects)
                 effect.gain.wanted = effect.gain.now;
         }},
        {"friction",
         [](Parts& p, const Parts& fresh) { p.subdivision.friction = fresh.subdivision.friction; }},
        {"calming",
         [](Parts& p, const Parts& fresh) { p.subdivision.calming = fresh.subdivision.calming; }},
        {"estimate of a step's time",
         [](Parts& p, const Parts& fresh) { p.subdivision.stepping = fresh.subdivision.stepping; }},
        {"shared samples", [](Parts& p, const Parts& fresh) { p.fields = fresh.fields; }},
        {"safety chain", [](Parts& p, const Parts& fresh) { p.safety = fresh.safety; }},
        {"velocity estimator",
         [](Parts& p, const Parts& fresh) { p.velocity_estimator = fresh.velocity_estimator; }},
        {"count of frames", [](Parts& p, const Parts& fresh) { p.frames = fresh.frames; }},
        {"whether it has begun", [](Parts& p, const Parts& fresh) { p.started = fresh.started; }},
        {"trial", [](Parts& p, const Parts&) { p.trial = 7; }},
        {"proxy", [](Parts& p, const Parts& fresh) { p.proxy = fresh.proxy; }},
    };
    return parts;
}

// Negative control: the comparison above would find each part of the state if it were left out. But
// for what the last evaluation was drawn by, which no random scene needs, and for where a contact
// was that ends in the very next frame (Touches.AreOnlyOfWhatTheLoopHasComputedSinceARestore).
TEST(LoopState, NoPartOfItCanBeLeftOut) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    std::map<std::string, int> found;
    for (std::uint64_t seed = 0; seed < kScenes; ++seed) {
        Case one(seed, folder.path());
        const auto loop = one.loop();
        const LoopState fresh = one.loop()->save();
        for (const Saved& saved : run(one, *loop))
            for (const Part& part : parts_of_a_state()) {
                if (found[part.name] == kFoundOften) continue;
                auto parts = std::make_shared<internal::LoopStateParts>(*saved.state.parts());
                part.leave_out(*parts, *fresh.parts());
                loop->restore(LoopState(parts));
                if (!one.first_difference(*loop, saved.frame).empty()) ++found[part.name];
            }
    }
    for (const Part& part : parts_of_a_state())
        EXPECT_EQ(found[part.name], kFoundOften) << part.name;
}

// A frame's first plane of a magnet round an edge is the one under the pull, which is by then that
// of the last evaluation: of the force, too.
TEST(LoopState, HasWhatTheLastEvaluationWasDrawnBy) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    const auto scene = std::make_shared<const Scene>(
        parse_scene(
            "[loop]\nmethod = \"single\"\n[surface.box]\nmesh = \"box.ply\"\nmesh_unit = \"mm\"\n"
            "mesh_frame = \"LPS\"\n[[effect]]\ntype = \"surface\"\nsurface = \"box\"\n"
            "[[effect]]\ntype = \"magnet\"\nsurface = \"box\"\nstrength_n = 0.6\ncapture_mm = 3\n"
            "[[effect]]\ntype = \"constant_force\"\nforce_n = [0.8, -0.3, 0]\n",
            folder / "scene.toml"),
        SceneResources{.files = scene_files()});
    test::ScriptedClock clock(kClockStep_us);
    HapticLoop loop(scene, clock);
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> any(-1.5e-3, 1.5e-3);
    const auto around_the_edge = [&] { // of x = 9 mm and y = 8 mm
        DeviceState state;
        state.position = Vec3{9e-3, 8e-3, 0.0} + Vec3{any(random), any(random), any(random)};
        return state;
    };
    int differ = 0;
    for (int i = 0; i < 500; ++i) {
        loop.frame(around_the_edge());
        const LoopState state = loop.save();
        const DeviceState next = around_the_edge();
        const FrameReport first = loop.frame(next);
        loop.restore(state);
        EXPECT_EQ(test::difference(loop.frame(next), first), "");
        auto without = std::make_shared<internal::LoopStateParts>(*state.parts());
        without->subdivision.primitives.clear();
        loop.restore(LoopState(without));
        differ += test::difference(loop.frame(next), first).empty() ? 0 : 1;
    }
    EXPECT_GT(differ, 0);
}

} // namespace
} // namespace palpate
