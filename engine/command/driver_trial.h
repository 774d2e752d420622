// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/device_plugin.h>
#include <palpate/drivers/haptic_device.h>
#include <palpate/drivers/plugin_device.h>
#include <palpate/engine/command/check_suite.h>

namespace palpate::command {

/// A read and a write, as the check's thread saw them.
struct Exchange {
    palpate_plugin_state state; ///< as the plug-in left it
    int read = 0;               ///< what read returned
    int write = 0;              ///< what write returned
    double began_s = 0.0;       ///< when read was called, CLOCK_MONOTONIC
    double read_s = 0.0;        ///< how long it took; without what other programs took
    double write_s = 0.0;
    Watched watched; ///< what both did
};

/// Makes a device of Palpate's own; not open yet. May throw.                             [setup]
using DeviceMaker = std::function<std::unique_ptr<HapticDevice>()>;

/// A driver under test: a plug-in, or one of our own behind the same functions. One check, one
/// process, one trial. What it does not let a check do it throws as a Verdict.
class DriverTrial {
public:
    /// What is allowed, and how much is asked.
    struct Settings {
        bool may_push = false;      ///< forces may be as long as the device can hold
        long long frames = 100'000; ///< of the check `endurance`
        double longest_s = 30.0;    ///< of the check `endurance`
    };

    /// `driver` as --device takes it, a plug-in also without "plugin:".
    DriverTrial(std::string driver, const Settings& settings);
    /// A driver of our own; one such trial at a time.
    DriverTrial(DeviceMaker make, const Settings& settings);
    /// Stops and closes a driver of our own, so that its device holds nothing afterwards. A plug-in
    /// is left as it is: what it does then would be blamed on the check.
    ~DriverTrial();
    DriverTrial(const DriverTrial&) = delete;
    DriverTrial& operator=(const DriverTrial&) = delete;

    bool is_own() const { return is_own_; } ///< no file to look at
    const std::string& path() const { return address_.path; }
    bool may_push() const;
    long long frames() const { return settings_.frames; }
    double longest_s() const { return settings_.longest_s; }

    const palpate_device_plugin& plugin();
    /// Opens another one, with an option more where `key` is not empty; null where it refuses, and
    /// then with a reason.
    void* try_open(const std::string& key, std::string& reason);
    void* opened();                                ///< opens it at the first call
    const palpate_plugin_properties& properties(); ///< of the opened one
    void* started();                               ///< starts it at the first call
    void stop();
    void close();

    /// One exchange with this force, N.
    Exchange exchange(const double (&force_n)[3]);
    /// Exchanges at the device's rate, without force, for at least `least_s`.
    std::vector<Exchange> exchanges(double least_s = 0.3);
    /// The same; `next` gives each force from the exchange before.
    template <class Next>
    std::vector<Exchange> exchanges_with(double least_s, Next next);
    /// What is waited between two exchanges.
    void wait_for_next();
    /// A state that is new, within two seconds, and fresh where one comes that is; else throws.
    Exchange first_state();

private:
    void* open_one(const std::string& key, std::string& reason);

    PluginAddress address_;
    Settings settings_;
    bool is_own_ = false;
    const palpate_device_plugin* plugin_ = nullptr;
    void* device_ = nullptr;
    std::vector<void*> beside_; ///< what try_open() has opened
    bool is_started_ = false;
    palpate_plugin_properties properties_{};
    double due_s_ = 0.0;
};

template <class Next>
std::vector<Exchange> DriverTrial::exchanges_with(double least_s, Next next) {
    std::vector<Exchange> all;
    all.reserve(static_cast<std::size_t>(4.0 * least_s * properties().rate_hz));
    const Exchange first = first_state();
    all.push_back(first);
    while (all.back().began_s - first.began_s < least_s || all.size() < 60) {
        double force_n[3] = {};
        next(all.back(), force_n);
        wait_for_next();
        all.push_back(exchange(force_n));
    }
    return all;
}

/// The states of exchanges that are new and in range, in order of time.
std::vector<palpate_plugin_state> good_states(std::span<const Exchange> exchanges);

/// Why a force cannot be checked.
inline constexpr const char* kUnseen =
    "held_force_n is not set with each state, new or not, so nobody can see it";

using DriverCheck = Check<DriverTrial>;

/// All of them, in their order.
std::span<const DriverCheck> library_checks();
std::span<const DriverCheck> life_checks();
std::span<const DriverCheck> state_checks();
std::span<const DriverCheck> call_checks();
std::span<const DriverCheck> force_checks();
std::span<const DriverCheck> end_checks();

/// The driver of our own that is named: hand, path:FILE, hid:ADDRESS, inverse3,
/// igtl:TRANSFORM@HOST:PORT; null: none is.                                               [setup]
DeviceMaker own_driver(const std::string& name);
/// Such a driver behind a plug-in's functions, of which there is one in a process.        [setup]
const palpate_device_plugin& plugin_of(DeviceMaker make);

} // namespace palpate::command
