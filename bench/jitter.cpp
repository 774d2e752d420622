// SPDX-License-Identifier: Apache-2.0
// How late the frames of a loop at the clock's pace begin, how long they take and who costs which
// of them: with SCHED_FIFO and with the ordinary scheduler, on a quiet machine and with twice as
// many busy threads as it has processors, with little work a frame (method adaptive) and with as
// much as a frame may have (paper, nine tenths of the period).
//   bench_jitter [--seconds S] [--out DIR] [--benchmark_format=json]
// prints a table; S of each of the eight runs, 10 where it is not given. DIR gets jitter.csv and
// jitter.svg. Run it as root, or as docs/realtime.md says, or there is no SCHED_FIFO.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include <palpate/drivers/sequence_device.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/report/internal/machine.h>
#include <palpate/engine/report/internal/series_chart.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/whole_file.h>

#include "bench/internal/spread.h"

namespace palpate {
namespace {

constexpr double kRate_hz = 1000.0;

enum class Load { none, busy };

struct Case {
    SteppingMethod method;
    Scheduler scheduler;
    Load load;
};

/// Threads that want every processor, and walk through more memory than a cache holds.
class BusyThreads {
public:
    explicit BusyThreads(Load load) {
        const unsigned count =
            load == Load::busy ? 2 * std::max(1u, std::thread::hardware_concurrency()) : 0;
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

bench::Spread spread_of(const std::vector<FrameReport>& frames, double FrameReport::*column) {
    bench::Spread spread;
    for (const FrameReport& frame : frames)
        spread.add(frame.*column);
    return spread;
}

struct Result {
    std::string method, scheduler, load;
    bench::Spread late, spent;
    RealtimeCounts counts;
};

std::string load_name(Load load) { return load == Load::busy ? "busy" : "quiet"; }

/// A probe that goes round 2 mm deep in the wall of the paper's cavity.
std::vector<DeviceState> circle(double seconds) {
    std::vector<DeviceState> states(static_cast<std::size_t>(seconds * kRate_hz));
    for (std::size_t i = 0; i < states.size(); ++i) {
        const double t = static_cast<double>(i) / kRate_hz;
        const double radius = 0.048 + 0.004 * std::min(1.0, t);
        states[i].time_s = t;
        states[i].position = radius * Vec3{std::cos(t), std::sin(t), 0.0};
    }
    return states;
}

Result run(const Case& one, double seconds) {
    SceneDescription description =
        parse_scene("[volume.v]\nanalytic = \"bumpy_cavity\"\nradius_mm = 50\namplitude_mm = 1\n"
                    "wavelength_mm = 20\n[surface.s]\nvolume = \"v\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                    "jitter.toml");
    description.loop.method = one.method;
    description.loop.rate_hz = kRate_hz;
    description.loop.budget_us = RealtimeSettings::kMostDuty * 1e6 / kRate_hz;
    const auto scene = std::make_shared<const Scene>(std::move(description),
                                                     SceneResources{.files = scene_files()});
    SequenceDevice device(std::make_shared<const std::vector<DeviceState>>(circle(seconds)));
    RealtimeSettings settings;
    settings.scheduler = one.scheduler;
    RunWatch watch;
    watch.warning = [](const std::string& warning) { fmt::print(stderr, "jitter: {}\n", warning); };
    const BusyThreads busy(one.load);
    const Trace trace = run_realtime(scene, {device, {}}, settings, watch);
    return {std::string(name(one.method)),
            trace.realtime->scheduler == Scheduler::fifo ? "SCHED_FIFO" : "SCHED_OTHER",
            load_name(one.load),
            spread_of(trace.frames, &FrameReport::late_us),
            spread_of(trace.frames, &FrameReport::spent_us),
            *trace.realtime};
}

std::vector<std::string> cells(const Result& result) {
    std::vector<std::string> row{result.method, result.scheduler, result.load,
                                 fmt::format("{}", result.late.size())};
    for (const double share : {0.5, 0.9, 0.99, 0.999, 1.0})
        row.push_back(fmt::format("{:.1f}", result.late.at(share)));
    for (const double share : {0.5, 0.99, 1.0})
        row.push_back(fmt::format("{:.1f}", result.spent.at(share)));
    for (const std::uint64_t count :
         {result.counts.own_work, result.counts.woken_late, result.counts.missed_periods})
        row.push_back(fmt::format("{}", count));
    return row;
}

const std::vector<std::string> kColumns{"method",
                                        "scheduler",
                                        "machine",
                                        "frames",
                                        "late_p50_us",
                                        "late_p90_us",
                                        "late_p99_us",
                                        "late_p999_us",
                                        "late_max_us",
                                        "spent_p50_us",
                                        "spent_p99_us",
                                        "spent_max_us",
                                        "overruns_own_work",
                                        "overruns_woken_late",
                                        "missed_periods"};

std::string csv(const std::vector<Result>& results) {
    std::string text = fmt::format("{}\n", fmt::join(kColumns, ","));
    for (const Result& result : results)
        text += fmt::format("{}\n", fmt::join(cells(result), ","));
    return text;
}

std::string table(const std::vector<Result>& results) {
    std::string text = fmt::format("| {} |\n|{}\n", fmt::join(kColumns, " | "), [] {
        std::string line;
        for (std::size_t i = 0; i < kColumns.size(); ++i)
            line += "---|";
        return line;
    }());
    for (const Result& result : results)
        text += fmt::format("| {} |\n", fmt::join(cells(result), " | "));
    return text;
}

std::string json(const std::vector<Result>& results) {
    std::string text = "[";
    for (const Result& result : results) {
        const std::vector<std::string> row = cells(result);
        text += text.size() > 1 ? ",\n {" : "\n {";
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string value = i < 3 ? "\"" + row[i] + "\"" : row[i];
            text += fmt::format("{}\"{}\": {}", i > 0 ? ", " : "", kColumns[i], value);
        }
        text += "}";
    }
    return text + "\n]\n";
}

/// Which share of a method's frames begins later than a time.
internal::SeriesChart chart(const std::vector<Result>& results, const std::string& method,
                            double seconds) {
    internal::SeriesChart chart;
    chart.title = fmt::format("method {}: share of the frames that begin later", method);
    chart.x = {fmt::format("late, us (method {})", method), internal::ChartScale::logarithmic, 1.0};
    // The decade of a single frame: an axis ends where it has a label.
    const double one_frame = std::pow(10.0, std::floor(-std::log10(seconds * kRate_hz)));
    chart.y = {"share of frames", internal::ChartScale::logarithmic, one_frame};
    for (const Result& result : results) {
        if (result.method != method) continue;
        internal::ChartSeries series;
        series.name = (result.scheduler == "SCHED_FIFO" ? "FIFO, " : "ordinary, ") + result.load;
        for (double later = 1.0; later * static_cast<double>(result.late.size()) >= 1.0;
             later *= 0.7)
            series.points.push_back({std::max(1.0, result.late.at(1.0 - later)), later});
        chart.series.push_back(std::move(series));
    }
    return chart;
}

/// Both charts, one above the other.
std::string picture(const std::vector<Result>& results, double seconds) {
    const std::array<internal::SeriesChart, 2> charts{chart(results, "adaptive", seconds),
                                                      chart(results, "paper", seconds)};
    return internal::series_picture(charts, internal::ChartWidth::narrow);
}

int main_of(int argc, char** argv) {
    double seconds = 10.0; // a run; eight of them
    std::filesystem::path out;
    bool as_json = false;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        if (option == "--seconds" && i + 1 < argc)
            seconds = std::strtod(argv[++i], nullptr);
        else if (option == "--out" && i + 1 < argc)
            out = argv[++i];
        else if (option == "--benchmark_format=json")
            as_json = true;
        else
            seconds = 0.0;
    }
    if (!(seconds >= 1.0 && seconds <= 3600.0)) {
        fmt::print(stderr, "usage: bench_jitter [--seconds 1..3600] [--out DIR] "
                           "[--benchmark_format=json]\n");
        return 2;
    }
    const internal::Machine machine = internal::this_machine();
    fmt::print(stderr, "{}, {} processors, {}; {:.0f} s a run, {:.0f} Hz\n", machine.cpu,
               machine.cores, machine.system, seconds, kRate_hz);
    std::vector<Result> results;
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::paper})
        for (const Scheduler scheduler : {Scheduler::fifo, Scheduler::ordinary})
            for (const Load load : {Load::none, Load::busy})
                results.push_back(run({method, scheduler, load}, seconds));
    if (!out.empty()) {
        std::filesystem::create_directories(out);
        write_whole_file(out / "jitter.csv", csv(results));
        write_whole_file(out / "jitter.svg", picture(results, seconds));
    }
    const std::string text = as_json ? json(results) : table(results);
    std::fwrite(text.data(), 1, text.size(), stdout);
    return 0;
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    try {
        return palpate::main_of(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "bench_jitter: {}\n", error.what());
        return 1;
    }
}
