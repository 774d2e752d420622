// SPDX-License-Identifier: Apache-2.0
// Scenes, loops, devices and effects made in code, of numbers as good as any: what is refused is
// refused by name, and what runs sends nothing that is no number, too long or too sudden.
// PALPATE_RANDOM_SCENES=1000000 test_stability --gtest_filter=RandomScenes.*     the long run
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/haptics/hand/safety_chain.h>

#include "tests/support/mesh_text.h"
#include "tests/support/random_scenes.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::absurd;
using test::absurd_vector;
using test::any_vector;
using test::between;
using test::chance;
using test::Field;
using test::Made;
using test::Maker;
using test::of_any_size;
using test::pick;
using test::Random;

constexpr int kFrames = 50;
// Of lengths that were scaled and added, and of the last step of a fade.
constexpr double kRounding = 1.0 + 1e-8;

/// An effect of somebody's own that may do anything.
class Wild final : public Effect {
public:
    explicit Wild(std::uint64_t seed) : random_(seed), absurd_(between(random_, 0.0, 0.1)) {}

    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
        switch (pick(random_, 6)) {
        case 0:
            return primitives.add({place(proxy), vector(1.0), number(3.0)});
        case 1:
            return primitives.add_line({place(proxy), vector(1.0), number(3.0)});
        case 2:
            return primitives.add_point({place(proxy), number(3.0)});
        case 3:
            return primitives.add_force(vector(3.0));
        case 4:
            return primitives.add_spring(place(proxy), number(100.0));
        default:
            return;
        }
    }
    Vec3 device_force_n() const noexcept override { return vector(1.0); }
    double unasked_force_n() const noexcept override { return number(1.0); }
    bool is_active() const noexcept override { return chance(random_, 0.5); }
    QueryCount queries() const noexcept override { return {}; }

private:
    double number(double size) const noexcept {
        return chance(random_, absurd_) ? absurd(random_) : between(random_, 0.0, size);
    }
    Vec3 vector(double size) const noexcept {
        return chance(random_, absurd_) ? absurd_vector(random_) : any_vector(random_, size);
    }
    Vec3 place(const Vec3& proxy) const noexcept {
        return chance(random_, absurd_) ? absurd_vector(random_)
                                        : proxy + any_vector(random_, 0.01);
    }

    mutable Random random_;
    double absurd_;
};

std::vector<std::unique_ptr<Effect>> wild_effects(Random& random) {
    std::vector<std::unique_ptr<Effect>> effects;
    for (int i = pick(random, 6) - 3; i > 0; --i)
        effects.push_back(std::make_unique<Wild>(random()));
    return effects;
}

/// A hand that goes to and fro through everything, on a device that may say anything.
class Hand {
public:
    explicit Hand(Random& random)
        : random_(random), position_(any_vector(random, 0.04)),
          odd_(chance(random, 0.5) ? 0.05 : 0.0) {}

    DeviceState next(int frame, double period_s) {
        if (frame % 10 == 0) velocity_ = any_vector(random_, of_any_size(random_, 1e-3, 10.0));
        position_ += period_s * velocity_;
        DeviceState state;
        state.time_s = odd() ? absurd(random_) : period_s * frame;
        state.position = odd() ? absurd_vector(random_) : position_;
        state.velocity = odd() ? absurd_vector(random_) : velocity_;
        if (odd()) state.freshness = Freshness::stale;
        if (odd()) ++trial_;
        state.trial = trial_;
        return state;
    }

private:
    bool odd() { return chance(random_, odd_); }

    Random& random_;
    Vec3 position_;
    Vec3 velocity_{0.0};
    double odd_;
    std::uint32_t trial_ = 0;
};

/// Whether a force may follow another: finite, within both limits, no further than the slew limit
/// allows; on its way to zero after a fault, than the fade of a device with motors.
std::string wrong_with(const Vec3& now, const Vec3& before, const Made& made) {
    if (!is_finite(now)) return "a force that is not finite";
    const bool motors = made.device.force_n > 0.0;
    const double scenes_n = made.scene.limits.force_n;
    const double limit_n = motors ? std::min(scenes_n, made.device.force_n) : scenes_n;
    if (glm::length(now) > limit_n) return "a force beyond the limit";
    const double period_s = 1.0 / made.loop.rate_hz;
    const double rounding_n = (kRounding - 1.0) * limit_n;
    const double change = glm::length(now - before);
    if (change <= period_s * made.scene.limits.slew_n_per_s + rounding_n) return "";
    const double fade = period_s * limit_n / SafetySettings{}.fade_s;
    const bool fades = motors && change <= fade + rounding_n &&
                       glm::length(now) + change <= glm::length(before) * kRounding;
    return fades ? "" : "a force beyond the slew limit";
}

/// A pose that a program may set, as good as any, or none at all.
RigidPose any_pose(Random& random) {
    if (chance(random, 0.1)) return {absurd_vector(random), {absurd(random), 0.0, 1.0, 0.0}};
    const Vec3 turn = any_vector(random, of_any_size(random, 1e-4, 3.0));
    return {any_vector(random, of_any_size(random, 1e-5, 0.1)),
            Quaternion(1.0, turn.x, turn.y, turn.z)};
}

/// Runs a loop; what is wrong with it, or nothing.
std::string run(HapticLoop& loop, const std::shared_ptr<const Scene>& scene, const Made& made,
                Random& random) {
    Hand hand(random);
    Vec3 before{0.0};
    for (int frame = 0; frame < kFrames; ++frame) {
        if (chance(random, 0.2))
            loop.set_pose(static_cast<std::size_t>(pick(random, 3)), any_pose(random));
        if (chance(random, 0.01)) loop.adopt(scene);
        if (chance(random, 0.01)) loop.restore(loop.save());
        if (chance(random, 0.02) && loop.effect_count() > 0)
            loop.set_gain(
                static_cast<std::size_t>(pick(random, static_cast<int>(loop.effect_count()))),
                absurd(random));
        if (chance(random, 0.02) && loop.effect_count() > 0)
            loop.set_gain(
                static_cast<std::size_t>(pick(random, static_cast<int>(loop.effect_count()))),
                between(random, 0.0, 10.0));
        const FrameReport report = loop.frame(hand.next(frame, 1.0 / made.loop.rate_hz));
        std::string wrong = wrong_with(report.force, before, made);
        if (wrong.empty() && !is_finite(report.proxy)) wrong = "a proxy that is not finite";
        if (!wrong.empty()) return wrong + " in frame " + std::to_string(frame);
        before = report.force;
    }
    return "";
}

struct Tally {
    int refused = 0;
    int ran = 0;
};

/// One scene; what is wrong with it, or nothing.
std::string try_scene(std::uint64_t seed, const std::filesystem::path& mesh, Tally& tally) {
    Maker maker(seed, mesh);
    const std::unique_ptr<Made> made = maker.make();
    Random& random = maker.random();
    std::vector<std::string> spoilt;
    const auto spoil = [&](Field& field) {
        field.spoil(random);
        spoilt.push_back(field.name);
    };
    if (seed % 3 == 1)
        spoil(made->fields[static_cast<std::size_t>(
            pick(random, static_cast<int>(made->fields.size())))]);
    if (seed % 3 == 2)
        for (Field& field : made->fields)
            if (chance(random, 0.1)) spoil(field);
    try {
        const auto scene =
            std::make_shared<const Scene>(made->scene, SceneResources{.files = scene_files()});
        test::ScriptedClock clock(30.0);
        HapticLoop loop(scene, clock, made->loop, made->device, wild_effects(random));
        ++tally.ran;
        return run(loop, scene, *made, random);
    } catch (const std::out_of_range& error) {
        return std::string("out_of_range: ") + error.what();
    } catch (const std::exception& error) {
        ++tally.refused;
        const std::string message = error.what();
        const bool named = std::any_of(spoilt.begin(), spoilt.end(), [&](const std::string& name) {
            const std::size_t bar = name.find('|');
            const std::string part = bar == std::string::npos ? name : name.substr(bar + 1);
            return message.find(name.substr(0, bar)) != std::string::npos ||
                   message.find(part) != std::string::npos;
        });
        return named ? "" : "a refusal that names none of its fields: " + message;
    }
}

/// Which scenes are tried: PALPATE_RANDOM_SCENES="COUNT", or "FIRST+COUNT" for a part of more.
struct Chosen {
    std::uint64_t first = 0;
    std::uint64_t count = 3000;
};

Chosen scenes_to_try() {
    Chosen chosen;
    const char* const wanted = std::getenv("PALPATE_RANDOM_SCENES");
    if (!wanted) return chosen;
    char* end = nullptr;
    chosen.count = std::strtoull(wanted, &end, 10);
    if (*end != '+') return chosen;
    chosen.first = std::exchange(chosen.count, std::strtoull(end + 1, nullptr, 10));
    return chosen;
}

// Seen, where only the reader of scene files looked at ranges: 2,998 N and NaN on a device of 3.3
// N.
TEST(RandomScenes, AreRefusedByNameOrSendNothingBeyondTheLimits) {
    const test::TemporaryFolder folder;
    const std::filesystem::path mesh = folder / "ball.ply";
    test::make_file(mesh, test::ascii_ply(test::icosphere(20.0, 1)));
    Tally tally;
    int wrong = 0;
    const auto [first, count] = scenes_to_try();
    for (std::uint64_t seed = first; seed < first + count && wrong < 20; ++seed) {
        const std::string what = try_scene(seed, mesh, tally);
        if (what.empty()) continue;
        ++wrong;
        ADD_FAILURE() << "scene " << seed << ": " << what;
    }
    RecordProperty("refused", tally.refused);
    RecordProperty("ran", tally.ran);
    std::cout << tally.ran << " scenes ran, " << tally.refused << " were refused\n";
    EXPECT_GT(tally.ran, static_cast<int>(count / 3));
    EXPECT_GT(tally.refused, static_cast<int>(count / 10));
}

} // namespace
} // namespace palpate
