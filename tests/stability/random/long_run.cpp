// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/long_run.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <iostream>
#include <new>
#include <thread>

#include <csignal>
#include <ctime>

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/stability/random/path_maker.h"
#include "tests/stability/random/shrinker.h"

#include "tests/support/temporary_folder.h"

namespace palpate::stability {
namespace {

constexpr std::array kInvariants{
    "finite", "limits",      "coupling", "flags",  "work",    "certificate", "crossing",
    "side",   "leash",       "energy",   "code",   "rest",    "same bits",   "smooth",
    "press",  "second hand", "follows",  "direct", "goes on", "as one",      "path"};

constexpr double kClockOverProcessor = 10.0; // on a busy machine
constexpr int kCannotGoOn = 2;               // how a worker ends that has said why

enum class Phase : int { made, set_up, frames, shrinking, done };

double cpu_seconds(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What the worker tells the watchdog, in memory of both.
struct Shared {
    std::atomic<std::uint64_t> seed{0};
    std::atomic<Phase> phase{Phase::made};
    std::atomic<double> phase_began_s{0.0};    // processor time of the worker
    std::atomic<double> phase_began_at_s{0.0}; // on the clock
    std::atomic<long> cases{0}, refused{0}, failed{0}, frames{0}, touched{0}, restless{0};
    std::array<std::atomic<long>, kInvariants.size()> checks{};
    std::array<std::atomic<long>, 32> flags{}; // cases in which a flag was seen
    std::atomic<bool> finished{false};

    void enter(Phase next) {
        begin_time();
        phase = next;
    }
    void begin_time() {
        phase_began_s = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
        phase_began_at_s = cpu_seconds(CLOCK_MONOTONIC);
    }
    void add(const Outcome& outcome) {
        ++cases;
        refused += outcome.refused.empty() ? 0 : 1;
        failed += outcome.failure ? 1 : 0;
        frames += outcome.frames;
        touched += outcome.touched;
        restless += outcome.restless ? 1 : 0;
        for (std::size_t i = 0; i < kInvariants.size(); ++i)
            if (const auto found = outcome.checks.find(kInvariants[i]);
                found != outcome.checks.end())
                checks[i] += found->second;
        for (std::size_t bit = 0; bit < flags.size(); ++bit)
            flags[bit] += (outcome.flags >> bit & 1u) != 0 ? 1 : 0;
    }
};

const char* name_of(Phase phase) {
    constexpr std::array names{"being made", "set-up", "frames", "shrinking", "done"};
    return names[static_cast<std::size_t>(phase)];
}

std::string folder_of(std::uint64_t seed) { return "seed-" + std::to_string(seed); }

/// Whether a surface is felt in the case of a folder that is softer than the coupling.
bool feels_soft(const std::filesystem::path& folder) {
    try {
        const SceneDescription scene = read_scene(folder / "scene.toml");
        return std::any_of(scene.effects.begin(), scene.effects.end(),
                           [&](const EffectDescription& effect) {
                               return makes_surface_felt(effect) &&
                                      is_soft(scene, scene.surfaces.at(surface_of(effect)));
                           });
    } catch (const std::exception&) {
        return false; // refused
    }
}

/// All cases from a seed on, in the worker.
void work(const LongRun& run, std::uint64_t from, const std::filesystem::path& folder,
          Shared& shared) {
    RunOptions options;
    options.phase = [&](const char* name) {
        if (shared.phase != Phase::shrinking)
            shared.enter(std::strcmp(name, "frames") == 0 ? Phase::frames : Phase::set_up);
        else // each try has its own time
            shared.begin_time();
    };
    for (std::uint64_t seed = from; seed <= run.to && shared.frames < run.frames; ++seed) {
        shared.seed = seed;
        shared.enter(Phase::made);
        std::error_code ignored;
        std::filesystem::remove_all(folder, ignored);
        const std::filesystem::path keep = run.out / folder_of(seed);
        const RandomCase made = make_case(seed, run.path_frames, run.atlas.get());
        write_case(made, folder);
        if (run.soft && !feels_soft(folder)) continue;
        const Outcome outcome = run_case(folder, options);
        shared.add(outcome);
        if (run.each_seed)
            std::cout << fmt::format(
                "seed {}: {} frames, {} in contact{}\n", seed, outcome.frames, outcome.touched,
                outcome.refused.empty() ? "" : ", refused: " + outcome.refused);
        if (!outcome.failure) continue;
        std::cout << fmt::format("seed {}: {} in frame {}: {}\n", seed, outcome.failure->invariant,
                                 outcome.failure->frame, outcome.failure->words)
                  << std::flush;
        if (run.only_first) break;
        write_case(made, run.out / (folder_of(seed) + "-whole"));
        shared.enter(Phase::shrinking);
        const Outcome small = try_case(made, folder, keep, options);
        if (small.failure)
            std::cout << fmt::format("  reduced to {} frames: {}\n  palpate_stability --replay {}\n"
                                     "  palpate trace {}/scene.toml\n",
                                     small.failure->frame + 1, small.failure->words, keep.string(),
                                     keep.string())
                      << std::flush;
    }
    shared.finished = true;
}

void write_table(const LongRun& run, const Shared& shared, int hung, int crashed,
                 std::ostream& out) {
    out << fmt::format("\n{} scenes, {} of them refused; {} frames, {} in contact\n",
                       shared.cases.load(), shared.refused.load(), shared.frames.load(),
                       shared.touched.load());
    out << fmt::format("{} failed, {} hung, {} crashed; {} of held probes did not rest to the bit; "
                       "seeds {} to {}\n\n",
                       shared.failed.load(), hung, crashed, shared.restless.load(), run.from,
                       shared.seed.load());
    out << "| invariant | frames or chords checked |\n|---|---|\n";
    for (std::size_t i = 0; i < kInvariants.size(); ++i)
        out << fmt::format("| {} | {} |\n", kInvariants[i], shared.checks[i].load());
    out << "\n| flag | scenes that had it |\n|---|---|\n";
    for (std::size_t i = 0; i < kFrameFlagTexts.size(); ++i)
        if (const long count = shared.flags[i])
            out << fmt::format("| {} | {} |\n", kFrameFlagTexts[i].name, count);
    out << std::flush;
}

/// Waits for the worker. How it ended: 0 by itself, else by the watchdog (-1) or a signal.
int watch(pid_t worker, const LongRun& run, Shared& shared, std::ostream& out) {
    clockid_t clock{};
    const bool has_clock = clock_getcpuclockid(worker, &clock) == 0;
    long told = shared.frames / 100000;
    for (int status = 0;;) {
        if (waitpid(worker, &status, WNOHANG) == worker) {
            if (WIFEXITED(status) && WEXITSTATUS(status) != 0)
                throw std::runtime_error("ended, for the reason above");
            return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
        }
        if (shared.frames / 100000 > told) {
            told = shared.frames / 100000;
            out << fmt::format("{} frames, {} scenes, seed {}, {} failed\n", shared.frames.load(),
                               shared.cases.load(), shared.seed.load(), shared.failed.load())
                << std::flush;
        }
        // Who waits for ever takes no processor time.
        const bool waits = cpu_seconds(CLOCK_MONOTONIC) - shared.phase_began_at_s >
                           kClockOverProcessor * run.watchdog_s;
        if (waits || (has_clock && cpu_seconds(clock) - shared.phase_began_s > run.watchdog_s)) {
            kill(worker, SIGKILL);
            waitpid(worker, &status, 0);
            return -1;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
}

} // namespace

Outcome try_case(const RandomCase& made, const std::filesystem::path& work,
                 const std::filesystem::path& keep, const RunOptions& options) {
    const auto tried = [&](const RandomCase& candidate) {
        std::error_code ignored;
        std::filesystem::remove_all(work, ignored);
        write_case(candidate, work);
        return run_case(work, options);
    };
    Outcome outcome = tried(made);
    if (!outcome.failure) return outcome;
    const std::string invariant = outcome.failure->invariant;
    const RandomCase small = shrink(made, [&](const RandomCase& candidate) {
        const Outcome now = tried(candidate);
        return now.failure && now.failure->invariant == invariant;
    });
    outcome = tried(small);
    write_case(small, keep);
    test::make_file(keep / "failure.txt",
                    outcome.failure ? fmt::format("{} in frame {}: {}\n", invariant,
                                                  outcome.failure->frame, outcome.failure->words)
                                    : "does not fail again\n");
    return outcome;
}

/// A run never writes over the cases of another one.
void require_out_of_its_own(const std::filesystem::path& folder) {
    if (!std::filesystem::exists(folder)) return;
    if (!std::filesystem::is_directory(folder))
        throw std::runtime_error("--out " + folder.string() + ": is no folder; give another one");
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().filename().string().starts_with("seed-"))
            throw std::runtime_error("--out " + folder.string() +
                                     ": has cases of another run; give another folder");
}

int run_long(const LongRun& run, std::ostream& out) {
    require_out_of_its_own(run.out);
    void* const memory =
        mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::runtime_error("no memory for the watchdog");
    Shared& shared = *new (memory) Shared;
    const test::TemporaryFolder folder;
    int hung = 0, crashed = 0;
    for (std::uint64_t from = run.from; !shared.finished && from <= run.to;) {
        shared.enter(Phase::made);
        shared.phase_began_s = 0.0;
        const pid_t worker = fork();
        if (worker < 0) throw std::runtime_error("no process for the scenes");
        if (worker == 0) {
            int status = 0;
            try {
                work(run, from, folder / "case", shared);
            } catch (const std::exception& error) {
                std::cerr << fmt::format("palpate_stability: seed {}: {}\n", shared.seed.load(),
                                         error.what());
                status = kCannotGoOn;
            }
            std::cout << std::flush;
            _exit(status); // no destructors of libraries whose threads are not in this process
        }
        const int ended = watch(worker, run, shared, out);
        if (ended == 0) break;
        (ended < 0 ? hung : crashed) += 1;
        const std::uint64_t seed = shared.seed;
        const std::string keep = (run.out / folder_of(seed)).string() + "-whole";
        out << fmt::format("seed {}: {} in {}; {}\n", seed,
                           ended < 0 ? "hangs" : "ends by signal " + std::to_string(ended),
                           name_of(shared.phase), keep)
            << std::flush;
        std::error_code ignored; // what the worker had written of it: nothing, if it was being made
        std::filesystem::create_directories(run.out, ignored);
        std::filesystem::copy(folder / "case", keep, std::filesystem::copy_options::recursive,
                              ignored);
        if (run.only_first) break;
        from = seed + 1;
    }
    write_table(run, shared, hung, crashed, out);
    const int bad = static_cast<int>(shared.failed) + hung + crashed;
    munmap(memory, sizeof(Shared));
    return bad;
}

} // namespace palpate::stability
