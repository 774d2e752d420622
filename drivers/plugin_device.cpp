// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/plugin_device.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <thread>

#include <palpate/drivers/internal/device_address.h>
#include <palpate/drivers/internal/device_mailbox.h>
#include <palpate/drivers/internal/plugin_library.h>

namespace palpate {
namespace {

constexpr std::size_t kMostOptions = 64;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

using PluginClock = std::chrono::steady_clock;
using internal::steady_s;

PluginClock::duration duration_of(double seconds) {
    return std::chrono::duration_cast<PluginClock::duration>(
        std::chrono::duration<double>(seconds));
}

Vec3 vec_of(const double (&values)[3]) noexcept { return {values[0], values[1], values[2]}; }

constexpr const char* kForceMayBeHeld =
    ", so that nobody knows whether a force is held: switch the device off";
constexpr int kThrew = -1000; // counts as PALPATE_PLUGIN_FAILED
constexpr const char* kLeaves = "an exception leaves it; catch it there, and let reason() tell it";

/// No exception of a plug-in gets further than this.
template <class Call>
int result_of(Call call) noexcept {
    try {
        return call();
    } catch (...) {
        return kThrew;
    }
}

DeviceState state_of(const palpate_plugin_state& said) noexcept {
    DeviceState state;
    state.time_s = said.time_s;
    state.position = vec_of(said.position_m);
    state.velocity = vec_of(said.velocity_m_per_s);
    state.buttons = said.buttons;
    state.freshness = said.is_stale != 0 ? Freshness::stale : Freshness::fresh;
    const double(&q)[4] = said.orientation;
    state.orientation = glm::normalize(Quaternion(q[0], q[1], q[2], q[3]));
    return state;
}

} // namespace

PluginAddress plugin_address(const std::string& text) {
    internal::DeviceAddress taken = internal::device_address("plugin:", text);
    const auto fail = [&](const std::string& what, const std::string& remedy) {
        throw std::runtime_error("plugin:" + text + ": " + what + "; " + remedy);
    };
    if (taken.place.empty())
        fail("names no file", "give the plug-in's shared library, as plugin:./mine.so");
    if (taken.options.size() > kMostOptions)
        fail("has more than 64 options", "put them into a file of the plug-in's own");
    return {std::move(taken.place), std::move(taken.options)};
}

PluginName plugin_name(const std::string& path) {
    const palpate_device_plugin& plugin =
        internal::load_plugin(std::filesystem::absolute(path).string());
    return {plugin.name, plugin.version};
}

/// The plug-in's thread, and what it and the others hand to each other. It belongs to both sides:
/// a plug-in that does not return keeps it alive.
class PluginDevice::Runner {
public:
    Runner(const palpate_device_plugin& plugin, PluginAddress address)
        : plugin_(plugin), address_(std::move(address)) {}

    enum class Wish : std::uint8_t { none, open, start, stop, close };

    static void begin(const std::shared_ptr<Runner>& runner) {
        runner->thread_ = std::thread([runner] { runner->run(); });
    }
    bool ask(Wish wish, double patience_s, std::string& failure);
    void join() { thread_.join(); }
    void abandon() noexcept;

    const palpate_plugin_properties& properties() const noexcept { return properties_; }
    void newest(DeviceState& state) noexcept;
    void want(const Vec3& force) noexcept { mailbox_.want(force); }
    PluginCounts counts() const noexcept;
    std::string first_reason() const {
        const std::lock_guard lock(mutex_);
        return first_reason_;
    }

private:
    void run();
    Wish next_wish();
    void answer(std::string failure);
    std::string carried_out(Wish wish);
    std::string opened();
    std::string failed(const char* function, int result) {
        return address_.path + ": " + function + ": " +
               (result == kThrew ? kLeaves : internal::reason_of(plugin_, device_));
    }
    void exchange_frames();
    void read_once();
    void write_once();
    bool took_too_long(double began_s) noexcept;
    void note(std::atomic<std::uint64_t>& count, const char* what);

    const palpate_device_plugin& plugin_;
    const PluginAddress address_;

    // The thread's alone; properties_ also the others' once it is open.
    void* device_ = nullptr;
    palpate_plugin_properties properties_ = internal::unknown_properties();
    double last_time_s_ = -kInfinite;

    // From thread to thread, without a wait.
    internal::DeviceMailbox mailbox_;
    std::atomic<double> untaken_since_s_{kInfinite};
    std::array<std::atomic<std::uint64_t>, 6> counts_{};
    std::atomic<std::uint64_t>&states_{counts_[0]}, &not_later_{counts_[1]}, &faulty_{counts_[2]},
        &failed_reads_{counts_[3]}, &failed_writes_{counts_[4]}, &slow_{counts_[5]};

    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable asked_, answered_;
    Wish wish_ = Wish::none;
    bool is_answered_ = false;
    bool is_abandoned_ = false;
    std::string failure_;
    std::string first_reason_;
    std::atomic<bool> interrupted_{false}; ///< frames are to end
    std::thread thread_;
};

/// Lets the thread carry a wish out; false where it does not within the time: nobody may ask again.
bool PluginDevice::Runner::ask(Wish wish, double patience_s, std::string& failure) {
    std::unique_lock lock(mutex_);
    wish_ = wish;
    is_answered_ = false;
    interrupted_.store(true);
    asked_.notify_all();
    if (!answered_.wait_for(lock, duration_of(patience_s), [&] { return is_answered_; }))
        return false;
    failure = failure_;
    return true;
}

/// From now on the thread is alone: if its plug-in ever returns, it stops and closes.
void PluginDevice::Runner::abandon() noexcept {
    {
        const std::lock_guard lock(mutex_);
        is_abandoned_ = true;
        interrupted_.store(true);
    }
    asked_.notify_all();
    thread_.detach();
}

PluginDevice::Runner::Wish PluginDevice::Runner::next_wish() {
    std::unique_lock lock(mutex_);
    asked_.wait(lock, [&] { return wish_ != Wish::none || is_abandoned_; });
    if (is_abandoned_) return Wish::close;
    interrupted_.store(false);
    return std::exchange(wish_, Wish::none);
}

void PluginDevice::Runner::answer(std::string failure) {
    {
        const std::lock_guard lock(mutex_);
        failure_ = std::move(failure);
        is_answered_ = true;
    }
    answered_.notify_all();
}

void PluginDevice::Runner::run() {
    for (;;) {
        const Wish wish = next_wish();
        const std::string failure = carried_out(wish);
        answer(failure);
        if (wish == Wish::close || (wish == Wish::open && !failure.empty())) return;
        if (wish == Wish::start && failure.empty()) exchange_frames();
    }
}

/// Empty, or why it could not be.
std::string PluginDevice::Runner::carried_out(Wish wish) {
    std::string failure;
    switch (wish) {
    case Wish::open:
        return opened();
    case Wish::start:
        last_time_s_ = -kInfinite;
        mailbox_.forget_force(); // it was not meant for what is felt from now on
        if (const int result = result_of([&] { return plugin_.start(device_); });
            result != PALPATE_PLUGIN_OK)
            return failed("start", result);
        return "";
    case Wish::stop:
    case Wish::close:
        if (device_ == nullptr) return "";
        if (const int result = result_of([&] { return plugin_.stop(device_); });
            result != PALPATE_PLUGIN_OK)
            failure = failed("stop", result);
        if (wish == Wish::stop) return failure;
        result_of([&] {
            plugin_.close(std::exchange(device_, nullptr));
            return 0;
        });
        return failure;
    case Wish::none:
        break;
    }
    return "";
}

std::string PluginDevice::Runner::opened() {
    std::vector<const char*> keys, values;
    keys.reserve(address_.options.size());
    values.reserve(address_.options.size());
    for (const auto& [key, value] : address_.options) {
        keys.push_back(key.c_str());
        values.push_back(value.c_str());
    }
    const palpate_plugin_options options{sizeof options, keys.size(), keys.data(), values.data()};
    const int result = result_of([&] { return plugin_.open(&options, &device_); });
    if (result != PALPATE_PLUGIN_OK || device_ == nullptr) {
        device_ = nullptr;
        return failed("open", result);
    }
    std::string failure;
    const int said = result_of([&] { return plugin_.properties(device_, &properties_); });
    if (said != PALPATE_PLUGIN_OK)
        failure = failed("properties", said);
    else if (const std::string fault = internal::fault_of(properties_); !fault.empty())
        failure = address_.path + ": properties: " + fault +
                  "; correct the plug-in, `palpate validate driver` checks it";
    if (!failure.empty()) carried_out(Wish::close);
    return failure;
}

void PluginDevice::Runner::exchange_frames() {
    const PluginClock::duration period = duration_of(1.0 / properties_.rate_hz);
    PluginClock::time_point due = PluginClock::now();
    while (!interrupted_.load(std::memory_order_relaxed)) {
        read_once();
        write_once();
        due = std::max(due + period, PluginClock::now());
        std::this_thread::sleep_until(due);
    }
}

void PluginDevice::Runner::read_once() {
    palpate_plugin_state said = internal::unknown_state();
    const double began_s = steady_s();
    const int result = result_of([&] { return plugin_.read(device_, &said); });
    if (took_too_long(began_s) || result == PALPATE_PLUGIN_NOTHING_NEW) return;
    if (result != PALPATE_PLUGIN_OK)
        return note(failed_reads_, result == kThrew ? kLeaves : nullptr);
    if (const char* fault = internal::fault_of(said)) return note(faulty_, fault);
    if (said.time_s <= last_time_s_) {
        not_later_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    last_time_s_ = said.time_s;
    states_.fetch_add(1, std::memory_order_relaxed);
    mailbox_.give(state_of(said), steady_s());
}

void PluginDevice::Runner::write_once() {
    const Vec3 force = mailbox_.force(properties_.force_n, kForceHold_s);
    const double began_s = steady_s();
    const double force_n[3] = {force.x, force.y, force.z};
    const int result = result_of([&] { return plugin_.write(device_, force_n); });
    took_too_long(began_s);
    if (result == PALPATE_PLUGIN_OK) {
        untaken_since_s_.store(kInfinite);
        return;
    }
    note(failed_writes_, result == kThrew ? kLeaves : nullptr);
    untaken_since_s_.store(std::min(untaken_since_s_.load(), began_s));
}

bool PluginDevice::Runner::took_too_long(double began_s) noexcept {
    if (steady_s() - began_s <= properties_.longest_call_s) return false;
    slow_.fetch_add(1, std::memory_order_relaxed);
    return true;
}

/// Counts, and keeps the first words that there are.
void PluginDevice::Runner::note(std::atomic<std::uint64_t>& count, const char* what) {
    if (count.fetch_add(1, std::memory_order_relaxed) > 0) return;
    const std::string reason = what != nullptr ? what : internal::reason_of(plugin_, device_);
    const std::lock_guard lock(mutex_);
    if (first_reason_.empty()) first_reason_ = reason;
}

void PluginDevice::Runner::newest(DeviceState& state) noexcept {
    if (!mailbox_.newest(state, properties_.stale_after_s) ||
        steady_s() - untaken_since_s_.load() > properties_.stale_after_s)
        state.freshness = Freshness::stale;
}

PluginCounts PluginDevice::Runner::counts() const noexcept {
    return {states_, not_later_, faulty_, failed_reads_, failed_writes_, slow_};
}

PluginDevice::PluginDevice(PluginAddress address, const Patience& patience)
    : address_(std::move(address)), patience_(patience) {}

PluginDevice::~PluginDevice() { close(); }

DeviceProperties PluginDevice::properties() const {
    return runner_ ? internal::device_properties(runner_->properties()) : DeviceProperties{};
}

/// Keeps what is to be told, and leaves the thread: ended, or to itself in a function that does not
/// return.
void PluginDevice::let_go(const char* unreturned) {
    counts_ = runner_->counts();
    first_reason_ = runner_->first_reason();
    unreturned_ = unreturned != nullptr ? unreturned : "";
    if (unreturned != nullptr)
        runner_->abandon();
    else
        runner_->join();
    runner_.reset();
}

void PluginDevice::open() {
    close();
    failed_to_stop_ = false;
    PluginAddress address = address_;
    address.path = std::filesystem::absolute(address_.path).string();
    runner_ = std::make_shared<Runner>(internal::load_plugin(address.path), address);
    Runner::begin(runner_);
    std::string failure;
    const bool returns = runner_->ask(Runner::Wish::open, patience_.open_s, failure);
    if (returns && failure.empty()) return;
    if (!returns)
        failure = address.path + ": open does not return; `palpate validate driver` helps";
    let_go(returns ? nullptr : "open");
    throw std::runtime_error(failure);
}

void PluginDevice::start() {
    if (!runner_) throw std::runtime_error(address_.path + ": is not open; open it first");
    std::string failure;
    if (!runner_->ask(Runner::Wish::start, patience_.start_s, failure)) {
        let_go("start");
        failure = address_.path + ": start does not return; `palpate validate driver` helps";
    }
    if (!failure.empty()) throw std::runtime_error(failure);
}

void PluginDevice::stop() noexcept {
    std::string failure;
    if (!runner_) return;
    if (!runner_->ask(Runner::Wish::stop, patience_.stop_s, failure)) return let_go("stop");
    failed_to_stop_ = !failure.empty();
}

void PluginDevice::close() noexcept {
    std::string failure;
    if (!runner_) return;
    const bool returns = runner_->ask(Runner::Wish::close, patience_.close_s, failure);
    failed_to_stop_ = !failure.empty();
    let_go(returns ? nullptr : "close");
}

bool PluginDevice::read(DeviceState& state) noexcept {
    if (runner_)
        runner_->newest(state);
    else
        state.freshness = Freshness::stale;
    return true;
}

void PluginDevice::write(const Vec3& force) noexcept {
    if (runner_) runner_->want(force);
}

PluginCounts PluginDevice::counts() const noexcept { return runner_ ? runner_->counts() : counts_; }

std::string PluginDevice::complaint() const {
    const PluginCounts counted = counts();
    std::string text;
    const auto tell = [&](std::uint64_t count, const char* what) {
        if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
    };
    tell(counted.failed_reads, "reads failed");
    tell(counted.failed_writes, "writes failed");
    tell(counted.faulty, "states with numbers out of range");
    tell(counted.not_later, "states not later than the one before");
    tell(counted.slow_calls, "calls that took longer than it says");
    if (failed_to_stop_)
        text += (text.empty() ? "" : ", ") + std::string("stop failed") + kForceMayBeHeld;
    if (!unreturned_.empty())
        text += (text.empty() ? "" : ", ") + unreturned_ + " did not return" + kForceMayBeHeld;
    if (text.empty()) return "";
    const std::string reason = runner_ ? runner_->first_reason() : first_reason_;
    return address_.path + ": " + text + (reason.empty() ? "" : "; the first: " + reason) +
           "; `palpate validate driver` says more";
}

} // namespace palpate
