// SPDX-License-Identifier: Apache-2.0
// Whether a page that looks on makes a loop late: runs of the same scene at the clock's pace, in
// turns without a server, with one that nobody looks at, with a page that takes all it is sent,
// with a page that takes nothing, and with one that connects anew all the time and sends what is no
// command.
//   bench_view_jitter [--seconds S] [--rounds N] [--benchmark_format=json]
// prints a table, or rows as those of bench_jitter; S of each run, 5 where it is not given, N runs
// of each kind, 4 where it is not. The pages are sockets of this program, without a browser: one
// that draws costs processor time besides, as the busy machine of bench_jitter.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include <palpate/drivers/sequence_device.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/view/live_server.h>
#include <palpate/engine/view/view_document.h>

#include "bench/internal/spread.h"
#include "tests/engine/view/live_client.h"

namespace palpate {
namespace {

constexpr double kRate_hz = 1000.0;

enum class Onlooker { no_server, nobody, reads, stalls, floods };
constexpr std::array kOnlookers{Onlooker::no_server, Onlooker::nobody, Onlooker::reads,
                                Onlooker::stalls, Onlooker::floods};

std::string_view name_of(Onlooker onlooker) {
    switch (onlooker) {
    case Onlooker::no_server:
        return "no server";
    case Onlooker::nobody:
        return "server, no page";
    case Onlooker::reads:
        return "page that reads";
    case Onlooker::stalls:
        return "page that takes nothing";
    case Onlooker::floods:
        return "page that reconnects and sends garbage";
    }
    return "";
}

/// A page in a thread of its own, for as long as it lives.
class Page {
public:
    Page(Onlooker onlooker, const LiveServer& server) {
        if (onlooker == Onlooker::nobody) return;
        thread_ = std::thread([this, onlooker, &server] {
            while (!done_) {
                try {
                    look(onlooker, server);
                } catch (const std::exception&) { // the server has dropped it: it comes again
                }
            }
        });
    }
    ~Page() {
        done_ = true;
        {
            const std::lock_guard lock(mutex_);
            if (client_ != nullptr) client_->shut_down();
        }
        if (thread_.joinable()) thread_.join();
    }
    Page(const Page&) = delete;
    Page& operator=(const Page&) = delete;

private:
    /// A connection that the page may be waiting at.
    struct Open {
        Open(Page& page, test::LiveClient& client) : page_(page) {
            const std::lock_guard lock(page_.mutex_);
            page_.client_ = &client;
        }
        ~Open() {
            const std::lock_guard lock(page_.mutex_);
            page_.client_ = nullptr;
        }
        Open(const Open&) = delete;
        Open& operator=(const Open&) = delete;
        Page& page_;
    };

    void look(Onlooker onlooker, const LiveServer& server) {
        test::LiveClient client(server);
        const Open open(*this, client);
        if (done_ || !client.open(server)) return;
        if (onlooker == Onlooker::stalls)
            while (!done_)
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
        else if (onlooker == Onlooker::reads)
            while (!done_ && !client.next().empty()) {
            }
        else
            for (int i = 0; i < 200 && !done_; ++i)
                client.send("{\"do\": \"nothing that is known\"}");
    }

    std::atomic<bool> done_{false};
    std::mutex mutex_;
    test::LiveClient* client_ = nullptr; ///< under mutex_
    std::thread thread_;
};

struct Result {
    bench::Spread late, spent;
    RealtimeCounts counts{};
    std::string_view scheduler; // that was granted
};

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

void run(const std::shared_ptr<const Scene>& scene, Onlooker onlooker, double seconds,
         Result& result) {
    SequenceDevice device(std::make_shared<const std::vector<DeviceState>>(circle(seconds)));
    std::optional<LiveServer> server;
    std::optional<Page> page;
    RunWatch watch;
    watch.warning = [](const std::string& warning) {
        fmt::print(stderr, "view_jitter: {}\n", warning);
    };
    if (onlooker != Onlooker::no_server) {
        const ViewDocument document = view_document(*scene, ViewMode::live);
        server.emplace(LiveServerSettings{}, "<html></html>",
                       std::make_shared<const std::string>(scene_message(document, {})),
                       [](const ViewCommand&) { return LiveReply{}; });
        page.emplace(onlooker, *server);
        watch.frame = [&](const RunFrame& frame) { server->add(frame.frame); };
    }
    const Trace trace = run_realtime(scene, {device, {}}, {}, watch);
    for (const FrameReport& frame : trace.frames) {
        result.late.add(frame.late_us);
        result.spent.add(frame.spent_us);
    }
    result.scheduler = trace.realtime->scheduler == Scheduler::fifo ? "SCHED_FIFO" : "SCHED_OTHER";
    result.counts.own_work += trace.realtime->own_work;
    result.counts.woken_late += trace.realtime->woken_late;
    result.counts.missed_periods += trace.realtime->missed_periods;
}

constexpr std::array kColumns{"late_p50_us",       "late_p99_us",         "late_p999_us",
                              "late_max_us",       "spent_p50_us",        "spent_p99_us",
                              "overruns_own_work", "overruns_woken_late", "missed_periods"};

std::vector<std::string> cells(Result& result) {
    std::vector<std::string> row;
    row.reserve(kColumns.size());
    for (const double share : {0.5, 0.99, 0.999, 1.0})
        row.push_back(fmt::format("{:.1f}", result.late.at(share)));
    for (const double share : {0.5, 0.99})
        row.push_back(fmt::format("{:.2f}", result.spent.at(share)));
    for (const std::uint64_t count :
         {result.counts.own_work, result.counts.woken_late, result.counts.missed_periods})
        row.push_back(fmt::format("{}", count));
    return row;
}

void print_table(std::array<Result, kOnlookers.size()>& results) {
    fmt::print("| onlooker | frames | {} |\n|---|", fmt::join(kColumns, " | "));
    for (std::size_t i = 0; i <= kColumns.size(); ++i)
        fmt::print("---|");
    fmt::print("\n");
    for (std::size_t i = 0; i < results.size(); ++i)
        fmt::print("| {} | {} | {} |\n", name_of(kOnlookers[i]), results[i].late.size(),
                   fmt::join(cells(results[i]), " | "));
}

void print_json(std::array<Result, kOnlookers.size()>& results) {
    for (std::size_t i = 0; i < results.size(); ++i) {
        fmt::print("{}{{\"method\": \"adaptive\", \"scheduler\": \"{}\", \"machine\": \"{}\", "
                   "\"frames\": {}",
                   i > 0 ? ",\n " : "[\n ", results[i].scheduler, name_of(kOnlookers[i]),
                   results[i].late.size());
        const std::vector<std::string> row = cells(results[i]);
        for (std::size_t k = 0; k < row.size(); ++k)
            fmt::print(", \"{}\": {}", kColumns[k], row[k]);
        fmt::print("}}");
    }
    fmt::print("\n]\n");
}

int main_of(int argc, char** argv) {
    double seconds = 5.0;
    int rounds = 4;
    bool as_json = false;
    for (int i = 1; i < argc; ++i) {
        const std::string_view option = argv[i];
        if (option == "--seconds" && i + 1 < argc)
            seconds = std::strtod(argv[++i], nullptr);
        else if (option == "--rounds" && i + 1 < argc)
            rounds = std::atoi(argv[++i]);
        else if (option == "--benchmark_format=json")
            as_json = true;
        else
            seconds = 0.0;
    }
    if (!(seconds >= 1.0 && seconds <= 3600.0) || rounds < 1 || rounds > 1000) {
        fmt::print(stderr, "usage: bench_view_jitter [--seconds 1..3600] [--rounds 1..1000] "
                           "[--benchmark_format=json]\n");
        return 2;
    }
    SceneDescription description =
        parse_scene("[volume.v]\nanalytic = \"bumpy_cavity\"\nradius_mm = 50\namplitude_mm = 1\n"
                    "wavelength_mm = 20\n[surface.s]\nvolume = \"v\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                    "view_jitter.toml");
    description.loop.rate_hz = kRate_hz;
    const auto scene = std::make_shared<const Scene>(std::move(description),
                                                     SceneResources{.files = scene_files()});
    std::array<Result, kOnlookers.size()> results;
    for (int round = 0; round < rounds; ++round)
        for (std::size_t i = 0; i < kOnlookers.size(); ++i)
            run(scene, kOnlookers[i], seconds, results[i]);
    as_json ? print_json(results) : print_table(results);
    return 0;
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    try {
        return palpate::main_of(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "bench_view_jitter: {}\n", error.what());
        return 1;
    }
}
