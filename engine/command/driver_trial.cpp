// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/driver_trial.h>

#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <utility>

#include <dlfcn.h>
#include <sys/resource.h>
#include <time.h>

#include <fmt/format.h>

#include <palpate/drivers/internal/plugin_library.h>

namespace palpate::command {
namespace {

double seconds_on(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

long waits_of_thread() {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
}

/// How long a call takes: by the clock where it waited, else what it computed, so that nobody is
/// blamed for a busy machine.
template <class Call>
double seconds_of(Call call) {
    const long waits = waits_of_thread();
    const double computed_s = seconds_on(CLOCK_THREAD_CPUTIME_ID);
    const double began_s = monotonic_s();
    call();
    const double by_clock_s = monotonic_s() - began_s;
    if (waits_of_thread() > waits) return by_clock_s;
    return seconds_on(CLOCK_THREAD_CPUTIME_ID) - computed_s;
}

/// The preloaded functions of preload/call_watch.c.
struct Watch {
    void (*begin)() = reinterpret_cast<void (*)()>(dlsym(RTLD_DEFAULT, "palpate_watch_begin"));
    void (*end)(std::uint64_t*, double*) = reinterpret_cast<void (*)(std::uint64_t*, double*)>(
        dlsym(RTLD_DEFAULT, "palpate_watch_end"));
};

const Watch& watch() {
    static const Watch one;
    return one;
}

} // namespace

Verdict pass(std::string text) { return {Outcome::pass, std::move(text)}; }
Verdict fail(std::string text) { return {Outcome::fail, std::move(text)}; }
Verdict warn(std::string text) { return {Outcome::warn, std::move(text)}; }
Verdict skip(std::string text) { return {Outcome::skip, std::move(text)}; }

double monotonic_s() { return seconds_on(CLOCK_MONOTONIC); }

DriverTrial::DriverTrial(std::string driver, bool may_push) : may_push_(may_push) {
    plugin_ = own_driver(driver);
    if (plugin_ != nullptr) {
        address_.path = std::move(driver);
        return;
    }
    if (driver.starts_with("plugin:")) driver.erase(0, 7);
    address_ = plugin_address(driver);
    address_.path = std::filesystem::absolute(address_.path).string();
}

bool DriverTrial::is_own() const { return own_driver(address_.path) != nullptr; }
bool DriverTrial::may_push() const { return may_push_ || properties_.is_simulated != 0; }
bool DriverTrial::is_watched() { return watch().begin != nullptr; }

const palpate_device_plugin& DriverTrial::plugin() {
    if (plugin_ == nullptr) plugin_ = &internal::load_plugin(address_.path);
    return *plugin_;
}

void* DriverTrial::try_open(const std::string& key, std::string& reason) {
    std::vector<const char*> keys, values;
    keys.reserve(address_.options.size() + 1);
    values.reserve(address_.options.size() + 1);
    for (const auto& [known, value] : address_.options) {
        keys.push_back(known.c_str());
        values.push_back(value.c_str());
    }
    if (!key.empty()) {
        keys.push_back(key.c_str());
        values.push_back("1");
    }
    const palpate_plugin_options options{sizeof options, keys.size(), keys.data(), values.data()};
    void* device = nullptr;
    if (plugin().open(&options, &device) == PALPATE_PLUGIN_OK && device != nullptr) return device;
    const char* why = plugin().reason(nullptr);
    reason = why != nullptr ? why : "";
    return nullptr;
}

void* DriverTrial::opened() {
    if (device_ != nullptr) return device_;
    std::string reason;
    device_ = try_open("", reason);
    if (device_ == nullptr) throw fail(fmt::format("open fails: {}", reason));
    return device_;
}

const palpate_plugin_properties& DriverTrial::properties() {
    if (properties_.size != 0) return properties_;
    palpate_plugin_properties said = internal::unknown_properties();
    if (plugin().properties(opened(), &said) != PALPATE_PLUGIN_OK)
        throw fail(fmt::format("properties fails: {}", internal::reason_of(plugin(), device_)));
    return properties_ = said;
}

void* DriverTrial::started() {
    properties();
    if (!is_started_ && plugin().start(device_) != PALPATE_PLUGIN_OK)
        throw fail(fmt::format("start fails: {}", internal::reason_of(plugin(), device_)));
    is_started_ = true;
    return device_;
}

void DriverTrial::stop() {
    is_started_ = false;
    if (plugin().stop(opened()) != PALPATE_PLUGIN_OK)
        throw fail(fmt::format("stop fails: {}", internal::reason_of(plugin(), device_)));
}

void DriverTrial::close() {
    if (device_ == nullptr) return;
    plugin().close(std::exchange(device_, nullptr));
    is_started_ = false;
    properties_ = {};
}

Exchange DriverTrial::exchange(const double (&force_n)[3]) {
    Exchange one{};
    one.state = internal::unknown_state();
    one.began_s = monotonic_s();
    if (is_watched()) watch().begin();
    one.read_s = seconds_of([&] { one.read = plugin().read(device_, &one.state); });
    one.write_s = seconds_of([&] { one.write = plugin().write(device_, force_n); });
    if (is_watched()) watch().end(&one.allocations, &one.lock_s);
    return one;
}

void DriverTrial::wait_for_next() {
    const double now_s = monotonic_s();
    due_s_ = std::max(due_s_ + 1.0 / properties().rate_hz, now_s);
    std::this_thread::sleep_for(std::chrono::duration<double>(due_s_ - now_s));
}

Exchange DriverTrial::first_state() {
    constexpr double kLongest_s = 2.0;
    started();
    const double began_s = monotonic_s();
    while (monotonic_s() - began_s < kLongest_s) {
        const Exchange one = exchange({0.0, 0.0, 0.0});
        if (one.read == PALPATE_PLUGIN_OK) return one;
        wait_for_next();
    }
    throw fail(
        "no state came within 2 s of start; let read return PALPATE_PLUGIN_OK, and make sure "
        "that the device is there and says something");
}

std::vector<Exchange> DriverTrial::exchanges(double least_s) {
    return exchanges_with(least_s, [](const Exchange&, double(&)[3]) {});
}

std::vector<palpate_plugin_state> good_states(std::span<const Exchange> exchanges) {
    std::vector<palpate_plugin_state> states;
    states.reserve(exchanges.size());
    for (const Exchange& one : exchanges)
        if (one.read == PALPATE_PLUGIN_OK && internal::fault_of(one.state) == nullptr &&
            (states.empty() || one.state.time_s > states.back().time_s))
            states.push_back(one.state);
    return states;
}

} // namespace palpate::command
