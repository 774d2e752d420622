// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/driver_trial.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include <fmt/format.h>

#include <palpate/drivers/internal/plugin_library.h>
#include <palpate/engine/command/command.h>

namespace palpate::command {
namespace {

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
    const double computed_s = thread_cpu_s();
    const double began_s = monotonic_s();
    call();
    const double by_clock_s = monotonic_s() - began_s;
    if (waits_of_thread() > waits) return by_clock_s;
    return thread_cpu_s() - computed_s;
}

/// A call of a plug-in's function, which lets no exception out.
template <class Call>
int called(const char* function, Call call) {
    const auto say = [&](const std::string& what) {
        return fail(fmt::format(
            "an exception leaves {}{}; catch it there, and let reason() tell it", function, what));
    };
    try {
        return call();
    } catch (const std::exception& error) {
        throw say(fmt::format(" ({})", error.what()));
    } catch (...) {
        throw say("");
    }
}

} // namespace

DriverTrial::DriverTrial(std::string driver, const Settings& settings) : settings_(settings) {
    if (DeviceMaker make = own_driver(driver)) {
        is_own_ = true;
        plugin_ = &plugin_of(std::move(make));
        return;
    }
    if (driver.find_first_of("./") == std::string::npos)
        throw UsageError(fmt::format(
            "validate driver {}: there is no such driver, and a plug-in's file has a \".\" or "
            "\"/\" in it; drivers: hand, path:FILE, hid:ADDRESS, inverse3, "
            "igtl:TRANSFORM@HOST:PORT",
            driver));
    if (driver.starts_with("plugin:")) driver.erase(0, 7);
    address_ = plugin_address(driver);
    address_.path = std::filesystem::absolute(address_.path).string();
}

DriverTrial::DriverTrial(DeviceMaker make, const Settings& settings)
    : settings_(settings), is_own_(true), plugin_(&plugin_of(std::move(make))) {}

DriverTrial::~DriverTrial() {
    if (!is_own_) return;
    if (device_ != nullptr) beside_.push_back(device_);
    for (void* device : beside_) {
        plugin_->stop(device); // functions of ours that throw nothing
        plugin_->close(device);
    }
}

bool DriverTrial::may_push() const { return settings_.may_push || properties_.is_simulated != 0; }

const palpate_device_plugin& DriverTrial::plugin() {
    if (plugin_ == nullptr) plugin_ = &internal::load_plugin(address_.path);
    return *plugin_;
}

void* DriverTrial::try_open(const std::string& key, std::string& reason) {
    void* device = open_one(key, reason);
    if (device != nullptr) beside_.push_back(device);
    return device;
}

void* DriverTrial::open_one(const std::string& key, std::string& reason) {
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
    const int result = called("open", [&] { return plugin().open(&options, &device); });
    if (result == PALPATE_PLUGIN_OK && device != nullptr) return device;
    const char* why = plugin().reason(nullptr);
    reason = why != nullptr ? why : "";
    return nullptr;
}

void* DriverTrial::opened() {
    if (device_ != nullptr) return device_;
    std::string reason;
    device_ = open_one("", reason);
    if (device_ == nullptr) throw fail(fmt::format("open fails: {}", reason));
    return device_;
}

const palpate_plugin_properties& DriverTrial::properties() {
    if (properties_.size != 0) return properties_;
    palpate_plugin_properties said = internal::unknown_properties();
    opened();
    if (called("properties", [&] { return plugin().properties(device_, &said); }) !=
        PALPATE_PLUGIN_OK)
        throw fail(fmt::format("properties fails: {}", internal::reason_of(plugin(), device_)));
    return properties_ = said;
}

void* DriverTrial::started() {
    properties();
    if (!is_started_ &&
        called("start", [&] { return plugin().start(device_); }) != PALPATE_PLUGIN_OK)
        throw fail(fmt::format("start fails: {}", internal::reason_of(plugin(), device_)));
    is_started_ = true;
    return device_;
}

void DriverTrial::stop() {
    is_started_ = false;
    opened();
    if (called("stop", [&] { return plugin().stop(device_); }) != PALPATE_PLUGIN_OK)
        throw fail(fmt::format("stop fails: {}", internal::reason_of(plugin(), device_)));
}

void DriverTrial::close() {
    if (device_ == nullptr) return;
    called("close", [&] {
        plugin().close(std::exchange(device_, nullptr));
        return 0;
    });
    is_started_ = false;
    properties_ = {};
}

Exchange DriverTrial::exchange(const double (&force_n)[3]) {
    Exchange one{};
    one.state = internal::unknown_state();
    one.began_s = monotonic_s();
    begin_watch();
    one.read_s = seconds_of(
        [&] { one.read = called("read", [&] { return plugin().read(device_, &one.state); }); });
    one.write_s = seconds_of(
        [&] { one.write = called("write", [&] { return plugin().write(device_, force_n); }); });
    one.watched = end_watch();
    return one;
}

void DriverTrial::wait_for_next() {
    const double now_s = monotonic_s();
    due_s_ = std::max(due_s_ + 1.0 / properties().rate_hz, now_s);
    std::this_thread::sleep_for(std::chrono::duration<double>(due_s_ - now_s));
}

Exchange DriverTrial::first_state() {
    constexpr double kLongest_s = 2.0;
    constexpr int kLateLooks = 50;
    started();
    const double began_s = monotonic_s();
    std::optional<Exchange> stale; // until it has said anything, a device is wherever it likes
    // After a stall of this process the device has its turn all the same.
    for (int late = 0; monotonic_s() - began_s < kLongest_s || ++late <= kLateLooks;) {
        const Exchange one = exchange({0.0, 0.0, 0.0});
        if (one.read == PALPATE_PLUGIN_OK && one.state.is_stale == 0) return one;
        if (one.read == PALPATE_PLUGIN_OK) stale = one;
        wait_for_next();
    }
    if (stale) return *stale;
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
