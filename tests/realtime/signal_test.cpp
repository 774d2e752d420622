// SPDX-License-Identifier: Apache-2.0
// A run at the clock's pace that a signal ends, in a child process: its device is left without
// force and stopped, and what it recorded is there.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

/// What the child's device says of itself, in memory that both processes see.
struct Shared {
    std::atomic<std::uint64_t> forces{0}; // written that were not zero
    std::atomic<bool> is_pushing{false};  // the last force
    std::atomic<int> stops{0};
    std::atomic<int> forces_after_stop{0};
    std::atomic<bool> is_stuck{false}; // the recorder has stopped to look
};

/// A handle that is held 5 mm deep in the ball after a while outside of it, and comes out again
/// every second: after a gap in the frames no force is sent before little is wanted.
class WatchedDevice final : public HapticDevice {
public:
    explicit WatchedDevice(Shared& shared) : shared_(shared) {}
    DeviceProperties properties() const override {
        DeviceProperties properties;
        properties.name = "watched";
        properties.force_n = 10.0;
        return properties;
    }
    bool read(DeviceState& state) noexcept override {
        state = DeviceState{};
        const auto turn = static_cast<double>(reads_ % 1000);
        const double share = std::clamp(0.005 * std::min(turn, 800.0 - turn), 0.0, 1.0);
        state.time_s = 1e-3 * static_cast<double>(reads_++);
        state.position = {0.0, 0.0, 0.055 - 0.01 * share};
        return true;
    }
    void write(const Vec3& force) noexcept override {
        const bool pushes = force != Vec3{0.0};
        shared_.is_pushing = pushes;
        if (pushes) ++shared_.forces;
        if (pushes && shared_.stops > 0) ++shared_.forces_after_stop;
    }
    void stop() noexcept override { ++shared_.stops; }

private:
    Shared& shared_;
    std::uint64_t reads_ = 0;
};

class Signals : public testing::TestWithParam<int> {
protected:
    Signals()
        : shared_(*new (mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                             MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared) {}
    ~Signals() override { munmap(&shared_, sizeof(Shared)); }

    /// The child: runs until a signal ends it, as the command does.
    [[noreturn]] void run_child(bool recorder_is_stuck) {
        if (freopen("/dev/null", "w", stderr) == nullptr) _exit(1);
        std::signal(SIGHUP, outlives_its_terminal_ ? SIG_IGN : SIG_DFL);
        command::stop_on_signals();
        const auto scene = std::make_shared<const Scene>(
            parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                        "[surface.s]\nvolume = \"v\"\n"
                        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                        "ball.toml"));
        WatchedDevice device(shared_);
        RunWatch watch;
        watch.progress = [&](double, std::string_view) {
            if (recorder_is_stuck && shared_.forces > 100 && !shared_.is_stuck.exchange(true))
                std::this_thread::sleep_for(std::chrono::milliseconds(200));
            return !command::stop_wanted();
        };
        Trace trace;
        {
            const command::SignalsOnlyAsk one_is_enough;
            trace = run_realtime(scene, {device, {}}, {}, watch);
        }
        write_recording(folder_ / "r.h5", recorded(*scene, {}, trace));
        command::end_by_signal();
        _exit(2); // no signal came
    }

    /// Waits for something that the child does; false where it does not within 20 s.
    template <class Condition>
    static bool comes_true(const Condition& condition) {
        for (int i = 0; i < 4000; ++i) {
            if (condition()) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        return false;
    }

    /// Sends the signal, `times` times, once the child's device pushes; how the child ended.
    int ended_by(int signal, int times, bool recorder_is_stuck = false) {
        const pid_t child = fork();
        if (child == 0) run_child(recorder_is_stuck);
        const bool has_pushed = comes_true(
            [&] { return recorder_is_stuck ? shared_.is_stuck.load() : shared_.forces > 50; });
        EXPECT_TRUE(has_pushed) << "the child's device never pushed";
        if (outlives_its_terminal_) {
            kill(child, SIGHUP);
            const std::uint64_t before = shared_.forces;
            EXPECT_TRUE(comes_true([&] { return shared_.forces > before + 1000; })) << "it ended";
        }
        for (int i = 0; i < times; ++i) {
            kill(child, signal);
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        int status = 0;
        const bool has_ended =
            comes_true([&] { return waitpid(child, &status, WNOHANG) == child; });
        EXPECT_TRUE(has_ended) << "the child goes on";
        if (!has_ended) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
        }
        return status;
    }

    void expect_left_without_force(int status) {
        EXPECT_TRUE(WIFSIGNALED(status));
        EXPECT_EQ(WTERMSIG(status), GetParam()) << "a shell sees what ended it";
        EXPECT_FALSE(shared_.is_pushing);
        EXPECT_GE(shared_.stops, 1);
        EXPECT_EQ(shared_.forces_after_stop, 0);
        const Recording recording = read_recording(folder_ / "r.h5");
        EXPECT_GE(recording.frames.size(), 50u);
    }

    test::TemporaryFolder folder_;
    Shared& shared_;
    bool outlives_its_terminal_ = false; ///< started by nohup
};

TEST_P(Signals, EndARunWithoutForceAndWithItsRecording) {
    expect_left_without_force(ended_by(GetParam(), 1));
}

// A second Ctrl-C must not leave the motors on, even while the recorder is busy and has not seen
// the first.
TEST_P(Signals, AgainAndAgainEndItNoOtherWay) {
    expect_left_without_force(ended_by(GetParam(), 5, /*recorder_is_stuck=*/true));
}

// It ended with the terminal that it was to outlive, and a study of hours with it.
class SignalsUnderNohup : public Signals {};

TEST_P(SignalsUnderNohup, ARunOutlivesItsTerminalAndEndsAsEver) {
    outlives_its_terminal_ = true;
    expect_left_without_force(ended_by(GetParam(), 1));
}

std::string name_of(const testing::TestParamInfo<int>& of) {
    return of.param == SIGINT ? "Interrupt" : of.param == SIGTERM ? "Terminate" : "HangUp";
}

INSTANTIATE_TEST_SUITE_P(Run, Signals, testing::Values(SIGINT, SIGTERM, SIGHUP), name_of);
INSTANTIATE_TEST_SUITE_P(Run, SignalsUnderNohup, testing::Values(SIGINT, SIGTERM), name_of);

} // namespace
} // namespace palpate
