// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <stdexcept>
#include <utility>

#include <palpate/drivers/internal/hid_stream.h>
#include <palpate/drivers/internal/newest_value.h>
#include <palpate/drivers/internal/pid_reports.h>
#include <palpate/drivers/pid_device.h>

namespace palpate {
namespace {

using internal::HidPort;
using internal::PidAxis;
using internal::PidControl;
using internal::PidReports;

constexpr double kNever = -std::numeric_limits<double>::infinity();
/// Sticks that say nothing by themselves are told of forces so often.
constexpr std::chrono::milliseconds kWritePeriod{2};
/// An effect of "infinite" duration may end after half a minute: it is started again before that.
constexpr double kRestartS = 10.0;

struct Force {
    Vec3 newtons{0.0};
    double time_s = kNever;
};

/// One of the two effects.
struct PidEffect {
    std::uint8_t number = 0;
    std::vector<std::uint8_t> force; ///< the report that sets its magnitude
    std::vector<std::uint8_t> start; ///< and the one that starts it
    double started_s = kNever;
};

void check(bool right, const char* what, double value) {
    if (!right)
        throw std::invalid_argument(std::string("force feedback stick: ") + what + ", not " +
                                    std::to_string(value));
}

PidSettings checked(PidSettings settings) {
    const auto above_zero = [](double value, const char* what) {
        check(std::isfinite(value) && value > 0.0, what, value);
    };
    const auto sign = [](double value, const char* what) {
        check(std::abs(value) == 1.0, what, value);
    };
    above_zero(settings.force_n, "force_n must be above 0");
    above_zero(settings.reach_m, "reach_m must be above 0");
    above_zero(settings.stiffness_n_per_m, "stiffness_n_per_m must be above 0");
    above_zero(settings.stale_after_s, "stale_after_s must be above 0");
    above_zero(settings.force_hold_s, "force_hold_s must be above 0");
    sign(settings.towards_sign, "towards_sign must be 1 or -1");
    sign(settings.right_sign, "right_sign must be 1 or -1");
    check(settings.damping_n_s_per_m >= 0.0, "damping_n_s_per_m must be at least 0",
          settings.damping_n_s_per_m);
    check(settings.reconnect_s > 0.0 && settings.reconnect_s <= 3600.0,
          "reconnect_s must be above 0 and at most 3600", settings.reconnect_s);
    return settings;
}

} // namespace

/// The protocol, and what its threads and the servo hand to each other.
class PidDevice::Stick final : public internal::HidProtocol {
public:
    explicit Stick(PidSettings settings)
        : settings_(checked(std::move(settings))),
          stream_(*this, {kWritePeriod,
                          std::chrono::milliseconds(std::lround(1e3 * settings_.reconnect_s))}) {}

    internal::HidStream& stream() noexcept { return stream_; }
    DeviceProperties properties() const;
    DeviceState newest_state() noexcept;
    void take_force(const Vec3& force) noexcept {
        forces_.give({is_finite(force) ? force : Vec3(0.0), internal::hid_time_s()});
    }

    std::string find() override;
    void forget_force() noexcept override {
        forces_.take(force_);
        force_ = {};
    }
    void connected(HidPort& port) override;
    void release(HidPort& port) noexcept override;
    void received(std::span<const std::uint8_t> report, double time_s) noexcept override;
    void caught_up() noexcept override;
    std::size_t compose(std::span<std::uint8_t> report) noexcept override;
    /// Whether its effects were taken out of the stick. While no thread runs.           [setup]
    bool is_released() const noexcept { return is_released_; }

private:
    PidEffect load_effect(HidPort& port, PidAxis axis) const;
    double magnitude(PidAxis axis, double now_s) const noexcept;

    const PidSettings settings_;
    const double began_s_ = internal::hid_time_s();

    // Set while connecting, when neither thread runs on.
    std::string path_;
    std::optional<PidReports> reports_;
    double step_m_ = 0.0; ///< what positions are rounded to

    // The reader's.
    DeviceState reported_;
    double moved_s_ = kNever;             ///< time of the last report of the stick itself
    std::atomic<double> heard_s_{kNever}; ///< the same, when the servo may have it

    // The writer's.
    std::array<PidEffect, 2> effects_; ///< x and y of the stick
    bool is_released_ = false;         ///< since connected()
    std::size_t next_ = 0;             ///< they take turns
    Force force_;

    // The servo's.
    DeviceState state_;

    internal::NewestValue<DeviceState> states_; ///< reader to servo
    internal::NewestValue<Force> forces_;       ///< servo to writer

    internal::HidStream stream_; ///< last: its threads use all of the above
};

DeviceProperties PidDevice::Stick::properties() const {
    DeviceProperties known;
    known.name = path_.empty() ? "force feedback stick" : "force feedback stick at " + path_;
    known.force_n = settings_.force_n;
    known.stiffness_n_per_m = settings_.stiffness_n_per_m;
    known.damping_n_s_per_m = settings_.damping_n_s_per_m;
    known.position_step_m = step_m_;
    known.delay_s = 4e-3; // each axis waits for its turn, which comes every second write
    known.workspace_m = {Vec3(-settings_.reach_m, -settings_.reach_m, 0.0),
                         Vec3(settings_.reach_m, settings_.reach_m, 0.0)};
    return known;
}

std::string PidDevice::Stick::find() {
    if (!settings_.path.empty()) return settings_.path;
    for (const internal::HidDeviceInfo& info : internal::attached_hid_devices()) {
        try {
            const PidReports readable(internal::read_hid_descriptor(
                                          internal::hid_report_descriptor(info.path), info.path),
                                      info.path);
            return info.path;
        } catch (const std::runtime_error&) {
            // Another device, or one whose descriptor cannot be read: the next may be ours.
        }
    }
    throw std::runtime_error("hid: no stick with force feedback is attached; plug it in, `palpate "
                             "devices --why` says what is there");
}

PidEffect PidDevice::Stick::load_effect(HidPort& port, PidAxis axis) const {
    // Asking and its answer belong together: nothing else asks meanwhile.
    std::vector<std::uint8_t> answer = reports_->block_load_request();
    if (!port.send_feature(reports_->create_constant_force()) || !port.get_feature(answer))
        throw std::runtime_error(port.path() + ": takes no effects; plug it in again");
    const internal::PidBlockLoad load = reports_->block_load(answer);
    if (load.status == internal::PidLoadStatus::full)
        throw std::runtime_error(port.path() + ": has no room for an effect; stop the program "
                                               "that fills it, or plug it in again");
    if (load.status == internal::PidLoadStatus::failed)
        throw std::runtime_error(port.path() + ": refuses constant forces; update its firmware");
    PidEffect effect;
    effect.number = load.effect;
    effect.force = reports_->constant_force(load.effect, 0.0);
    effect.start = reports_->operation(load.effect, internal::PidOperation::start);
    if (!port.write(reports_->set_effect(load.effect, axis)) || !port.write(effect.force) ||
        !port.write(effect.start))
        throw std::runtime_error(port.path() + ": does not take its effects; plug it in again");
    effect.started_s = internal::hid_time_s();
    return effect;
}

void PidDevice::Stick::connected(HidPort& port) {
    path_ = port.path();
    reports_.emplace(internal::read_hid_descriptor(port.report_descriptor(), path_), path_);
    step_m_ = settings_.reach_m * reports_->stick_step();
    effects_ = {};
    is_released_ = false;
    ++reported_.trial; // the handle may be elsewhere by now: where, its next report says
    moved_s_ = kNever;
    heard_s_.store(kNever);
    for (const auto& report :
         {reports_->control(PidControl::reset), reports_->control(PidControl::stop_all),
          reports_->control(PidControl::enable_actuators), reports_->full_gain()})
        if (!report.empty() && !port.write(report))
            throw std::runtime_error(path_ + ": does not take its controls; plug it in again");
    try {
        for (std::size_t i = 0; i < effects_.size(); ++i)
            effects_[i] = load_effect(port, i == 0 ? PidAxis::x : PidAxis::y);
    } catch (const std::exception&) {
        release(port); // of the first effect, when the second is refused
        throw;
    }
}

void PidDevice::Stick::release(HidPort& port) noexcept {
    is_released_ = true;
    for (PidEffect& effect : effects_) {
        if (effect.number == 0) continue;
        reports_->set_magnitude(effect.force, 0.0);
        port.write(effect.force);
        port.write(reports_->operation(effect.number, internal::PidOperation::stop));
        if (const auto free = reports_->free_block(effect.number); !free.empty()) port.write(free);
        effect.number = 0;
    }
    if (const auto off = reports_->control(PidControl::disable_actuators); !off.empty())
        port.write(off);
}

void PidDevice::Stick::received(std::span<const std::uint8_t> report, double time_s) noexcept {
    if (const auto buttons = reports_->buttons(report)) reported_.buttons = *buttons;
    const auto stick = reports_->stick(report);
    if (!stick) return;
    reported_.position = settings_.reach_m * Vec3(stick->y, stick->x, 0.0);
    reported_.time_s = time_s - began_s_;
    moved_s_ = time_s;
}

void PidDevice::Stick::caught_up() noexcept {
    states_.give(reported_);
    heard_s_.store(moved_s_);
}

/// Zero where there is nothing recent to go by.
double PidDevice::Stick::magnitude(PidAxis axis, double now_s) const noexcept {
    if (now_s - force_.time_s > settings_.force_hold_s ||
        now_s - heard_s_.load() > settings_.stale_after_s)
        return 0.0;
    const double newtons = axis == PidAxis::x ? settings_.right_sign * force_.newtons.y
                                              : settings_.towards_sign * force_.newtons.x;
    return newtons / settings_.force_n;
}

std::size_t PidDevice::Stick::compose(std::span<std::uint8_t> report) noexcept {
    forces_.take(force_);
    const double now_s = internal::hid_time_s();
    PidEffect& effect = effects_[next_];
    const PidAxis axis = next_ == 0 ? PidAxis::x : PidAxis::y;
    next_ = 1 - next_;
    if (effect.number == 0) return 0; // released: it is not there any more
    const bool restart = now_s - effect.started_s > kRestartS;
    if (restart) effect.started_s = now_s;
    if (!restart) reports_->set_magnitude(effect.force, magnitude(axis, now_s));
    const std::vector<std::uint8_t>& bytes = restart ? effect.start : effect.force;
    if (bytes.size() > report.size()) return 0; // PidReports has refused such a device
    std::copy(bytes.begin(), bytes.end(), report.begin());
    return bytes.size();
}

DeviceState PidDevice::Stick::newest_state() noexcept {
    states_.take(state_);
    const double now_s = internal::hid_time_s();
    const bool recent = stream_.is_connected() &&
                        now_s - heard_s_.load() <= settings_.stale_after_s &&
                        now_s - stream_.untaken_since_s() <= settings_.stale_after_s;
    state_.freshness = recent ? Freshness::fresh : Freshness::stale;
    return state_;
}

PidDevice::PidDevice(PidSettings settings) : stick_(std::make_unique<Stick>(std::move(settings))) {}

PidDevice::~PidDevice() = default;

DeviceProperties PidDevice::properties() const { return stick_->properties(); }
void PidDevice::open() { stick_->stream().open(); }
void PidDevice::start() {
    if (stick_->is_released()) { // by stop(): its effects are loaded anew
        stick_->stream().close();
        stick_->stream().open();
    }
    stick_->stream().start();
}
void PidDevice::stop() noexcept { stick_->stream().stop(); }
void PidDevice::close() noexcept { stick_->stream().close(); }

bool PidDevice::read(DeviceState& state) noexcept {
    state = stick_->newest_state();
    return true;
}

void PidDevice::write(const Vec3& force) noexcept { stick_->take_force(force); }

} // namespace palpate
