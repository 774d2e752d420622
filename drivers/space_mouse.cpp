// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <palpate/drivers/internal/hid_descriptor.h>
#include <palpate/drivers/internal/hid_stream.h>
#include <palpate/drivers/internal/known_devices.h>
#include <palpate/drivers/internal/newest_value.h>
#include <palpate/drivers/internal/rate_control.h>
#include <palpate/drivers/internal/space_mouse_reports.h>
#include <palpate/drivers/space_mouse.h>

namespace palpate {
namespace {

constexpr std::array<std::uint8_t, 2> kLampOn{0x04, 0x01}, kLampOff{0x04, 0x00};

constexpr internal::HidUsage kMultiAxis = internal::hid_usage(0x01, 0x08);

/// What the reader hands to the servo.
struct Heard {
    internal::SpaceMouseReading reading;
    double motion_s = -std::numeric_limits<double>::infinity(); ///< time of the last deflection
};

} // namespace

/// The protocol, and what its thread and the servo hand to each other.
class SpaceMouseDevice::Mouse final : public internal::HidProtocol {
public:
    explicit Mouse(SpaceMouseSettings settings)
        : settings_(std::move(settings)), probe_(settings_),
          stream_(*this, {std::chrono::milliseconds(100), // there is nothing to write
                          std::chrono::milliseconds(std::lround(1e3 * settings_.reconnect_s))}) {}

    internal::HidStream& stream() noexcept { return stream_; }
    DeviceProperties properties() const {
        DeviceProperties known;
        known.name = path_.empty() ? "space mouse" : "space mouse at " + path_;
        known.workspace_m = settings_.workspace_m;
        return known;
    }
    DeviceState newest_state() noexcept;

    std::string find() override;
    void connected(internal::HidPort& port) override;
    void release(internal::HidPort& port) noexcept override { port.write(kLampOff); }
    void received(std::span<const std::uint8_t> report, double time_s) noexcept override;
    void caught_up() noexcept override { given_.give(heard_); }
    std::size_t compose(std::span<std::uint8_t>) noexcept override { return 0; }

private:
    bool says_enough(double now_s) const noexcept;

    const SpaceMouseSettings settings_;
    const double began_s_ = internal::hid_time_s();
    std::string path_; ///< set while opening

    Heard heard_; ///< the reader's
    internal::NewestValue<Heard> given_;

    // The servo's.
    Heard newest_;
    internal::RateControlledProbe probe_;
    double last_read_s_ = std::numeric_limits<double>::infinity();

    internal::HidStream stream_; ///< last: its threads use all of the above
};

std::string SpaceMouseDevice::Mouse::find() {
    if (!settings_.path.empty()) return settings_.path;
    for (const internal::HidDeviceInfo& info : internal::attached_hid_devices())
        if (internal::is_space_mouse(info)) return info.path;
    throw std::runtime_error("hid: no space mouse is attached; plug it in, `palpate devices --why` "
                             "says what is there");
}

void SpaceMouseDevice::Mouse::connected(internal::HidPort& port) {
    const auto descriptor = internal::read_hid_descriptor(port.report_descriptor(), port.path());
    const bool has_cap =
        std::any_of(descriptor.collections.begin(), descriptor.collections.end(),
                    [](const internal::HidCollection& one) { return one.usage == kMultiAxis; });
    if (!has_cap)
        throw std::runtime_error(port.path() + ": is no space mouse; `palpate devices` lists what "
                                               "is attached");
    path_ = port.path();
    port.write(kLampOn); // those without a lamp refuse it, which is no harm
    heard_ = {};
    caught_up();
}

void SpaceMouseDevice::Mouse::received(std::span<const std::uint8_t> report,
                                       double time_s) noexcept {
    if (internal::take_space_mouse_report(report, heard_.reading) ==
        internal::SpaceMouseNews::motion)
        heard_.motion_s = time_s;
}

/// Connected, and at rest or lately heard of.
bool SpaceMouseDevice::Mouse::says_enough(double now_s) const noexcept {
    if (!stream_.is_connected()) return false;
    return !probe_.moved_by(newest_.reading.deflection) ||
           now_s - newest_.motion_s <= settings_.silence_s;
}

DeviceState SpaceMouseDevice::Mouse::newest_state() noexcept {
    given_.take(newest_);
    const double now_s = internal::hid_time_s();
    const bool fresh = says_enough(now_s);
    probe_.advance(fresh ? newest_.reading.deflection : internal::SpaceMouseDeflection{},
                   now_s - last_read_s_);
    last_read_s_ = now_s;

    DeviceState state;
    state.time_s = now_s - began_s_;
    state.position = probe_.position();
    state.velocity = probe_.velocity();
    state.orientation = probe_.orientation();
    state.buttons = newest_.reading.buttons;
    state.freshness = fresh ? Freshness::fresh : Freshness::stale;
    return state;
}

SpaceMouseDevice::SpaceMouseDevice(SpaceMouseSettings settings)
    : mouse_(std::make_unique<Mouse>(std::move(settings))) {}

SpaceMouseDevice::~SpaceMouseDevice() = default;

DeviceProperties SpaceMouseDevice::properties() const { return mouse_->properties(); }
void SpaceMouseDevice::open() { mouse_->stream().open(); }
void SpaceMouseDevice::start() { mouse_->stream().start(); }
void SpaceMouseDevice::stop() noexcept { mouse_->stream().stop(); }
void SpaceMouseDevice::close() noexcept { mouse_->stream().close(); }

bool SpaceMouseDevice::read(DeviceState& state) noexcept {
    state = mouse_->newest_state();
    return true;
}

} // namespace palpate
