// SPDX-License-Identifier: Apache-2.0
// The driver of the Inverse3 over a simulated service on loopback, at 1 kHz: how long a position and
// a force take, and whether the force is limited, and zero on every fault of the service.
//   palpate_inverse3_soak [--seconds S]
// S seconds of a service that behaves (default 60), then each fault for a second. A table on
// stdout; exit 1 where a force was too long or no number, where one was sent 20 ms after a fault
// began, or where states are not fresh again when it is over.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <thread>
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

/// A hand and a loop at 1 kHz: reads, and wants a force that tells when it was wanted.
class Servo {
public:
    explicit Servo(Inverse3Device& device)
        : device_(device), thread_([this] { run(); }) {}
    ~Servo() {
        stopping_.store(true);
        thread_.join();
    }
    std::uint64_t frames() const { return frames_; }
    std::uint64_t fresh() const { return fresh_; }
    std::vector<double> ages_s; ///< of fresh states, at the frame that read them; after the end
    std::vector<double> wanted_s = std::vector<double>(kMarks, 0.0); ///< when each mark was wanted
    static constexpr std::size_t kMarks = 200'000;

private:
    void run() {
        Clock::time_point due = Clock::now();
        while (!stopping_.load()) {
            DeviceState state;
            device_.read(state);
            const double read_s = now_s();
            if (state.freshness == Freshness::fresh) {
                ++fresh_;
                ages_s.push_back(read_s - state.time_s);
            }
            const std::uint64_t frame = frames_++;
            device_.write(force_of(frame));
            due = std::max(due + std::chrono::milliseconds(1), Clock::now());
            std::this_thread::sleep_until(due);
        }
    }
    /// 2.5 N, a little of which counts the frames; every hundredth is too long, or no number.
    Vec3 force_of(std::uint64_t frame) {
        if (frame % 100 == 33) return Vec3(std::numeric_limits<double>::quiet_NaN());
        if (frame % 100 == 66) return Vec3(1e9, 0.0, 0.0);
        if (frame < kMarks) wanted_s[frame] = now_s();
        return {1e-6 * static_cast<double>(frame % kMarks), 0.0, 2.5};
    }
    Inverse3Device& device_;
    std::atomic<std::uint64_t> frames_{0}, fresh_{0};
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

void print(const char* what, const Quantiles& q, std::size_t count) {
    fmt::print("{:<42} p50 {:7.3f}  p99 {:7.3f}  max {:7.3f} ms  ({})\n", what, 1e3 * q.p50,
               1e3 * q.p99, 1e3 * q.most, count);
}

class Soak {
public:
    Soak() : device_(Inverse3Device::Settings{.address = inverse3_address(service_.options())}) {
        device_.open();
        device_.start();
    }
    int run(double seconds);

private:
    bool check(bool is_so, const std::string& what) {
        if (!is_so) fmt::print("FAILED: {}\n", what);
        is_well_ = is_well_ && is_so;
        return is_so;
    }
    void look_at(const std::vector<HeardCommand>& heard);
    void behave_well(double seconds);
    void misbehave(const char* name, const std::function<void()>& begin,
                   const std::function<void()>& end);
    void misbehave(const char* name, Service::Behaviour behaviour) {
        misbehave(name, [&] { service_.behave(behaviour); }, [&] { service_.behave(nullptr); });
    }

    Service service_;
    Inverse3Device device_;
    bool is_well_ = true;
};

/// No force is too long, or no number.
void Soak::look_at(const std::vector<HeardCommand>& heard) {
    for (const HeardCommand& command : heard)
        if (!check(is_finite(command.force) &&
                       glm::length(command.force) <= kLimit_n * (1.0 + 1e-12),
                   "a force beyond its limit"))
            return;
}

void Soak::behave_well(double seconds) {
    std::vector<double> ways_s;
    std::uint64_t commands = 0;
    Servo servo(device_);
    const double end_s = now_s() + seconds;
    std::vector<HeardCommand> all;
    while (now_s() < end_s) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        const std::vector<HeardCommand> heard = service_.heard();
        all.insert(all.end(), heard.begin(), heard.end());
    }
    look_at(all);
    const std::uint64_t frames = servo.frames(), fresh = servo.fresh();
    double last = -1.0;
    for (const HeardCommand& command : all) {
        ++commands;
        const double mark = std::round(1e6 * -command.force.y); // the service's -y is our x
        if (std::abs(command.force.z - 2.5) > 1e-9 || mark == last) continue;
        last = mark;
        const double wanted_s = servo.wanted_s[static_cast<std::size_t>(mark)];
        if (wanted_s > 0.0) ways_s.push_back(command.time_s - wanted_s);
    }
    const auto counts = device_.counts();
    fmt::print("{:.0f} s: {} frames, {:.3f} % fresh, {} exchanges ({:.0f} a second), {} silences, "
               "{} late, {} unasked, {} losses\n",
               seconds, frames, 100.0 * static_cast<double>(fresh) / static_cast<double>(frames),
               commands, static_cast<double>(commands) / seconds, counts.silences, counts.late,
               counts.unasked, counts.losses);
    print("a force, from write() to the service", quantiles(ways_s), ways_s.size());
    check(counts.states > 0 && !ways_s.empty(), "nothing was exchanged");
    ages_ = &servo;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

} // namespace
} // namespace palpate
