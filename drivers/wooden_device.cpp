// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/wooden_device.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <palpate/drivers/internal/hid_stream.h>
#include <palpate/drivers/internal/known_devices.h>
#include <palpate/drivers/internal/newest_value.h>
#include <palpate/drivers/internal/wooden_codec.h>

namespace palpate {

namespace {

using internal::HidPort;
using internal::HidRead;

/// Boards of 14 bytes say one report and wait for an answer, perhaps given long ago to somebody
/// else: one that is silent for so long is sent an answer.
constexpr std::chrono::milliseconds kFirstReportWait{20};
/// How often: 2 s, of which the board's own start takes one.
constexpr int kFirstReportTries = 100;
/// A handle moves by less than so many counts while its counters are being set.
constexpr double kZeroingCounts = 256.0;
/// The stiffness that its makers declare stable at 1 kHz takes k T / 2 of damping; so much the
/// mechanism must have.
constexpr double kMakersPeriodS = 0.001;

struct Pose {
    Mat3 jacobian{0.0};
    double time_s = -std::numeric_limits<double>::infinity();
};

struct Force {
    Vec3 newtons{0.0};
    double time_s = -std::numeric_limits<double>::infinity();
};

bool positive(double value) { return std::isfinite(value) && value > 0.0; }

std::chrono::milliseconds milliseconds(double seconds) {
    return std::chrono::milliseconds(std::max(1, static_cast<int>(std::lround(1000.0 * seconds))));
}

} // namespace

/// The protocol, and what its threads and the servo hand to each other.
class WoodenDevice::Board final : public internal::HidProtocol {
public:
    Board(const WoodenModel& model, Settings settings);

    internal::HidStream& stream() noexcept { return stream_; }
    const DeviceProperties& properties() const noexcept { return properties_; }
    void open();
    DeviceState newest_state() noexcept;
    void take_force(const Vec3& force) noexcept;
    Counts counts() const noexcept;

    std::string find() override;
    void forget_force() noexcept override {
        forces_.take(force_);
        force_ = {};
    }
    void connected(HidPort& port) override;
    void release(HidPort& port) noexcept override;
    void received(std::span<const std::uint8_t> bytes, double time_s) noexcept override;
    void caught_up() noexcept override;
    std::size_t compose(std::span<std::uint8_t> bytes) noexcept override;

private:
    /// Of the counters, when the board sets them.
    enum class Zeroing : std::uint8_t { none, wanted, sent };

    std::size_t first_report(HidPort& port, std::span<std::uint8_t> report) const;
    bool board_zeroes() const noexcept { return layout_ != internal::WoodenLayout::bytes_8; }
    void zero(const internal::WoodenReport& report) noexcept;

    const WoodenModel model_;
    const Settings settings_;
    const double began_s_ = internal::hid_time_s();

    // Set while connecting, when neither thread runs on.
    internal::WoodenLayout layout_ = internal::WoodenLayout::bytes_14;
    std::string path_;

    DeviceProperties properties_; ///< the setting thread's

    // The reader's.
    internal::WoodenCounters counters_;
    DeviceState reported_;
    bool zeroed_ = false; ///< the counters are those of the model
    std::atomic<Zeroing> zeroing_{Zeroing::none};
    std::atomic<std::uint32_t> rejected_{0};
    std::atomic<std::uint32_t> zeroings_{0};

    // The writer's.
    Pose pose_;
    Force force_;

    // The servo's.
    DeviceState state_;
    double state_time_s_ = -std::numeric_limits<double>::infinity();

    internal::NewestValue<DeviceState> states_; ///< reader to servo
    internal::NewestValue<Pose> poses_;         ///< reader to writer
    internal::NewestValue<Force> forces_;       ///< servo to writer

    internal::HidStream stream_; ///< last: its threads use all of the above
};

WoodenDevice::Board::Board(const WoodenModel& model, Settings settings)
    : model_(model), settings_(std::move(settings)),
      stream_(*this, {std::chrono::milliseconds(10), milliseconds(settings_.reconnect_s),
                      0.01 + settings_.stale_after_s}) {
    properties_.name = model_.name;
    properties_.force_n = wooden_home_force_n(model_);
    properties_.stiffness_n_per_m = model_.stiffness_n_per_m;
    properties_.damping_n_s_per_m = 0.5 * model_.stiffness_n_per_m * kMakersPeriodS;
    properties_.position_step_m = wooden_home_step_m(model_);
    properties_.delay_s = 2.0 * kMakersPeriodS; // a state and a force wait for a report each
    properties_.workspace_m = {Vec3(-model_.workspace_radius_m), Vec3(model_.workspace_radius_m)};
    // A run begins at home, which of every model is outside of the ball that its makers name.
    if (const auto home = wooden_pose(model_, wooden_angles(model_, model_.home_counts)))
        properties_.workspace_m.add(home->position);
}

void WoodenDevice::Board::open() {
    stream_.open();
    properties_.name =
        model_.name + " at " + path_ + ", reports of " + std::to_string(int(layout_)) + " bytes";
}

std::string WoodenDevice::Board::find() {
    const auto attached = internal::attached_hid_devices();
    if (settings_.path.empty()) {
        const auto first = std::find_if(attached.begin(), attached.end(), internal::is_wooden);
        if (first == attached.end())
            throw std::runtime_error("hid: no device of the WoodenHaptics family is attached; plug "
                                     "it in, `palpate devices --why` says what is there");
        return first->path;
    }
    // A number that was the device's may be a keyboard's after it was plugged in again.
    for (const auto& info : attached)
        if (info.path == settings_.path && !internal::is_wooden(info))
            throw std::runtime_error(settings_.path + ": " + info.model +
                                     " is not of the WoodenHaptics family; `palpate devices` lists "
                                     "what is attached");
    return settings_.path;
}

std::size_t WoodenDevice::Board::first_report(HidPort& port, std::span<std::uint8_t> report) const {
    std::array<std::uint8_t, internal::kWoodenBuffer> answer{};
    const std::size_t answer_size = internal::encode_wooden_currents(layout_, {}, answer);
    for (int i = 0; i < kFirstReportTries; ++i) {
        std::size_t size = 0;
        switch (port.read(report, size, kFirstReportWait)) {
        case HidRead::report:
            return size;
        case HidRead::gone:
            throw std::runtime_error(port.path() + ": unplugged while it was opened; plug it in");
        case HidRead::nothing:
            port.write({answer.data(), answer_size});
            break;
        }
    }
    throw std::runtime_error(port.path() + ": says nothing; check the power of its board and plug "
                                           "it in again");
}

void WoodenDevice::Board::connected(HidPort& port) {
    const auto declared = internal::wooden_layout(
        internal::read_hid_descriptor(port.report_descriptor(), port.path()));
    if (!declared)
        throw std::runtime_error(port.path() + ": its reports are not those of the WoodenHaptics "
                                               "family; `palpate devices --why` says what it is");
    layout_ = *declared;
    path_ = port.path();

    std::array<std::uint8_t, internal::kWoodenBuffer + 1> bytes{};
    const std::size_t size = first_report(port, bytes);
    const auto layout = internal::wooden_layout(size);
    if (!layout)
        throw std::runtime_error(port.path() + ": its first report has " + std::to_string(size) +
                                 " bytes, not 8, 14 or 64; its firmware is none that we know");
    layout_ = *layout;

    const auto report = internal::decode_wooden(layout_, {bytes.data(), size});
    const bool kept = model_.zeroing == WoodenZeroing::device && board_zeroes();
    // A board that only took no reports has counted on, and its handle is anywhere by now.
    const bool goes_on = zeroed_ && stream_.was_let_go();
    const bool ask = kept && settings_.start == WoodenStart::at_home && !goes_on;
    zeroing_.store(ask || report->asks_for_zero ? Zeroing::wanted : Zeroing::none);
    zeroed_ = !ask;
    if (goes_on)
        counters_.follow(report->counters);
    else if (kept)
        counters_.set_kept(model_, report->counters);
    else
        counters_.set_home(model_, report->counters);
    ++reported_.trial;
    received({bytes.data(), size}, internal::hid_time_s());
    caught_up();
}

void WoodenDevice::Board::release(HidPort& port) noexcept {
    std::array<std::uint8_t, internal::kWoodenBuffer> report{};
    const std::size_t size = internal::encode_wooden_currents(layout_, {}, report);
    port.write({report.data(), size});
}

void WoodenDevice::Board::zero(const internal::WoodenReport& report) noexcept {
    for (std::size_t i = 0; i < 6; ++i)
        if (std::abs(report.counters[i] - model_.home_counts[i]) > kZeroingCounts) return;
    counters_.set_kept(model_, report.counters);
    zeroed_ = true;
    ++reported_.trial;
    ++zeroings_;
    zeroing_.store(Zeroing::none);
}

void WoodenDevice::Board::received(std::span<const std::uint8_t> bytes, double time_s) noexcept {
    const auto report = internal::decode_wooden(layout_, bytes);
    if (!report) {
        ++rejected_;
        return;
    }
    counters_.follow(report->counters);
    if (report->asks_for_zero) {
        auto none = Zeroing::none;
        zeroing_.compare_exchange_strong(none, Zeroing::wanted);
    } else if (zeroing_.load() == Zeroing::sent) {
        zero(*report);
    }
    reported_.time_s = time_s - began_s_;
    reported_.buttons = report->button ? 1 : 0;
}

void WoodenDevice::Board::caught_up() noexcept {
    if (!zeroed_ || zeroing_.load() != Zeroing::none) return;
    const auto pose = wooden_pose(model_, wooden_angles(model_, counters_.counts()));
    if (!pose) {
        ++rejected_;
        return;
    }
    reported_.position = pose->position;
    reported_.orientation = pose->orientation;
    poses_.give({pose->jacobian, began_s_ + reported_.time_s});
    states_.give(reported_);
}

std::size_t WoodenDevice::Board::compose(std::span<std::uint8_t> bytes) noexcept {
    const auto report = bytes.first<internal::kWoodenBuffer>();
    if (zeroing_.load() != Zeroing::none) {
        std::array<std::int16_t, 6> home{};
        for (std::size_t i = 0; i < 6; ++i)
            home[i] = static_cast<std::int16_t>(model_.home_counts[i]);
        const std::size_t size = internal::encode_wooden_counters(layout_, home, report);
        // Not where the answer to the one before has just come.
        auto wanted = Zeroing::wanted;
        zeroing_.compare_exchange_strong(wanted, Zeroing::sent);
        return size;
    }
    poses_.take(pose_);
    forces_.take(force_);
    const double now_s = internal::hid_time_s();
    const bool recent = now_s - pose_.time_s <= settings_.stale_after_s &&
                        now_s - force_.time_s <= settings_.force_hold_s;
    const Vec3 currents =
        recent ? wooden_currents_ma(model_, pose_.jacobian, force_.newtons) : Vec3(0.0);
    return internal::encode_wooden_currents(layout_, limited_wooden_currents(currents), report);
}

DeviceState WoodenDevice::Board::newest_state() noexcept {
    if (states_.take(state_)) state_time_s_ = began_s_ + state_.time_s;
    const double now_s = internal::hid_time_s();
    const bool recent = now_s - state_time_s_ <= settings_.stale_after_s &&
                        now_s - stream_.untaken_since_s() <= settings_.stale_after_s;
    state_.freshness = recent ? Freshness::fresh : Freshness::stale;
    return state_;
}

void WoodenDevice::Board::take_force(const Vec3& force) noexcept {
    forces_.give({is_finite(force) ? force : Vec3(0.0), internal::hid_time_s()});
}

WoodenDevice::Counts WoodenDevice::Board::counts() const noexcept {
    const internal::HidStreamCounts& stream = stream_.counts();
    return {stream.connections,   stream.losses, stream.overruns,
            stream.failed_writes, rejected_,     zeroings_};
}

WoodenDevice::WoodenDevice(const WoodenModel& model, Settings settings) {
    check(model);
    if (!positive(settings.stale_after_s) || !positive(settings.force_hold_s) ||
        !positive(settings.reconnect_s) || settings.reconnect_s > 3600.0)
        throw std::invalid_argument("device model " + model.name +
                                    ": stale_after_s, force_hold_s and reconnect_s must be > 0 s, "
                                    "the last at most 3600");
    board_ = std::make_unique<Board>(model, std::move(settings));
}

WoodenDevice::~WoodenDevice() = default;

DeviceProperties WoodenDevice::properties() const { return board_->properties(); }
void WoodenDevice::open() { board_->open(); }
void WoodenDevice::start() { board_->stream().start(); }
void WoodenDevice::stop() noexcept { board_->stream().stop(); }
void WoodenDevice::close() noexcept { board_->stream().close(); }

bool WoodenDevice::read(DeviceState& state) noexcept {
    state = board_->newest_state();
    return true;
}

void WoodenDevice::write(const Vec3& force) noexcept { board_->take_force(force); }
WoodenDevice::Counts WoodenDevice::counts() const noexcept { return board_->counts(); }

} // namespace palpate
