// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/inverse3_device.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include <palpate/drivers/internal/device_mailbox.h>
#include <palpate/drivers/internal/inverse3_greeting.h>

namespace palpate {

using internal::kFarewell_s;
using internal::ServiceInventory;
using internal::steady_s;
using internal::WebSocketClient;
using Event = WebSocketClient::Event;

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr int kMostUnasked = 100; // messages a second that answer nothing

std::string where(const Inverse3Address& address) {
    return address.host + ":" + std::to_string(address.port);
}

/// How messages call the device.
std::string named(const Inverse3Address& address) {
    return address.device_id.empty() ? "inverse3" : "inverse3:" + address.device_id;
}

} // namespace

/// The connection and its thread. What is said about the exchange is said in seconds of steady_s().
class Inverse3Device::Link {
public:
    explicit Link(Settings settings) : settings_(std::move(settings)) {}

    DeviceProperties properties() const;
    void open();
    void start();
    void stop();
    void close();
    void newest(DeviceState& state) noexcept {
        if (!mailbox_.newest(state, settings_.stale_after_s)) state.freshness = Freshness::stale;
    }
    void want(const Vec3& force) noexcept { mailbox_.want(force); }
    Counts counts() const noexcept;
    std::string complaint() const;

private:
    using Fault = internal::ServiceReading::Fault;

    void connect();
    void choose(const ServiceInventory& inventory);
    void greet(const ServiceInventory& inventory);
    void run() noexcept;
    void find_again();
    void begin_anew();
    void exchange();
    void send(const Vec3& force);
    void take_message();
    void use(const internal::ServiceReading& reading, double now_s);
    bool floods(double now_s);
    void listen_for_echo(const internal::ServiceReading& reading);
    void lose(const std::string& why);
    void say_farewell();
    std::atomic<std::uint64_t>& count_of(Fault fault) noexcept;
    void note(std::atomic<std::uint64_t>& count, const std::string& what);

    const Settings settings_;
    internal::DeviceMailbox mailbox_;
    std::atomic<std::uint64_t> states_{0}, late_{0}, unasked_{0}, unreadable_{0}, not_there_{0},
        out_of_range_{0}, uncalibrated_{0}, silences_{0}, connections_{0}, losses_{0};
    std::atomic<bool> is_deaf_{false}; ///< the service says that it applies none of our forces
    mutable std::mutex mutex_;         ///< of what follows
    std::string first_reason_;

    // Of whoever talks to the service: the thread between start() and stop(), else their caller.
    WebSocketClient socket_;
    internal::ServiceDevice chosen_;
    std::string grip_;
    internal::ForceKey key_ = internal::ForceKey::values;
    std::uint32_t trial_ = 0;
    double began_s_ = kNever; ///< the first start(): the zero of the states' times
    int owed_ = 0;            ///< messages sent that are not answered
    double sent_s_ = 0.0;     ///< the last one
    double due_s_ = 0.0;      ///< the next one
    double used_s_ = kNever;  ///< the last state that was of use
    double pinged_s_ = 0.0;   ///< the last ping
    bool is_unread_ = false;  ///< the service has not said that it has read all of ours
    double lost_s_ = 0.0;     ///< until then the next one has to come
    double retry_s_ = 0.0;    ///< the next look for a service that was left
    double second_s_ = 0.0;   ///< since then unasked messages are counted
    int unasked_now_ = 0;     ///< since second_s_
    double sent_n_ = 0.0;     ///< length of the force sent last
    int unheard_ = 0;         ///< states in a row whose echo is zero while a force is sent
    bool has_echoed_ = false; ///< one was not

    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

DeviceProperties Inverse3Device::Link::properties() const {
    DeviceProperties known;
    known.name = "Haply " + (chosen_.type.empty() ? std::string("inverse3") : chosen_.type) + " " +
                 (chosen_.id.empty() ? settings_.address.device_id : chosen_.id) +
                 (chosen_.handedness.empty() ? "" : " (" + chosen_.handedness + ")");
    known.force_n = settings_.address.force_n;
    // The makers' examples have floors of 1000 N/m at 1 kHz: k T / 2 of that (docs/devices.md).
    known.damping_n_s_per_m = 0.5;
    known.delay_s = 2.0 / settings_.rate_hz; // a state and a force wait for a period each
    return known;
}

void Inverse3Device::Link::open() {
    if (!socket_.is_open()) connect();
}

/// Connects and greets. Throws where there is no such device.
void Inverse3Device::Link::connect() {
    const Inverse3Address& address = settings_.address;
    const internal::Greeted outcome = internal::greeted(socket_, address, settings_.patience_s);
    if (!outcome.inventory) {
        socket_.drop();
        throw std::runtime_error(
            named(address) + ": " +
            (outcome.answer == InverseService::Answer::nobody
                 ? "no Inverse Service answers at "
                 : "what answers is no Inverse Service of version 3.1 or later, at ") +
            where(address) + " (" + outcome.reason +
            "); start Haply's service or Haply Hub, or give ?host=ADDRESS&port=PORT");
    }
    try {
        choose(*outcome.inventory);
        greet(*outcome.inventory);
    } catch (const std::runtime_error&) {
        socket_.close(kFarewell_s);
        throw;
    }
    connections_.fetch_add(1);
}

/// The device, which from the first time on is always the same one, and its grip.
void Inverse3Device::Link::choose(const ServiceInventory& inventory) {
    const std::string& wanted = chosen_.id.empty() ? settings_.address.device_id : chosen_.id;
    const auto fail = [&](const std::string& what) {
        throw std::runtime_error(named(settings_.address) + ": " + what);
    };
    std::string ids;
    const internal::ServiceDevice* found = nullptr;
    for (const internal::ServiceDevice& one : inventory.devices) {
        if (found == nullptr && (wanted.empty() || one.id == wanted)) found = &one;
        ids += (ids.empty() ? "" : ", ") + one.id;
    }
    if (inventory.devices.empty())
        fail("the Inverse Service at " + where(settings_.address) +
             " has no device; plug one in and switch it on");
    if (found == nullptr)
        fail("the Inverse Service at " + where(settings_.address) + " has " + ids + " and no " +
             wanted + "; give one of these");
    if (!found->is_calibrated)
        fail(found->id + " is not calibrated, so its positions are of no use; put the grip on its "
                         "rest until the light is steady");
    if (chosen_.id.empty()) chosen_ = *found; // properties() may be asked meanwhile
    key_ = inventory.key;
    grip_ = settings_.address.grip_id;
    if (grip_.empty() && inventory.grips.size() == 1) grip_ = inventory.grips.front();
}

void Inverse3Device::Link::greet(const ServiceInventory& inventory) {
    const std::string words = internal::greeting(inventory, chosen_.id);
    if (words.empty()) return;
    if (socket_.send(words) &&
        socket_.wait(internal::in_seconds(settings_.patience_s)) == Event::message)
        return;
    throw std::runtime_error(named(settings_.address) + ": the Inverse Service at " +
                             where(settings_.address) + " does not answer; start it anew");
}

void Inverse3Device::Link::start() {
    if (thread_.joinable()) return;
    if (!socket_.is_open()) throw std::runtime_error(named(settings_.address) + ": is not open");
    socket_.resume();
    stopping_.store(false);
    if (began_s_ == kNever) began_s_ = steady_s();
    begin_anew();
    thread_ = std::thread([this] { run(); });
}

void Inverse3Device::Link::stop() {
    stopping_.store(true);
    socket_.interrupt();
    if (thread_.joinable()) thread_.join();
    socket_.resume();
    if (socket_.is_open()) say_farewell();
}

/// The last thing that the service hears is a zero force.
void Inverse3Device::Link::say_farewell() {
    const auto until = internal::in_seconds(kFarewell_s);
    const auto goes_on = [&] {
        const Event event = socket_.wait(until);
        if (event == Event::message && owed_ > 0) --owed_;
        return event == Event::message || event == Event::pong;
    };
    while (socket_.is_sending() && goes_on()) {
    }
    if (!socket_.send(internal::force_command(chosen_.id, key_, Vec3{0.0}))) return;
    ++owed_;
    while (owed_ > 0 && goes_on()) {
    }
}

void Inverse3Device::Link::close() {
    stop();
    socket_.close(kFarewell_s);
}

void Inverse3Device::Link::run() noexcept {
    while (!stopping_.load()) {
        try {
            if (socket_.is_open())
                exchange();
            else
                find_again();
        } catch (const std::exception& error) {
            lose(error.what());
        }
    }
}

void Inverse3Device::Link::lose(const std::string& why) {
    note(losses_, why);
    socket_.drop();
    ++trial_;
    retry_s_ = steady_s() + settings_.reconnect_s;
}

/// Nothing is owed, and what was said before is not listened to.
void Inverse3Device::Link::begin_anew() {
    constexpr double kLeftover_s = 0.002; // a message that was sent has long come
    for (int i = 0; i < kMostUnasked; ++i)
        if (const Event event = socket_.wait(internal::in_seconds(kLeftover_s));
            event != Event::message && event != Event::pong)
            break;
    mailbox_.forget_force(); // it was not meant for what is here now
    owed_ = unasked_now_ = unheard_ = 0;
    is_unread_ = false;
    used_s_ = kNever;
    due_s_ = second_s_ = steady_s();
    lost_s_ = due_s_ + settings_.lost_after_s;
}

void Inverse3Device::Link::find_again() {
    const double wait_s = retry_s_ - steady_s();
    if (wait_s > 0.0 && socket_.wait(internal::in_seconds(wait_s)) != Event::quiet) return;
    retry_s_ = steady_s() + settings_.reconnect_s;
    try {
        connect();
    } catch (const std::runtime_error&) {
        return; // not there yet: whoever asks sees states that are stale
    }
    begin_anew();
}

/// One turn: a force where one is due, or the wait for what answers it.
void Inverse3Device::Link::exchange() {
    const double now_s = steady_s();
    if (now_s > lost_s_) return lose("it says nothing of use");
    const auto is_answered = [&] { return owed_ == 0 && !is_unread_; };
    if (is_answered() && now_s >= due_s_) {
        const bool is_fresh = now_s - used_s_ <= settings_.stale_after_s;
        send(is_fresh ? mailbox_.force(settings_.address.force_n, settings_.force_hold_s)
                      : Vec3{0.0});
    }
    const double until_s = is_answered() ? due_s_ : sent_s_ + settings_.stale_after_s;
    const double began_s = steady_s();
    const Event event = socket_.wait(internal::in_seconds(until_s - began_s));
    // The time in which this thread did not run is no silence of the service.
    lost_s_ += std::max(0.0, steady_s() - std::max(until_s, began_s));
    switch (event) {
    case Event::message:
        return take_message();
    case Event::pong:
        is_unread_ = false;
        return;
    case Event::closed:
        return lose(socket_.failure());
    case Event::quiet:
        if (is_answered() || steady_s() < until_s) return;
        note(silences_, "a message was not answered in time");
        return send(Vec3{0.0});
    case Event::interrupted:
        return;
    }
}

void Inverse3Device::Link::send(const Vec3& force) {
    sent_s_ = steady_s();
    due_s_ = std::max(due_s_ + 1.0 / settings_.rate_hz, sent_s_);
    if (!socket_.send(internal::force_command(chosen_.id, key_, force))) return;
    sent_n_ = glm::length(force);
    ++owed_;
    if (!socket_.ping()) return; // the one before is not answered
    is_unread_ = true;
    pinged_s_ = sent_s_;
}

/// Each message of ours is answered by one of the service's, in order. So the answer to the newest
/// of ours is the one after which none is owed, and what it tells is no older than that message. A
/// service that says more than that would be taken at its word too early, and our messages would
/// pile up in front of it: the pong that is waited for before the next one says that none does.
void Inverse3Device::Link::take_message() {
    const double now_s = steady_s();
    if (owed_ == 0) {
        note(unasked_, "a message came unasked");
        if (floods(now_s)) lose("it floods");
        return;
    }
    if (--owed_ == 0) due_s_ = std::max(due_s_, now_s);
    const double asked_s = is_unread_ ? pinged_s_ : sent_s_;
    if (owed_ > 0 || now_s - asked_s > settings_.stale_after_s)
        return note(late_, "an answer came too late");
    internal::ServiceReading reading;
    reading.fault = Fault::unreadable;
    if (socket_.is_text()) reading = internal::reading_in(socket_.message(), chosen_.id, grip_);
    if (reading.fault != Fault::none)
        return note(count_of(reading.fault), internal::in_words(reading.fault));
    use(reading, now_s);
}

void Inverse3Device::Link::use(const internal::ServiceReading& reading, double now_s) {
    DeviceState state = reading.state;
    state.time_s = now_s - began_s_;
    state.trial = trial_;
    mailbox_.give(state, sent_s_);
    used_s_ = sent_s_;
    lost_s_ = now_s + settings_.lost_after_s;
    states_.fetch_add(1, std::memory_order_relaxed);
    listen_for_echo(reading);
}

bool Inverse3Device::Link::floods(double now_s) {
    if (now_s - second_s_ > 1.0) {
        second_s_ = now_s;
        unasked_now_ = 0;
    }
    return ++unasked_now_ > kMostUnasked;
}

/// A service that tells what it applies, and for half a second of forces tells zero, has another
/// spelling of commands than its first message lets expect.
void Inverse3Device::Link::listen_for_echo(const internal::ServiceReading& reading) {
    constexpr double kFelt_n = 0.1;
    if (!reading.force_echo || has_echoed_) return;
    has_echoed_ = glm::length(*reading.force_echo) > 0.0;
    unheard_ = sent_n_ > kFelt_n ? unheard_ + 1 : 0;
    if (!has_echoed_ && unheard_ > 0.5 * settings_.rate_hz) is_deaf_.store(true);
    if (has_echoed_) is_deaf_.store(false);
}

std::atomic<std::uint64_t>& Inverse3Device::Link::count_of(Fault fault) noexcept {
    switch (fault) {
    case Fault::not_there:
        return not_there_;
    case Fault::out_of_range:
        return out_of_range_;
    case Fault::uncalibrated:
        return uncalibrated_;
    default:
        return unreadable_;
    }
}

/// Counts, and keeps the first words that there are.
void Inverse3Device::Link::note(std::atomic<std::uint64_t>& count, const std::string& what) {
    if (count.fetch_add(1, std::memory_order_relaxed) > 0) return;
    const std::lock_guard lock(mutex_);
    if (first_reason_.empty()) first_reason_ = what;
}

Inverse3Device::Counts Inverse3Device::Link::counts() const noexcept {
    return {states_,       late_,         unasked_,  unreadable_,  not_there_,
            out_of_range_, uncalibrated_, silences_, connections_, losses_};
}

std::string Inverse3Device::Link::complaint() const {
    std::string text;
    const auto tell = [&](std::uint64_t count, const char* what) {
        if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
    };
    tell(losses_, "times the service was lost");
    tell(silences_, "messages without an answer in time");
    tell(late_, "answers too late");
    tell(unasked_, "messages unasked");
    tell(unreadable_, "messages without states");
    tell(not_there_, "without the device");
    tell(out_of_range_, "with numbers out of range");
    tell(uncalibrated_, "of a device that is not calibrated");
    const std::string name = named(settings_.address) + ": ";
    if (is_deaf_)
        return name + "the service says that it applies no force of those that it was sent; "
                      "if nothing was felt, its version spells forces in another way";
    if (text.empty()) return "";
    const std::lock_guard lock(mutex_);
    return name + text + "; the first: " + first_reason_ +
           "; look at the service, and at the load of this computer";
}

Inverse3Device::Inverse3Device(Settings settings) {
    const auto require = [](bool is_so, const char* what) {
        if (!is_so) throw std::invalid_argument(what);
    };
    require(settings.rate_hz >= 50.0 && settings.rate_hz <= 4000.0, "rate_hz: in [50, 4000]");
    constexpr double kMost_s = 3600.0;
    const auto is_time = [](double seconds) { return seconds > 0.0 && seconds <= kMost_s; };
    require(is_time(settings.stale_after_s), "stale_after_s: in (0, 3600]");
    require(is_time(settings.force_hold_s), "force_hold_s: in (0, 3600]");
    require(is_time(settings.lost_after_s) && settings.lost_after_s > settings.stale_after_s,
            "lost_after_s: > stale_after_s, up to 3600");
    require(is_time(settings.reconnect_s), "reconnect_s: in (0, 3600]");
    require(is_time(settings.patience_s), "patience_s: in (0, 3600]");
    require(settings.address.force_n > 0.0 && settings.address.force_n <= internal::kMostForce_n,
            "force_n: in (0, 10]");
    link_ = std::make_unique<Link>(std::move(settings));
}

Inverse3Device::~Inverse3Device() { close(); }

DeviceProperties Inverse3Device::properties() const { return link_->properties(); }
void Inverse3Device::open() { link_->open(); }
void Inverse3Device::start() { link_->start(); }

void Inverse3Device::stop() noexcept {
    try {
        link_->stop();
    } catch (const std::exception&) {
        // Out of memory: the connection ends with the next close().
    }
}

void Inverse3Device::close() noexcept {
    try {
        link_->close();
    } catch (const std::exception&) {
        // As above.
    }
}

bool Inverse3Device::read(DeviceState& state) noexcept {
    link_->newest(state);
    return true;
}

void Inverse3Device::write(const Vec3& force) noexcept { link_->want(force); }

Inverse3Device::Counts Inverse3Device::counts() const noexcept { return link_->counts(); }
std::string Inverse3Device::complaint() const { return link_->complaint(); }

} // namespace palpate
