// SPDX-License-Identifier: Apache-2.0
// Scenes for a long time: the same frames twice must have the same bits, memory must not grow, and
// each flag is counted; one that nothing in such a run explains is wrong.
//   palpate_soak [--frames N] [--minutes M] [--load] [--leave-mb MB] SCENE.toml...
// N frames of each scene at pace asap, as two passes of half of them (default 2,000,000), then M
// minutes of each in real time (default 0.5; 0: none). --load keeps every processor busy meanwhile;
// --leave-mb takes memory until that much is left. A table on stdout; exit 1 where bits differ,
// memory grew by more than 1 MiB, a number was not finite, a force beyond its limit or a flag
// without a reason, 2 on wrong input.
// Scenes need a device that is known from beginning to end: a path, an orbit, a tour.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/view/view_devices.h>
#include <palpate/haptics/stepping/clock.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

struct Options {
    std::uint64_t frames = 2'000'000;
    double minutes = 0.5;
    bool load = false;
    double leave_mb = 0.0;
    std::vector<std::filesystem::path> scenes;
};

/// A clock that passes with its readings alone, so that frames of a method that looks at the time
/// have the same bits twice.
class CountedClock final : public Clock {
public:
    double now_us() noexcept override { return 0.25 * static_cast<double>(readings_++); }

private:
    std::uint64_t readings_ = 0;
};

/// Threads that want every processor, and walk through more memory than a cache holds.
class BusyThreads {
public:
    explicit BusyThreads(bool are_wanted) {
        const unsigned count = are_wanted ? std::max(1u, std::thread::hardware_concurrency()) : 0;
        threads_.reserve(count);
        for (unsigned i = 0; i < count; ++i)
            threads_.emplace_back([this] {
                std::vector<unsigned> memory(std::size_t{4} << 20);
                for (std::size_t at = 0; !done_; at = (at + 4099) % memory.size())
                    memory[at] += 1;
            });
    }
    ~BusyThreads() {
        done_ = true;
        for (std::thread& thread : threads_)
            thread.join();
    }
    BusyThreads(const BusyThreads&) = delete;
    BusyThreads& operator=(const BusyThreads&) = delete;

private:
    std::atomic<bool> done_{false};
    std::vector<std::thread> threads_;
};

/// A line of /proc/meminfo, MiB.
double meminfo_mb(std::string_view key) {
    std::ifstream file("/proc/meminfo");
    std::string name, unit;
    double kilobytes = 0.0;
    while (file >> name >> kilobytes && std::getline(file, unit))
        if (name == key) return kilobytes / 1024.0;
    return 0.0;
}

/// Memory that is taken, and written to, until so much is left; nothing where that is 0.
std::vector<std::vector<char>> taken_memory(double leave_mb) {
    constexpr std::size_t kBlock = std::size_t{64} << 20;
    std::vector<std::vector<char>> blocks;
    while (leave_mb > 0.0 && meminfo_mb("MemAvailable:") > leave_mb + 64.0)
        blocks.emplace_back(kBlock, '\x5a');
    return blocks;
}

/// Memory of this program that lies in the computer's, MiB.
double resident_mb() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t all = 0, resident = 0;
    file >> all >> resident;
    return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

/// Flags that nothing explains here: nobody moves bodies or gains, adopts a scene or has motors,
/// and each place of the probe is one. In real time a state may come late.
constexpr std::uint32_t kUnexplained = kForceNotFinite | kProbeNotFinite | kDeviceStale |
                                       kProbeJumped | kWaitsForSmallForce | kRampsIn |
                                       kEnergyBounded | kEnergyExceeded | kSoftened |
                                       kSceneAdopted | kLiveGain | kBodyMoved | kBodyHeldBack;

/// What frames had in common, and whether a rule was broken.
struct Tally {
    void add(const FrameReport& frame, double limit_n, std::uint32_t never) {
        ++frames;
        unexplained += (frame.flags & never) != 0 ? 1 : 0;
        for (const double value : {frame.proxy.x, frame.proxy.y, frame.proxy.z, frame.force.x,
                                   frame.force.y, frame.force.z}) {
            mix(std::bit_cast<std::uint64_t>(value));
            not_finite += std::isfinite(value) ? 0 : 1;
        }
        mix(frame.flags);
        mix(frame.sub_steps);
        const double force_n = glm::length(frame.force);
        too_strong += force_n <= limit_n * (1.0 + 1e-12) ? 0 : 1;
        most_n = std::max(most_n, force_n);
        most_sub_steps = std::max<std::uint64_t>(most_sub_steps, frame.sub_steps);
        felt += frame.surfaces_felt != 0 ? 1 : 0;
        for (unsigned bit = 0; bit < 32; ++bit)
            flags[bit] += frame.flags >> bit & 1u;
    }
    /// FNV-1a over words.
    void mix(std::uint64_t word) { hash = (hash ^ word) * 0x100000001b3u; }

    bool is_well() const { return not_finite == 0 && too_strong == 0 && unexplained == 0; }

    std::uint64_t hash = 0xcbf29ce484222325u;
    std::uint64_t frames = 0;
    std::uint64_t felt = 0;
    std::uint64_t not_finite = 0;
    std::uint64_t too_strong = 0;
    std::uint64_t unexplained = 0; ///< frames with a flag that has no reason
    std::uint64_t most_sub_steps = 0;
    double most_n = 0.0;
    std::array<std::uint64_t, 32> flags{};
};

std::string flags_in_words(const Tally& tally) {
    std::string words;
    for (const FrameFlagText& text : kFrameFlagTexts)
        if (const auto count = tally.flags[static_cast<std::size_t>(
                std::countr_zero(static_cast<std::uint32_t>(text.flag)))];
            count > 0)
            words += fmt::format("{}{} {}", words.empty() ? "" : ", ", text.name, count);
    return words.empty() ? "none" : words;
}

/// Memory between a tenth of the work and its end.
struct Growth {
    void look(double done) {
        if (done < 0.1 || begin_mb == 0.0) begin_mb = resident_mb();
        end_mb = std::max(end_mb, resident_mb());
    }
    double mb() const { return std::max(0.0, end_mb - begin_mb); }
    double begin_mb = 0.0;
    double end_mb = 0.0;
};

struct Result {
    std::string scene, pace;
    Tally tally;
    double grown_mb = 0.0;
    std::string note;
    bool is_well = true;
};

Tally pass(const std::shared_ptr<const Scene>& scene, const std::vector<DeviceState>& states,
           std::uint64_t frames, Growth& growth) {
    CountedClock clock;
    HapticLoop loop(scene, clock);
    SteeredDevice device(states, scene->description().loop.rate_hz);
    const double limit_n = scene->description().limits.force_n;
    Tally tally;
    DeviceState state;
    for (std::uint64_t i = 0; i < frames; ++i) {
        device.read(state);
        tally.add(loop.frame(state), limit_n, kUnexplained);
        if (i % 65'536 == 0) growth.look(static_cast<double>(i) / static_cast<double>(frames));
    }
    growth.look(1.0);
    return tally;
}

Result asap(const std::shared_ptr<const Scene>& scene, const std::vector<DeviceState>& states,
            std::uint64_t frames, const std::string& name) {
    Growth first, second;
    const Tally once = pass(scene, states, frames / 2, first);
    const Tally again = pass(scene, states, frames / 2, second);
    Result result{name, "asap, twice", once, std::max(first.mb(), second.mb()), {}, true};
    result.note = fmt::format("hash {:016x}{}", once.hash,
                              again.hash == once.hash ? " twice" : ", then another one");
    result.is_well = again.hash == once.hash && once.is_well();
    return result;
}

Result realtime(const std::shared_ptr<const Scene>& scene, const std::vector<DeviceState>& states,
                double minutes, const std::string& name) {
    SteeredDevice device(states, scene->description().loop.rate_hz);
    RealtimeSettings settings;
    settings.longest_s = 60.0 * minutes;
    settings.keep = RealtimeSettings::Keep::none;
    Result result{name, "real time", {}, 0.0, {}, true};
    Growth growth;
    RunWatch watch;
    watch.warning = [](const std::string& words) { fmt::print(stderr, "soak: {}\n", words); };
    watch.frame = [&](const RunFrame& run) {
        if (result.tally.frames % 4096 == 0) growth.look(run.frame.time_s / settings.longest_s);
        result.tally.add(run.frame, scene->description().limits.force_n,
                         kUnexplained & ~static_cast<std::uint32_t>(kDeviceStale));
    };
    const Trace trace = run_realtime(scene, {device, {}}, settings, watch);
    growth.look(1.0);
    result.grown_mb = growth.mb();
    result.note = fmt::format("{} overruns of its own, {} woken late, {} periods missed",
                              trace.realtime->own_work, trace.realtime->woken_late,
                              trace.realtime->missed_periods);
    result.is_well = result.tally.is_well();
    return result;
}

void print(const Result& result) {
    fmt::print("| {} | {} | {} | {} | {:.2f} | {} | {:.2f} | {} | {} | {} | {} | {} |\n",
               result.scene, result.pace, result.tally.frames, result.tally.felt,
               result.tally.most_n, result.tally.most_sub_steps, result.grown_mb,
               result.tally.not_finite, result.tally.too_strong, result.tally.unexplained,
               flags_in_words(result.tally), result.note);
    std::fflush(stdout);
}

template <class Number>
bool read_number(std::string_view text, Number& number) {
    const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
    return read.ec == std::errc() && read.ptr == text.data() + text.size();
}

bool read_options(int argc, char** argv, Options& options) {
    bool is_read = true;
    for (int i = 1; i < argc && is_read; ++i) {
        const std::string_view option = argv[i];
        const bool has_value = i + 1 < argc;
        if (option == "--frames" && has_value)
            is_read = read_number(argv[++i], options.frames) && options.frames >= 2;
        else if (option == "--minutes" && has_value)
            is_read = read_number(argv[++i], options.minutes) && options.minutes >= 0.0 &&
                      options.minutes < 1e5;
        else if (option == "--leave-mb" && has_value)
            is_read = read_number(argv[++i], options.leave_mb) && options.leave_mb >= 64.0;
        else if (option == "--load")
            options.load = true;
        else if (option.starts_with("-"))
            is_read = false;
        else
            options.scenes.emplace_back(option);
    }
    return is_read && !options.scenes.empty();
}

int main_of(int argc, char** argv) {
    constexpr double kMostGrowth_mb = 1.0;
    Options options;
    if (!read_options(argc, argv, options)) {
        fmt::print(stderr, "usage: palpate_soak [--frames 2..] [--minutes 0..] [--load] "
                           "[--leave-mb 64..] SCENE.toml...\n");
        return 2;
    }
    const BusyThreads busy(options.load);
    fmt::print("| scene | pace | frames | felt | most N | most sub-steps | memory grown, MiB | not "
               "finite | beyond the limit | unexplained | flags | note |\n"
               "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    bool is_well = true;
    for (const std::filesystem::path& file : options.scenes) {
        const auto scene =
            std::make_shared<const Scene>(read_scene(file), SceneResources{.files = scene_files()});
        const std::vector<DeviceState> states = device_states(*scene);
        const std::string name = file.stem().string();
        const std::vector<std::vector<char>> taken = taken_memory(options.leave_mb);
        std::vector<Result> results{asap(scene, states, options.frames, name)};
        if (options.minutes > 0.0)
            results.push_back(realtime(scene, states, options.minutes, name));
        for (Result& result : results) {
            print(result);
            is_well = is_well && result.is_well && result.grown_mb <= kMostGrowth_mb;
        }
    }
    return is_well ? 0 : 1;
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    try {
        return palpate::main_of(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "palpate_soak: {}\n", error.what());
        return 2;
    }
}
