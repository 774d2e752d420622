// SPDX-License-Identifier: Apache-2.0
// A loop inside a program that has threads, signal handlers and a floating-point mode of its own:
// it leaves all of that alone, and says nothing.
#include <array>
#include <cfenv>
#include <clocale>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>

#include "tests/support/one_of_each.h"
#include "tests/support/phantom.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

#ifdef __linux__
#include <fcntl.h>
#include <unistd.h>

namespace palpate {
namespace {

constexpr int kSignals = 64;
constexpr int kTrapped = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW;

/// What a process has once, as far as a library could change it.
struct Process {
    std::vector<std::string> handlers;
    std::terminate_handler terminate = std::get_terminate();
    std::new_handler no_memory = std::get_new_handler();
    std::string locale = std::setlocale(LC_ALL, nullptr);
    std::filesystem::path folder = std::filesystem::current_path();
    std::vector<std::string> environment;

    Process() {
        for (int number = 1; number <= kSignals; ++number) {
            struct sigaction action {};
            if (sigaction(number, nullptr, &action) != 0) continue;
            handlers.emplace_back(reinterpret_cast<const char*>(&action.sa_handler),
                                  sizeof action.sa_handler);
        }
        for (char** variable = environ; *variable; ++variable)
            environment.emplace_back(*variable);
    }
    friend bool operator==(const Process&, const Process&) = default;
};

/// What is written to standard output and standard error while it lives.
class Output {
public:
    explicit Output(const std::filesystem::path& file) : file_(file) {
        std::fflush(nullptr);
        const int to = open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
        for (std::size_t i = 0; i < saved_.size(); ++i) {
            saved_[i] = dup(static_cast<int>(i) + 1);
            dup2(to, static_cast<int>(i) + 1);
        }
        close(to);
    }
    std::string end() {
        std::fflush(nullptr);
        for (std::size_t i = 0; i < saved_.size(); ++i) {
            dup2(saved_[i], static_cast<int>(i) + 1);
            close(saved_[i]);
        }
        return test::content_of(file_);
    }

private:
    std::filesystem::path file_;
    std::array<int, 2> saved_{};
};

DeviceState hand_at(int frame) {
    DeviceState state;
    state.time_s = 1e-3 * frame;
    const double angle = 5e-3 * frame, distance_m = 0.028 + 0.003 * std::sin(0.02 * frame);
    state.position = distance_m * Vec3{std::cos(angle), std::sin(angle), 0.0};
    return state;
}

std::vector<Vec3> forces_of(HapticLoop& loop, int frames) {
    std::vector<Vec3> forces;
    for (int frame = 0; frame < frames; ++frame)
        forces.push_back(loop.frame(hand_at(frame)).force);
    return forces;
}

void ignore(int) {}

TEST(Host, KeepsItsHandlersItsFolderAndItsOutput) {
    std::signal(SIGTERM, ignore);
    std::signal(SIGFPE, ignore);
    const test::TemporaryFolder folder;
    const auto scene = test::one_of_each_scene(); // not without files: it reads a mesh
    const Process before;
    Output output(folder / "said.txt");
    {
        const auto own = std::make_shared<const Scene>(scene->description(),
                                                       SceneResources{.files = scene_files()});
        test::ScriptedClock clock;
        HapticLoop loop(own, clock);
        forces_of(loop, 200);
        loop.restore(loop.save());
        loop.adopt(scene);
        loop.set_gain(0, std::nan(""));
        loop.set_pose(99, {});
        DeviceState lost = hand_at(0);
        lost.position.x = std::nan("");
        loop.frame(lost);
        forces_of(loop, 50);
    }
    EXPECT_EQ(output.end(), "");
    EXPECT_TRUE(Process() == before);
    std::signal(SIGTERM, SIG_DFL);
    std::signal(SIGFPE, SIG_DFL);
}

/// A mode that no frame would choose, and what the thread had before.
class HostsMode {
public:
    HostsMode() {
        fegetenv(&before_);
        std::fesetround(FE_UPWARD);
        std::feclearexcept(FE_ALL_EXCEPT);
        feenableexcept(kTrapped);
    }
    ~HostsMode() { fesetenv(&before_); }
    HostsMode(const HostsMode&) = delete;
    HostsMode& operator=(const HostsMode&) = delete;

private:
    std::fenv_t before_;
};

#ifdef __x86_64__
TEST(Host, KeepsItsFloatingPointModeAndTheFramesKeepTheirBits) {
    const auto scene = test::one_of_each_scene();
    test::ScriptedClock clock;
    HapticLoop usual(scene, clock), loop(scene, clock);
    const std::vector<Vec3> expected = forces_of(usual, 300);
    std::vector<Vec3> forces;
    bool kept = true;
    std::vector<DeviceState> hands; // made in the usual mode: their bits depend on it
    for (int frame = 0; frame < 300; ++frame)
        hands.push_back(hand_at(frame));
    {
        const HostsMode mode;
        for (const DeviceState& hand : hands) {
            forces.push_back(loop.frame(hand).force);
            EXPECT_FALSE(loop.set_gain(0, std::nan("")));
            EXPECT_FALSE(loop.set_pose(0, {Vec3{std::nan("")}, {1, 0, 0, 0}}));
            loop.surface_states();
            loop.touches();
            loop.wrench(0);
            kept = kept && std::fegetround() == FE_UPWARD && fegetexcept() == kTrapped &&
                   std::fetestexcept(kTrapped) == 0;
        }
    }
    EXPECT_TRUE(kept);
    EXPECT_EQ(forces, expected);
}
#endif

TEST(Host, LoopsOfItsOwnThreadsHaveTheBitsOfOne) {
    const auto scene = test::one_of_each_scene();
    test::ScriptedClock clock;
    HapticLoop alone(scene, clock);
    const std::vector<Vec3> expected = forces_of(alone, 300);
    std::array<std::vector<Vec3>, 4> forces;
    std::vector<std::thread> threads;
    for (std::vector<Vec3>& of_thread : forces)
        threads.emplace_back([&] {
            test::ScriptedClock own_clock;
            HapticLoop loop(scene, own_clock);
            of_thread = forces_of(loop, 300);
        });
    for (std::thread& thread : threads)
        thread.join();
    for (const std::vector<Vec3>& of_thread : forces)
        EXPECT_EQ(of_thread, expected);
}

} // namespace
} // namespace palpate
#endif
