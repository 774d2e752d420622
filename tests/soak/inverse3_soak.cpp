// SPDX-License-Identifier: Apache-2.0
// The driver of the Inverse3 over a simulated service on loopback, at 1 kHz: how long a position
// and a force take, and whether the force is limited, and zero on every fault of the service.
//   palpate_inverse3_soak [--seconds S]
// S seconds of a service that behaves (default 60), then each fault for a second. A table on
// stdout; exit 1 where a force was too long or no number, where one was sent 20 ms after a fault
// began, or where states are not fresh again when it is over.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <palpate/drivers/inverse3_device.h>

#include "tests/support/simulated_inverse_service.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;
using Service = test::SimulatedInverseService;
using test::HeardCommand;
using test::ServiceFrame;

constexpr double kLimit_n = 3.0;
/// From the fault's beginning until no force is sent: a state is stale after 10 ms, and a command
/// that was on its way may arrive a period and a slice of the scheduler later.
constexpr double kZeroWithin_s = 0.020;

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

/// A mark that a number carries, and when it was made: from one thread to another, no lock.
class Marks {
public:
    double next() { // as a length, m, or a force, N
        const std::size_t mark = count_++ % kMost;
        made_s_[mark].store(now_s());
        return 1e-6 * static_cast<double>(mark);
    }
    /// How long ago the mark was made that this number carries.
    double age_s(double number, double at_s) const {
        return at_s - made_s_[static_cast<std::size_t>(std::llround(1e6 * number)) % kMost].load();
    }

private:
    static constexpr std::size_t kMost = 100'000; // 0.1 m, 0.1 N: 100 s before one comes again
    std::vector<std::atomic<double>> made_s_ = std::vector<std::atomic<double>>(kMost);
    std::size_t count_ = 0;
};

/// A loop at 1 kHz that wants 2.5 N up, and a little to the right as a mark; every hundredth force
/// is too long or no number.
class Servo {
public:
    Servo(Inverse3Device& device, const Marks& positions)
        : device_(device), positions_(positions), thread_([this] { run(); }) {}
    ~Servo() { end(); }
    void end() {
        stopping_.store(true);
        if (thread_.joinable()) thread_.join();
    }

    Marks forces;
    std::atomic<std::uint64_t> frames{0}, fresh{0};
    std::vector<double> ages_s; ///< of what fresh states tell, where they are read; after end()

private:
    void run() {
        Clock::time_point due = Clock::now();
        while (!stopping_.load()) {
            DeviceState state;
            device_.read(state);
            if (state.freshness == Freshness::fresh) {
                ++fresh;
                ages_s.push_back(positions_.age_s(state.position.y, now_s()));
            }
            device_.write(wanted(frames++));
            due = std::max(due + std::chrono::milliseconds(1), Clock::now());
            std::this_thread::sleep_until(due);
        }
    }
    Vec3 wanted(std::uint64_t frame) {
        if (frame % 200 == 50) return Vec3(std::numeric_limits<double>::quiet_NaN());
        if (frame % 200 == 150) return {1e9, 0.0, 0.0};
        return {0.0, forces.next(), 2.5};
    }
    Inverse3Device& device_;
    const Marks& positions_;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

struct Quantiles {
    double p50 = 0.0, p99 = 0.0, most = 0.0;
};

Quantiles quantiles(std::vector<double> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    return {at(0.5), at(0.99), values.back()};
}

void print(const char* what, const std::vector<double>& values) {
    const Quantiles q = quantiles(values);
    fmt::print("  {:<44} p50 {:6.3f}  p99 {:6.3f}  longest {:7.3f} ms  ({})\n", what, 1e3 * q.p50,
               1e3 * q.p99, 1e3 * q.most, values.size());
}

class Soak {
public:
    Soak() : device_(Inverse3Device::Settings{.address = inverse3_address(service_.options())}) {
        service_.behave(well());
        device_.open();
        device_.start();
    }
    int run(double seconds);

private:
    using Action = std::function<void()>;

    void check(bool is_so, const std::string& what) {
        if (!is_so) fmt::print("FAILED: {}\n", what);
        is_well_ = is_well_ && is_so;
    }
    /// As documented, with a mark in each position.
    Service::Behaviour well() {
        return [this](const HeardCommand&) {
            service_.move_to({positions_.next(), -0.12, 0.15});
            return one(service_.state_message());
        };
    }
    static std::vector<ServiceFrame> one(const std::string& text) { return {{text, false, {}}}; }
    void look_at(const std::vector<HeardCommand>& heard);
    void behave_well(double seconds);
    void misbehave(const char* name, const Action& begin, const Action& end);
    void misbehave(const char* name, const Service::Behaviour& behaviour) {
        misbehave(
            name, [&] { service_.behave(behaviour); }, [&] { service_.behave(well()); });
    }
    bool becomes_fresh(double within_s);

    Marks positions_;
    Service service_;
    Inverse3Device device_;
    bool is_well_ = true;
};

/// No force is too long, or no number.
void Soak::look_at(const std::vector<HeardCommand>& heard) {
    const bool is_limited = std::all_of(heard.begin(), heard.end(), [](const HeardCommand& one) {
        return is_finite(one.force) && glm::length(one.force) <= kLimit_n * (1.0 + 1e-12);
    });
    check(is_limited, "a force beyond its limit");
}

void Soak::behave_well(double seconds) {
    Servo servo(device_, positions_);
    std::vector<double> ways_s;
    std::uint64_t commands = 0;
    double last = -1.0;
    for (const double end_s = now_s() + seconds; now_s() < end_s;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        const std::vector<HeardCommand> heard = service_.heard();
        look_at(heard);
        commands += heard.size();
        for (const HeardCommand& command : heard) // each force counts once, where it comes first
            if (command.force.z == 2.5 && std::exchange(last, command.force.x) != last)
                ways_s.push_back(servo.forces.age_s(command.force.x, command.time_s));
    }
    servo.end();
    const auto counts = device_.counts();
    const double frames = static_cast<double>(servo.frames);
    fmt::print(
        "{:.0f} s of a service as documented\n"
        "  {:.0f} frames, {:.3f} % of them fresh; {:.0f} exchanges a second; {} silences, {} "
        "late, {} unasked, {} losses\n",
        seconds, frames, 100.0 * static_cast<double>(servo.fresh) / frames,
        static_cast<double>(commands) / seconds, counts.silences, counts.late, counts.unasked,
        counts.losses);
    print("a position, from the service to read()", servo.ages_s);
    print("a force, from write() to the service", ways_s);
    check(!servo.ages_s.empty() && !ways_s.empty(), "nothing was exchanged");
}

bool Soak::becomes_fresh(double within_s) {
    for (const double end_s = now_s() + within_s; now_s() < end_s;) {
        DeviceState state;
        device_.read(state);
        if (state.freshness == Freshness::fresh) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

/// A second of a fault: how long a force was sent at most, and whether all is well again behind it.
void Soak::misbehave(const char* name, const Action& begin, const Action& end) {
    Servo servo(device_, positions_);
    check(becomes_fresh(5.0), std::string(name) + ": no state before it");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    service_.heard();
    begin();
    const double began_s = now_s();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    const std::vector<HeardCommand> heard = service_.heard();
    end();
    look_at(heard);
    double last_s = began_s;
    for (const HeardCommand& command : heard)
        if (command.force != Vec3(0.0)) last_s = command.time_s;
    fmt::print("  {:<44} last force after {:7.3f} ms\n", name, 1e3 * (last_s - began_s));
    check(last_s - began_s <= kZeroWithin_s, std::string(name) + ": a force was sent");
    check(becomes_fresh(5.0), std::string(name) + ": no state when it was over");
}

int Soak::run(double seconds) {
    behave_well(seconds);
    fmt::print("a second of each fault\n");
    misbehave("no answer", [](const HeardCommand&) { return std::vector<ServiceFrame>(); });
    misbehave("no JSON", [](const HeardCommand&) { return one("{\"inverse3\":[{"); });
    misbehave("binary", [this](const HeardCommand&) {
        return std::vector<ServiceFrame>{{service_.state_message(), true, {}}};
    });
    misbehave("a position that is no number", [](const HeardCommand&) {
        return one(
            R"({"inverse3":[{"device_id":"049D","state":{"cursor_position":{"x":1e999}}}]})");
    });
    misbehave("a position of 9 m", [](const HeardCommand&) {
        return one(R"({"inverse3":[{"device_id":"049D","state":{"cursor_position":)"
                   R"({"x":0,"y":9,"z":0}}}]})");
    });
    misbehave("another device's id", [](const HeardCommand&) {
        return one(R"({"inverse3":[{"device_id":"FFFF","state":{"cursor_position":)"
                   R"({"x":0,"y":0,"z":0}}}]})");
    });
    misbehave("not calibrated", [](const HeardCommand&) {
        return one(R"({"inverse3":[{"device_id":"049D","status":{"calibrated":false},)"
                   R"("state":{"cursor_position":{"x":0,"y":0,"z":0}}}]})");
    });
    misbehave("answers 30 ms late", [this](const HeardCommand&) {
        return std::vector<ServiceFrame>{
            {service_.state_message(), false, std::chrono::milliseconds(30)}};
    });
    misbehave("a message of 300 kB",
              [](const HeardCommand&) { return one(std::string(300'000, ' ')); });
    misbehave("300 messages for each of ours", [this](const HeardCommand&) {
        return std::vector<ServiceFrame>(300, {service_.state_message(), false, {}});
    });
    misbehave(
        "gone, and started anew", [this] { service_.stop(); }, [this] { service_.restart(); });
    device_.stop();
    const std::vector<HeardCommand> heard = service_.heard();
    check(!heard.empty() && heard.back().force == Vec3(0.0), "the last force is not zero");
    fmt::print("{}\n", is_well_ ? "all forces were limited, and zero on every fault" : "FAILED");
    return is_well_ ? 0 : 1;
}

} // namespace
} // namespace palpate

int main(int count, char** words) {
    double seconds = 60.0;
    const bool has_seconds = count == 3 && std::string_view(words[1]) == "--seconds";
    if (has_seconds) seconds = std::strtod(words[2], nullptr);
    if ((count != 1 && !has_seconds) || !(seconds > 0.0)) {
        std::fputs("usage: palpate_inverse3_soak [--seconds S]\n", stderr);
        return 2;
    }
    return palpate::Soak().run(seconds);
}
