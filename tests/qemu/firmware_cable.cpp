// SPDX-License-Identifier: Apache-2.0
#include <tests/qemu/firmware_cable.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <fcntl.h>
#include <linux/uhid.h>
#include <poll.h>
#include <unistd.h>

namespace palpate::test {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& what) {
    throw std::runtime_error(what + ": " + std::strerror(errno));
}

int opened(const char* path) {
    const int file = ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) refuse(path);
    return file;
}

bool readable(int file, std::chrono::milliseconds wait) {
    pollfd poll{file, POLLIN, 0};
    return ::poll(&poll, 1, static_cast<int>(wait.count())) > 0 && (poll.revents & POLLIN) != 0;
}

void put(const fs::path& file, const std::string& text) {
    std::ofstream out(file, std::ios::binary);
    out << text;
    out.close();
    if (!out) refuse(file.string());
}

std::string hex(std::uint16_t number) {
    std::array<char, 8> text{};
    std::snprintf(text.data(), text.size(), "0x%04x", static_cast<unsigned>(number));
    return text.data();
}

void send(int uhid, const uhid_event& event) {
    if (::write(uhid, &event, sizeof event) != static_cast<ssize_t>(sizeof event)) refuse("uhid");
}

} // namespace

double FirmwareCable::now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

void FirmwareCable::plug_in() {
    if (thread_.joinable()) return;
    connect();
    pulled_ = false;
    look([this] { firmware_.power_on(now_s()); });
    thread_ = std::thread([this] { run(); });
}

void FirmwareCable::pull_out() {
    if (!thread_.joinable()) return;
    pulled_ = true;
    thread_.join();
    disconnect();
}

void FirmwareCable::received(std::span<const std::uint8_t> report) {
    look([&] { firmware_.receive(report, now_s()); });
}

void FirmwareCable::run() {
    while (!pulled_) {
        hear();
        while (const auto report = look([this] { return firmware_.send(now_s()); }))
            say(*report);
    }
}

// ------------------------------------------------------------------------------------------ uhid

void UhidCable::connect() {
    file_ = opened("/dev/uhid");
    uhid_event event{};
    event.type = UHID_CREATE2;
    uhid_create2_req& create = event.u.create2;
    std::snprintf(reinterpret_cast<char*>(create.name), sizeof create.name, "uhid firmware");
    const Bytes descriptor = firmware_.descriptor();
    create.rd_size = static_cast<__u16>(descriptor.size());
    std::copy(descriptor.begin(), descriptor.end(), create.rd_data);
    create.bus = 0x03; // USB
    create.vendor = vendor_;
    create.product = product_;
    send(file_, event);
}

void UhidCable::disconnect() {
    uhid_event event{};
    event.type = UHID_DESTROY;
    send(file_, event);
    ::close(file_);
}

void UhidCable::hear() {
    if (!readable(file_, kTurn)) return;
    uhid_event event{};
    if (::read(file_, &event, sizeof event) <= 0) return;
    uhid_event answer{};
    switch (event.type) {
    case UHID_OUTPUT: {
        // The kernel leaves the host's leading 0 of unnumbered reports in; a USB does not.
        const std::size_t skip = firmware_.numbered() ? 0 : 1;
        const uhid_output_req& output = event.u.output;
        if (output.rtype == UHID_OUTPUT_REPORT && output.size > skip)
            received({output.data + skip, output.size - skip});
        break;
    }
    case UHID_SET_REPORT: {
        const uhid_set_report_req& set = event.u.set_report;
        answer.type = UHID_SET_REPORT_REPLY;
        answer.u.set_report_reply.id = set.id;
        const bool taken = look([&] { return firmware_.set_feature({set.data, set.size}); });
        answer.u.set_report_reply.err = taken ? 0 : EIO;
        send(file_, answer);
        break;
    }
    case UHID_GET_REPORT: {
        const auto report = look([&] { return firmware_.get_feature(event.u.get_report.rnum); });
        answer.type = UHID_GET_REPORT_REPLY;
        uhid_get_report_reply_req& reply = answer.u.get_report_reply;
        reply.id = event.u.get_report.id;
        reply.err = report ? 0 : EIO;
        if (report) {
            reply.size = static_cast<__u16>(report->size());
            std::copy(report->begin(), report->end(), reply.data);
        }
        send(file_, answer);
        break;
    }
    default:
        break; // started, opened, closed
    }
}

void UhidCable::say(const Bytes& report) {
    uhid_event event{};
    event.type = UHID_INPUT2;
    event.u.input2.size = static_cast<__u16>(report.size());
    std::copy(report.begin(), report.end(), event.u.input2.data);
    send(file_, event);
}

// ---------------------------------------------------------------------------------------- gadget

namespace {

const fs::path kGadget = "/sys/kernel/config/usb_gadget/palpate";

void make_gadget(std::uint16_t vendor, std::uint16_t product, const Bytes& descriptor,
                 std::size_t report_size) {
    const fs::path strings = kGadget / "strings" / "0x409", config = kGadget / "configs" / "c.1",
                   function = kGadget / "functions" / "hid.usb0";
    for (const fs::path& folder : {kGadget, strings, config, function})
        fs::create_directory(folder);
    put(kGadget / "idVendor", hex(vendor));
    put(kGadget / "idProduct", hex(product));
    put(strings / "manufacturer", "Palpate tests");
    put(strings / "product", "USB gadget");
    put(function / "report_length", std::to_string(report_size));
    put(function / "report_desc", std::string(descriptor.begin(), descriptor.end()));
    fs::create_directory_symlink(function, config / "hid.usb0");
}

} // namespace

void GadgetCable::connect() {
    constexpr std::size_t kReport = 64; // a whole packet
    if (!fs::exists(kGadget)) make_gadget(vendor_, product_, firmware_.descriptor(), kReport);
    put(kGadget / "UDC", "dummy_udc.0");
    for (int i = 0; i < 1000 && !fs::exists("/dev/hidg0"); ++i)
        std::this_thread::sleep_for(kTurn);
    file_ = opened("/dev/hidg0");
}

void GadgetCable::disconnect() {
    ::close(file_);
    put(kGadget / "UDC", "\n");
}

void GadgetCable::hear() {
    if (!readable(file_, kTurn)) return;
    std::array<std::uint8_t, 64> report{};
    const ssize_t size = ::read(file_, report.data(), report.size());
    if (size > 0) received({report.data(), static_cast<std::size_t>(size)});
}

void GadgetCable::say(const Bytes& report) {
    // Until the host has fetched the one before there is no room for this one.
    while (::write(file_, report.data(), report.size()) < 0) {
        pollfd poll{file_, POLLOUT, 0};
        if (errno != EAGAIN || ::poll(&poll, 1, 100) <= 0) return;
    }
}

} // namespace palpate::test
