// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// What stands behind "plugin:" in a scene: FILE, or FILE?key=value&key=value.
struct PluginAddress {
    std::string path;                                         ///< of the shared library
    std::vector<std::pair<std::string, std::string>> options; ///< what its open() is given
};

/// Takes an address apart. Throws std::runtime_error where an option has no key, no "=", or is
/// there twice, or there are more than 64.                                             [setup]
PluginAddress plugin_address(const std::string& text);

/// What a plug-in's file says of itself.
struct PluginName {
    std::string name;    ///< as "udp"
    std::string version; ///< its own, as "1.0"
};

/// Loads a plug-in's file, for as long as the program runs, and opens nothing. Throws
/// std::runtime_error that names the file, what is wrong with it, and what to do.       [setup]
PluginName plugin_name(const std::string& path);

/// What a plug-in did that was of no use.
struct PluginCounts {
    std::uint64_t states = 0;        ///< new, and used
    std::uint64_t not_later = 0;     ///< states not later than the one before, thrown away
    std::uint64_t faulty = 0;        ///< states with a number out of range, thrown away
    std::uint64_t failed_reads = 0;  ///< read said that it failed
    std::uint64_t failed_writes = 0; ///< write said that it failed
    std::uint64_t slow_calls = 0;    ///< took longer than the plug-in says; a state is thrown away
};

/// A device of somebody else: a shared library with the functions of <palpate/device_plugin.h>.
///
/// They run on a thread of their own, so that the loop never waits for them: it takes the newest
/// state, and leaves the newest force. What the plug-in does wrong is a silence: a state that is
/// faulty, late, old or not new is thrown away, and once nothing new came for the `stale_after_s`
/// that the plug-in declares, the state is stale and the force goes to zero. A plug-in whose stop
/// or close does not return is left to itself: its thread goes on, and nobody waits for it. A crash
/// within it ends the program.
///
/// A force that the loop has not renewed for kForceHold_s is replaced by zero.
class PluginDevice final : public HapticDevice {
public:
    static constexpr double kForceHold_s = 0.02; ///< longest time that a force is held, s

    /// How long the functions may take, s; those of <palpate/device_plugin.h>.
    struct Patience {
        double open_s = 31.0;  ///< open and properties, > 0
        double start_s = 10.0; ///< start, > 0
        double stop_s = 1.3;   ///< stop, after the read and the write that are under way, > 0
        double close_s = 6.3;  ///< the same, and close, > 0
    };

    /// Loads nothing yet.                                                               [setup]
    explicit PluginDevice(PluginAddress address) : PluginDevice(std::move(address), Patience{}) {}
    /// The same with another patience.                                                  [setup]
    PluginDevice(PluginAddress address, const Patience& patience);
    /// Closes.                                                                          [setup]
    ~PluginDevice() override;

    /// As the plug-in declares them once it is open; two periods of its thread are added to the
    /// delay, since a state and a force wait for it for one each at most.               [setup]
    DeviceProperties properties() const override;
    /// Loads and opens. Throws std::runtime_error with the file and the plug-in's own reason.
    /// [setup]
    void open() override;
    void start() override;
    void stop() noexcept override;
    void close() noexcept override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3& force) noexcept override;

    /// Since open(); after close() those until then. Not while another thread opens, starts, stops
    /// or closes it. [setup]
    PluginCounts counts() const noexcept;
    /// What was of no use since open(), in words, with the plug-in's first reason; also after
    /// close(). Empty: nothing was.                                                      [setup]
    std::string complaint() const;

private:
    class Runner;
    void let_go(const char* unreturned);

    PluginAddress address_;
    Patience patience_;
    std::shared_ptr<Runner> runner_; ///< its thread's, too; null: not open
    PluginCounts counts_;            ///< until close()
    std::string first_reason_;       ///< until close()
    std::string unreturned_;         ///< the function that does not return; empty: all did
    bool failed_to_stop_ = false;    ///< the last stop that was asked for
};

} // namespace palpate
