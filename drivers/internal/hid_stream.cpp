// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/hid_stream.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <memory>

namespace palpate::internal {

namespace {

/// Longest wait for a report: how late a stop may be noticed.
constexpr std::chrono::milliseconds kReadWait{10};
/// The kernel's queue holds 63: a batch this long may have lost the newest reports.
constexpr int kOverrunBatch = 60;
/// So many reports refused in a row: the device does not listen any more.
constexpr int kRefusals = 5;
/// A device that sends faster than it is read must not keep the reader from looking up.
constexpr int kLongestBatch = 4096;

constexpr double kAllTaken = std::numeric_limits<double>::infinity();
constexpr double kNever = -std::numeric_limits<double>::infinity();

} // namespace

double hid_time_s() noexcept {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

HidStream::HidStream(HidProtocol& protocol, Settings settings)
    : protocol_(protocol), settings_(settings), untaken_since_s_(kAllTaken), seen_empty_s_(kNever) {
}

HidStream::~HidStream() { close(); }

void HidStream::open() {
    if (port_ == nullptr) connect();
}

void HidStream::connect() {
    std::unique_ptr<HidPort> port;
    try {
        port = std::make_unique<HidPort>(protocol_.find());
    } catch (const std::exception&) {
        was_let_go_ = false; // what comes back may have been without power
        throw;
    }
    protocol_.forget_force();
    try {
        protocol_.connected(*port);
    } catch (const std::exception&) {
        if (was_let_go_) let_go_ = std::move(port);
        throw;
    }
    port_ = std::move(port);
    was_let_go_ = false;
    seen_empty_s_ = hid_time_s();
    ++counts_.connections;
    is_connected_.store(true);
}

void HidStream::start() {
    if (reader_.joinable()) return;
    stopping_ = false;
    untaken_since_s_.store(kAllTaken);
    refuses_reports_.store(false);
    seen_empty_s_ = kNever; // what came before is as old as that
    protocol_.forget_force();
    reader_ = std::thread([this] { read_reports(); });
    writer_ = std::thread([this] { write_reports(); });
}

void HidStream::stop() noexcept {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    if (writer_.joinable()) writer_.join();
    if (reader_.joinable()) reader_.join();
    if (port_ != nullptr) protocol_.release(*port_);
}

void HidStream::close() noexcept {
    stop();
    is_connected_.store(false);
    was_let_go_ = false;
    let_go_.reset();
    port_.reset();
}

bool HidStream::sleep_until_stopped(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, time, [this] { return stopping_; });
}

void HidStream::read_reports() noexcept {
    while (!sleep_until_stopped(std::chrono::milliseconds(0))) {
        if (port_ == nullptr)
            try_again();
        else if (refuses_reports_.exchange(false)) {
            let_go_ = lose();
            was_let_go_ = true;
        } else
            read_batch();
    }
}

void HidStream::read_batch() noexcept {
    std::array<std::uint8_t, kLongestHidReport> buffer{};
    std::size_t size = 0;
    int batch = 0;
    HidRead read = port_->read(buffer, size, kReadWait);
    while (read == HidRead::report && batch < kLongestBatch) {
        ++batch;
        protocol_.received({buffer.data(), size}, hid_time_s());
        read = port_->read(buffer, size, std::chrono::milliseconds(0));
    }
    if (read == HidRead::gone) {
        lose();
        return;
    }
    const double now_s = hid_time_s();
    const bool too_old = batch >= kOverrunBatch || now_s - seen_empty_s_ > settings_.trusted_s;
    seen_empty_s_ = now_s;
    if (batch == 0) return;
    if (too_old)
        ++counts_.overruns;
    else
        protocol_.caught_up();
    let_write();
}

void HidStream::let_write() noexcept {
    {
        const std::lock_guard lock(mutex_);
        report_came_ = true;
    }
    wake_.notify_all();
}

std::unique_ptr<HidPort> HidStream::lose() noexcept {
    // The writer's report fails at once where the device is gone; hidapi's handle must not be
    // closed before that.
    const std::lock_guard alone(port_mutex_);
    protocol_.release(*port_);
    std::unique_ptr<HidPort> lost = std::move(port_);
    refuses_reports_.store(false);
    is_connected_.store(false);
    ++counts_.losses;
    return lost;
}

void HidStream::try_again() noexcept {
    // Never without a pause: this thread may come before every ordinary one.
    if (sleep_until_stopped(std::max(settings_.retry, std::chrono::milliseconds(1)))) return;
    const std::lock_guard alone(port_mutex_);
    if (let_go_ != nullptr) {
        std::array<std::uint8_t, kLongestHidReport> buffer{};
        std::size_t size = 0;
        HidRead read = HidRead::report;
        for (int i = 0; i < kLongestBatch && read == HidRead::report; ++i)
            read = let_go_->read(buffer, size, std::chrono::milliseconds(0));
        if (read == HidRead::gone) was_let_go_ = false; // it may have been without power
        let_go_.reset();                                // and its lock
    }
    try {
        connect();
    } catch (const std::exception&) {
        // Not there yet: whoever asks sees states that are stale.
    }
}

void HidStream::write_reports() noexcept {
    std::array<std::uint8_t, kLongestHidReport> buffer{};
    int refused = 0;
    for (;;) {
        {
            std::unique_lock lock(mutex_);
            wake_.wait_for(lock, settings_.write_period,
                           [this] { return stopping_ || report_came_; });
            if (stopping_) return;
            report_came_ = false;
        }
        const std::lock_guard alone(port_mutex_);
        if (port_ == nullptr) continue;
        const std::size_t size = protocol_.compose(buffer);
        if (size == 0) continue;
        if (refused == 0) untaken_since_s_.store(hid_time_s());
        if (port_->write({buffer.data(), size})) {
            refused = 0;
            untaken_since_s_.store(kAllTaken);
            continue;
        }
        ++refused;
        ++counts_.failed_writes;
        if (refused % kRefusals == 0) refuses_reports_.store(true);
    }
}

} // namespace palpate::internal
