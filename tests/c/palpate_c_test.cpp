// SPDX-License-Identifier: Apache-2.0
// The C interface does what the C++ one does, and refuses what it cannot do.
#include <palpate/palpate_c.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/palpate.h>

#include "tests/c/c_handles.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using test::frame_of;
using test::LoopPtr;
using test::made;
using test::no_error;
using test::parsed;
using test::ScenePtr;
using test::StatePtr;
using test::vec;
using testing::HasSubstr;

const std::string kBall = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n"
                          "[surface.ball]\nvolume = \"v\"\n"
                          "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n"
                          "[[effect]]\ntype = \"friction\"\nsurface = \"ball\"\n"
                          "static = 0.4\ndynamic = 0.3\n";

/// In and out of the ball, along it, with a new trial now and then.
palpate_probe probe_at(int i) {
    palpate_probe probe{};
    probe.size = sizeof probe;
    probe.time_s = 1e-3 * i;
    const double angle = 3e-3 * i;
    const double radius = 0.030 + 0.006 * std::cos(11.0 * angle);
    probe.position_m[0] = radius * std::cos(angle);
    probe.position_m[1] = radius * std::sin(angle);
    probe.position_m[2] = 0.002 * std::sin(7.0 * angle);
    probe.trial = static_cast<std::uint32_t>(i / 900);
    return probe;
}

/// All but the time that it took.
std::array<char, sizeof(palpate_frame)> bits(palpate_frame frame) {
    frame.spent_us = 0.0;
    return std::bit_cast<std::array<char, sizeof(palpate_frame)>>(frame);
}

TEST(PalpateC, FramesAreThoseOfTheCppInterfaceToTheLastBit) {
    const ScenePtr scene = parsed(kBall);
    const LoopPtr loop = made(scene);
    SteadyClock clock;
    HapticLoop same(std::make_shared<const Scene>(parse_scene(kBall, "ball.toml")), clock);
    int felt = 0;
    for (int i = 0; i < 2000; ++i) {
        const palpate_probe probe = probe_at(i);
        const palpate_frame frame = frame_of(loop.get(), probe);
        DeviceState state;
        state.time_s = probe.time_s;
        state.position = vec(probe.position_m);
        state.trial = probe.trial;
        const FrameReport report = same.frame(state);
        ASSERT_EQ(vec(frame.proxy_m), report.proxy) << i;
        ASSERT_EQ(vec(frame.force_n), report.force) << i;
        ASSERT_EQ(vec(frame.probe_m), report.probe);
        ASSERT_EQ(frame.frame, report.frame);
        ASSERT_EQ(frame.time_s, report.time_s);
        ASSERT_EQ(frame.residual_m, report.residual_m);
        ASSERT_EQ(frame.trial, report.trial);
        ASSERT_EQ(frame.sub_steps, report.sub_steps);
        ASSERT_EQ(frame.evaluations, report.evaluations);
        ASSERT_EQ(frame.contacts, report.contacts);
        ASSERT_EQ(frame.flags, report.flags);
        ASSERT_EQ(frame.surfaces_felt, report.surfaces_felt);
        ASSERT_EQ(frame.surfaces_open, report.surfaces_open);
        ASSERT_EQ(frame.surfaces_guarded, report.surfaces_guarded);
        ASSERT_EQ(frame.field_samples, report.field_samples);
        ASSERT_EQ(frame.surface_queries, report.surface_queries);
        ASSERT_EQ(frame.root_queries, report.root_queries);
        size_t corners = 0;
        const double* path = palpate_loop_path(loop.get(), &corners);
        ASSERT_EQ(corners, same.path().size());
        for (size_t c = 0; c < corners; ++c)
            ASSERT_EQ(Vec3(path[3 * c], path[3 * c + 1], path[3 * c + 2]), same.path()[c]);
        felt += frame.surfaces_felt == 1 ? 1 : 0;
    }
    EXPECT_GT(felt, 500) << "else nothing was compared";
    for (int i = 0; i < 100; ++i) {
        double force_n[3] = {9.0, 9.0, 9.0};
        ASSERT_EQ(palpate_loop_release(loop.get(), force_n), PALPATE_OK);
        ASSERT_EQ(vec(force_n), same.release());
    }
}

TEST(PalpateC, ARestoredLoopGoesOnWithTheSameBits) {
    const ScenePtr scene = parsed(kBall);
    const LoopPtr loop = made(scene);
    for (int i = 0; i < 320; ++i)
        frame_of(loop.get(), probe_at(i));
    palpate_error error = no_error();
    palpate_state* saved = nullptr;
    ASSERT_EQ(palpate_loop_save(loop.get(), &saved, &error), PALPATE_OK) << error.message;
    const StatePtr state(saved);
    std::vector<std::array<char, sizeof(palpate_frame)>> frames;
    for (int i = 320; i < 900; ++i)
        frames.push_back(bits(frame_of(loop.get(), probe_at(i))));

    const LoopPtr other = made(scene);
    for (palpate_loop* into : {loop.get(), other.get()}) {
        ASSERT_EQ(palpate_loop_restore(into, state.get(), &error), PALPATE_OK) << error.message;
        for (int i = 320; i < 900; ++i)
            ASSERT_EQ(bits(frame_of(into, probe_at(i))), frames[static_cast<size_t>(i - 320)]) << i;
    }

    const LoopPtr foreign = made(parsed(kBall));
    EXPECT_EQ(palpate_loop_restore(foreign.get(), state.get(), &error), PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr("restore"));
}

TEST(PalpateC, ALoopOutlivesItsScene) {
    ScenePtr scene = parsed(kBall);
    const LoopPtr loop = made(scene);
    scene.reset();
    for (int i = 0; i < 320; ++i)
        EXPECT_TRUE(std::isfinite(frame_of(loop.get(), probe_at(i)).force_n[0]));
}

TEST(PalpateC, OptionsAreThoseOfTheScene) {
    const ScenePtr scene = parsed(kBall);
    palpate_loop_options options{};
    options.size = sizeof options;
    options.method = PALPATE_FIXED;
    options.sub_steps = 5;
    const LoopPtr loop = made(scene, &options);
    std::uint32_t most = 0;
    for (int i = 0; i < 900; ++i)
        most = std::max(most, frame_of(loop.get(), probe_at(i)).evaluations);
    EXPECT_GE(most, 5u);

    palpate_device device{};
    device.size = sizeof device;
    device.force_n = 0.25;
    device.damping_n_s_per_m = 0.1; // pays for k = 200 N/m at 1 kHz, not for the scene's 500
    options.device = &device;
    const LoopPtr limited = made(scene, &options);
    ASSERT_GE(palpate_loop_warning_count(limited.get()), 1u);
    EXPECT_THAT(palpate_loop_warning(limited.get(), 0), HasSubstr("N/m"));
    EXPECT_EQ(palpate_loop_warning(limited.get(), 1000), nullptr);
    double most_n = 0.0;
    for (int i = 0; i < 900; ++i) {
        const Vec3 force = vec(frame_of(limited.get(), probe_at(i)).force_n);
        ASSERT_LE(glm::length(force), 0.25);
        most_n = std::max(most_n, glm::length(force));
    }
    EXPECT_GT(most_n, 0.2);
}

TEST(PalpateC, GainsScaleAndAreRefusedOutOfRange) {
    const ScenePtr scene = parsed(kBall);
    const LoopPtr loop = made(scene);
    ASSERT_EQ(palpate_loop_effect_count(loop.get()), 2u);
    EXPECT_EQ(palpate_loop_set_gain(loop.get(), 0, 0.0), PALPATE_OK);
    for (const double gain : {-0.1, 10.1, std::nan("")})
        EXPECT_EQ(palpate_loop_set_gain(loop.get(), 0, gain), PALPATE_BAD_CALL) << gain;
    EXPECT_EQ(palpate_loop_set_gain(loop.get(), 2, 1.0), PALPATE_BAD_CALL);
    for (int i = 0; i < 300; ++i)
        EXPECT_EQ(vec(frame_of(loop.get(), probe_at(i)).force_n), Vec3(0.0)) << "it is off";
}

/// Method adaptive has nothing to certify here.
const std::string kDrifts = "[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n[[effect]]\n"
                            "type = \"gradient_surface\"\nvolume = \"v\"\n"
                            "strength_n = [[-1e-9, 0], [0, 1e3]]\n";

TEST(PalpateC, ScenesTellWhatIsNotFeltAsTheySay) {
    const ScenePtr drifts = parsed(kDrifts);
    ASSERT_EQ(palpate_scene_warning_count(drifts.get()), 1u);
    EXPECT_THAT(palpate_scene_warning(drifts.get(), 0),
                testing::AllOf(testing::StartsWith("ball.toml: "), HasSubstr("drifts")));
    EXPECT_EQ(palpate_scene_warning(drifts.get(), 1), nullptr);
    EXPECT_EQ(palpate_scene_warning(nullptr, 0), nullptr);
}

TEST(PalpateC, ALoopTellsWhatItsOwnMethodDoesNotCertify) {
    const ScenePtr fixed = parsed(kDrifts + "[loop]\nmethod = \"fixed\"\n");
    EXPECT_EQ(palpate_scene_warning_count(fixed.get()), 0u);
    EXPECT_EQ(palpate_loop_warning_count(made(fixed).get()), 0u);
    palpate_loop_options options{};
    options.size = sizeof options;
    options.method = PALPATE_ADAPTIVE;
    const LoopPtr loop = made(fixed, &options);
    ASSERT_EQ(palpate_loop_warning_count(loop.get()), 1u);
    EXPECT_THAT(palpate_loop_warning(loop.get(), 0), HasSubstr("drifts"));
}

TEST(PalpateC, ScenesTellHowTheirFilesWereRead) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "m.obj", "v 0 0 0\nv 30 0 0\nv 0 30 0\nf 1 2 3\n");
    const ScenePtr scene = parsed("[surface.s]\nmesh = \"" + (folder / "m.obj").string() +
                                  "\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n");
    std::string all;
    for (std::size_t i = 0; i < palpate_scene_warning_count(scene.get()); ++i)
        all += std::string(palpate_scene_warning(scene.get(), i)) + "\n";
    EXPECT_THAT(all, HasSubstr("states no frame"));
    EXPECT_THAT(all, HasSubstr("states no unit"));
}

TEST(PalpateC, OptionsOfAnotherMethodAreRefused) {
    const ScenePtr scene = parsed(kBall);
    palpate_loop_options options{};
    options.size = sizeof options;
    options.sub_steps = 8;
    palpate_error error = no_error();
    palpate_loop* loop = nullptr;
    EXPECT_EQ(palpate_loop_make(scene.get(), &options, &loop, &error), PALPATE_BAD_INPUT);
    EXPECT_EQ(loop, nullptr);
    EXPECT_STREQ(error.message,
                 "palpate_loop_options: sub_steps is of method fixed and changes nothing with "
                 "adaptive; set method, or leave sub_steps 0");
    options = {};
    options.size = sizeof options;
    options.method = PALPATE_SINGLE;
    options.evaluation_cap = 64;
    EXPECT_EQ(palpate_loop_make(scene.get(), &options, &loop, &error), PALPATE_BAD_INPUT);
    EXPECT_EQ(loop, nullptr);
    EXPECT_THAT(error.message, HasSubstr("is of method adaptive and changes nothing with single"));
}

TEST(PalpateC, SurfacesAndFlagsHaveNames) {
    const ScenePtr scene = parsed(kBall);
    ASSERT_EQ(palpate_scene_surface_count(scene.get()), 1u);
    EXPECT_STREQ(palpate_scene_surface(scene.get(), 0), "ball");
    EXPECT_EQ(palpate_scene_surface(scene.get(), 1), nullptr);
    EXPECT_EQ(palpate_scene_warning_count(scene.get()), 0u);
    EXPECT_STREQ(palpate_flag_name(2), "stalled");
    EXPECT_THAT(palpate_flag_meaning(2), HasSubstr("certified"));
    for (const std::uint32_t bit : {31u, 32u, 4000000000u})
        EXPECT_EQ(palpate_flag_name(bit), nullptr) << bit;
    EXPECT_STREQ(palpate_version(), kVersion);
    EXPECT_EQ(palpate_abi(), static_cast<std::uint32_t>(PALPATE_C_ABI));
}

struct Mistake {
    std::string name, text, says;
};

class MistakesC : public testing::TestWithParam<Mistake> {};

TEST_P(MistakesC, AreRefusedWithTheLineOfTheScene) {
    palpate_error error = no_error();
    palpate_scene* scene = nullptr;
    EXPECT_EQ(palpate_scene_parse(GetParam().text.c_str(), "ball.toml", nullptr, &scene, &error),
              PALPATE_BAD_INPUT);
    EXPECT_EQ(scene, nullptr);
    EXPECT_EQ(error.code, PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr(GetParam().says));
    EXPECT_EQ(std::strchr(error.message, '\n'), nullptr);
}

INSTANTIATE_TEST_SUITE_P(
    Scene, MistakesC,
    testing::Values(Mistake{"Syntax", "[volume.v\n", "ball.toml:1"},
                    Mistake{"Key", kBall + "[loop]\nrat_hz = 1000\n", "rate_hz"},
                    Mistake{"Range", kBall + "[loop]\nrate_hz = -1\n", "ball.toml:15"},
                    Mistake{"File", "[volume.v]\nfile = \"none.nrrd\"\n", "none.nrrd"}),
    [](const auto& made) { return made.param.name; });

TEST(PalpateC, ABadCallChangesNothingAndSaysWhatItWas) {
    palpate_error error = no_error();
    palpate_scene* scene = nullptr;
    palpate_loop* loop = nullptr;
    EXPECT_EQ(palpate_scene_read(nullptr, nullptr, &scene, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("NULL"));
    EXPECT_EQ(palpate_scene_read("none.toml", nullptr, &scene, &error), PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr("none.toml"));
    EXPECT_EQ(palpate_scene_read("none.toml", nullptr, nullptr, nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_make(nullptr, nullptr, &loop, &error), PALPATE_BAD_CALL);

    const ScenePtr ball = parsed(kBall);
    palpate_scene_options unsized{};
    EXPECT_EQ(palpate_scene_parse(kBall.c_str(), "b", &unsized, &scene, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("size"));
    palpate_loop_options options{};
    EXPECT_EQ(palpate_loop_make(ball.get(), &options, &loop, &error), PALPATE_BAD_CALL);
    options.size = sizeof options;
    options.method = 77;
    EXPECT_EQ(palpate_loop_make(ball.get(), &options, &loop, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("method"));
    options.method = PALPATE_METHOD_OF_SCENE;
    options.rate_hz = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(palpate_loop_make(ball.get(), &options, &loop, &error), PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr("rate_hz"));
    options.rate_hz = 0.0;
    palpate_device device{};
    device.size = sizeof device;
    options.device = &device;
    EXPECT_EQ(palpate_loop_make(ball.get(), &options, &loop, &error), PALPATE_BAD_CALL);
    EXPECT_THAT(std::string(error.message), HasSubstr("force_n"));
    device.force_n = 3.0;
    device.delay_s = -1.0;
    EXPECT_EQ(palpate_loop_make(ball.get(), &options, &loop, &error), PALPATE_BAD_INPUT);
    EXPECT_THAT(std::string(error.message), HasSubstr("delay_s"));
    EXPECT_EQ(loop, nullptr);

    const LoopPtr whole = made(ball);
    palpate_probe probe = probe_at(0);
    palpate_frame frame{};
    EXPECT_EQ(palpate_loop_frame(whole.get(), &probe, &frame), PALPATE_BAD_CALL);
    frame.size = sizeof frame;
    EXPECT_EQ(palpate_loop_frame(nullptr, &probe, &frame), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_frame(whole.get(), &probe, nullptr), PALPATE_BAD_CALL);
    probe.size = 8;
    EXPECT_EQ(palpate_loop_frame(whole.get(), &probe, &frame), PALPATE_BAD_CALL);
    EXPECT_EQ(frame_of(whole.get(), probe_at(0)).frame, 0u) << "none of them was a frame";
    EXPECT_EQ(palpate_loop_release(whole.get(), nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_save(whole.get(), nullptr, nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_restore(whole.get(), nullptr, nullptr), PALPATE_BAD_CALL);
    palpate_scene_free(nullptr);
    palpate_loop_free(nullptr);
    palpate_state_free(nullptr);
}

TEST(PalpateC, ALongMessageIsCutAndEnded) {
    const std::string key(5000, 'k');
    palpate_error error = no_error();
    std::memset(error.message, '#', sizeof error.message);
    palpate_scene* scene = nullptr;
    EXPECT_EQ(palpate_scene_parse((key + " = 1\n").c_str(), "ball.toml", nullptr, &scene, &error),
              PALPATE_BAD_INPUT);
    const std::string message = error.message;
    EXPECT_EQ(message.size(), sizeof error.message - 1);
    EXPECT_TRUE(message.ends_with("...")) << message;
}

TEST(PalpateC, ALongMessageIsCutBetweenCharacters) {
    const std::string euro = "\u20AC"; // three bytes
    for (const char* before : {"", "k", "kk"}) {
        std::string name = before;
        for (int i = 0; i < 1000; ++i)
            name += euro;
        palpate_error error = no_error();
        palpate_scene* scene = nullptr;
        EXPECT_EQ(palpate_scene_parse("a = 1\n", name.c_str(), nullptr, &scene, &error),
                  PALPATE_BAD_INPUT);
        const std::string message = error.message;
        ASSERT_TRUE(message.ends_with(euro + "...")) << message;
        EXPECT_GE(message.size(), sizeof error.message - euro.size()) << "as long as there is room";
    }
}

TEST(PalpateC, AProgramOfALaterVersionGivesMoreAndKeepsWhatIsBehind) {
    struct Later {
        palpate_frame frame;
        double more;
    } later{};
    later.frame.size = sizeof later;
    later.more = 42.0;
    const ScenePtr scene = parsed(kBall);
    const LoopPtr loop = made(scene);
    const palpate_probe probe = probe_at(5);
    ASSERT_EQ(palpate_loop_frame(loop.get(), &probe, &later.frame), PALPATE_OK);
    EXPECT_EQ(later.frame.size, sizeof later);
    EXPECT_EQ(vec(later.frame.probe_m), vec(probe.position_m));
    EXPECT_EQ(later.more, 42.0);
}

// Found by the fuzz target of calls: half of a pointer was taken for one.
TEST(PalpateC, ASizeThatEndsWithinAPointerIsRefused) {
    palpate_scene_options options{};
    palpate_error error{};
    error.size = sizeof error;
    const test::DataPtr data = test::no_data();
    options.data = data.get();
    palpate_scene* scene = nullptr;
    for (std::size_t size = offsetof(palpate_scene_options, data) + 1; size < sizeof options;
         ++size) {
        options.size = size;
        EXPECT_EQ(palpate_scene_parse("", "a.toml", &options, &scene, &error), PALPATE_BAD_CALL);
        EXPECT_STREQ(error.message, "palpate_scene_options: no struct has this size; set it to "
                                    "sizeof(palpate_scene_options)");
    }
}

TEST(PalpateC, AProgramOfAnEarlierVersionIsServedAsItWas) {
    // What is behind the members that its header had is none of its struct.
    palpate_scene_options scene_options{};
    scene_options.size = offsetof(palpate_scene_options, data);
    scene_options.data = reinterpret_cast<const palpate_data*>(std::uintptr_t{1});
    const ScenePtr scene = parsed(kBall, &scene_options);
    palpate_loop_options options{};
    options.size = offsetof(palpate_loop_options, recorded_frames);
    options.recorded_frames = ~std::uint64_t{0};
    const LoopPtr loop = made(scene, &options);
    frame_of(loop.get(), probe_at(0));
    EXPECT_EQ(palpate_loop_recorded_frames(loop.get()), 0u);
}

TEST(PalpateC, AStaleOrAbsurdProbeLetsTheForceGoToZero) {
    const ScenePtr scene = parsed(kBall);
    const LoopPtr loop = made(scene);
    for (int i = 0; i < 150; ++i)
        frame_of(loop.get(), probe_at(i));
    palpate_probe probe = probe_at(150);
    for (int i = 0; i < 100; ++i) {
        probe.time_s += 1e-3;
        probe.is_stale = i % 2;
        probe.position_m[0] = i % 2 ? 0.028 : std::nan("");
        const palpate_frame frame = frame_of(loop.get(), probe);
        ASSERT_TRUE(is_finite(vec(frame.force_n)));
        if (i > 50) {
            ASSERT_EQ(vec(frame.force_n), Vec3(0.0)) << i;
        }
    }
}

} // namespace
} // namespace palpate
