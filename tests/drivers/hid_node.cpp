// SPDX-License-Identifier: Apache-2.0
// The headers' inline checked versions of read and open would get in the way of ours.
#undef _FORTIFY_SOURCE
#include "tests/drivers/hid_node.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdarg>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string_view>

#include <fcntl.h>
#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace palpate::test {

namespace {

/// One handle on a node. The host's end of the socket is its file descriptor.
struct Handle {
    int device_end = -1;
    std::atomic<int> queued{0};
};

/// How often the firmware is asked for what it sends: a bus of 1 ms.
constexpr std::chrono::milliseconds kTick{1};

double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

} // namespace

std::string node_path(const std::string& name) {
    return "/dev/hidrawSIM-" + name + "-" + std::to_string(::getpid());
}

struct HidNode::Cable {
    explicit Cable(HidFirmware& f) : firmware(f) {}

    std::mutex firmware_mutex; ///< of the firmware
    HidFirmware& firmware;

    std::mutex mutex; ///< of what follows; may be taken while firmware_mutex is held, not before
    std::condition_variable changed;
    bool plugged_in = false;
    bool ended = false;
    WriteFault fault = WriteFault::none;
    std::map<int, std::shared_ptr<Handle>> handles; ///< by the host's file descriptor

    int open();
    void hang_up();
    void serve();
    bool is_connected(int fd) const;
    ssize_t write(int fd, const void* bytes, std::size_t size);
    int control(unsigned long request, void* argument);
};

namespace {

/// Which paths are nodes and which file descriptors are handles on them. Never destroyed, as files
/// are closed to the end of the process.
struct Table {
    std::mutex mutex;
    std::map<std::string, std::shared_ptr<HidNode::Cable>> nodes;
    std::map<int, std::shared_ptr<HidNode::Cable>> open;
};

std::atomic<int> nodes_ever{0};

Table& table() {
    static auto* const the_table = new Table;
    return *the_table;
}

std::shared_ptr<HidNode::Cable> cable_of(int fd) {
    if (nodes_ever.load() == 0) return nullptr;
    const std::lock_guard lock(table().mutex);
    const auto found = table().open.find(fd);
    return found == table().open.end() ? nullptr : found->second;
}

bool is_node(const char* path) {
    return path != nullptr && std::string_view(path).starts_with("/dev/hidrawSIM");
}

int open_node(const char* path) {
    std::shared_ptr<HidNode::Cable> cable;
    {
        const std::lock_guard lock(table().mutex);
        const auto found = table().nodes.find(path);
        if (found != table().nodes.end()) cable = found->second;
    }
    const int fd = cable == nullptr ? -1 : cable->open();
    if (fd < 0) {
        errno = ENOENT;
        return -1;
    }
    const std::lock_guard lock(table().mutex);
    table().open[fd] = cable;
    return fd;
}

} // namespace

int HidNode::Cable::open() {
    const std::lock_guard lock(mutex);
    if (!plugged_in) return -1;
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) return -1;
    auto handle = std::make_shared<Handle>();
    handle->device_end = ends[1];
    handles[ends[0]] = handle;
    return ends[0];
}

/// Of all handles; the caller holds the mutex.
void HidNode::Cable::hang_up() {
    for (const auto& [fd, handle] : handles) {
        if (handle->device_end >= 0) ::syscall(SYS_close, handle->device_end);
        handle->device_end = -1;
    }
    changed.notify_all();
}

/// As on USB, the host waits until the device has taken the report.
ssize_t HidNode::Cable::write(int fd, const void* bytes, std::size_t size) {
    {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return fault != WriteFault::blocks || !is_connected(fd); });
        if (!is_connected(fd)) {
            errno = ENODEV;
            return -1;
        }
        if (fault == WriteFault::fails) {
            errno = EIO;
            return -1;
        }
        if (fault == WriteFault::is_cut) return static_cast<ssize_t>(size / 2);
    }
    const std::lock_guard at_work(firmware_mutex);
    std::span<const std::uint8_t> report(static_cast<const std::uint8_t*>(bytes), size);
    if (!firmware.numbered() && report[0] == 0) report = report.subspan(1);
    firmware.receive(report, now_s());
    return static_cast<ssize_t>(size);
}

/// The caller holds the mutex.
bool HidNode::Cable::is_connected(int fd) const {
    const auto handle = handles.find(fd);
    return handle != handles.end() && handle->second->device_end >= 0;
}

int HidNode::Cable::control(unsigned long request, void* argument) {
    const std::lock_guard lock(firmware_mutex);
    auto* const bytes = static_cast<std::uint8_t*>(argument);
    const std::size_t size = _IOC_SIZE(request);
    if (request == HIDIOCGRDESCSIZE) {
        const int length = static_cast<int>(firmware.descriptor().size());
        std::memcpy(argument, &length, sizeof(length));
        return 0;
    }
    if (request == HIDIOCGRDESC) {
        const Bytes descriptor = firmware.descriptor();
        auto* const result = static_cast<hidraw_report_descriptor*>(argument);
        result->size = static_cast<__u32>(descriptor.size());
        std::copy(descriptor.begin(), descriptor.end(), result->value);
        return 0;
    }
    if (_IOC_TYPE(request) == 'H' && _IOC_NR(request) == 0x06) { // HIDIOCSFEATURE
        if (firmware.set_feature({bytes, size})) return static_cast<int>(size);
        errno = EIO;
        return -1;
    }
    if (_IOC_TYPE(request) == 'H' && _IOC_NR(request) == 0x07) { // HIDIOCGFEATURE
        const auto answer = firmware.get_feature(bytes[0]);
        if (answer) {
            const std::size_t length = std::min(answer->size(), size);
            std::copy_n(answer->begin(), length, bytes);
            return static_cast<int>(length);
        }
        errno = EIO;
        return -1;
    }
    errno = EINVAL;
    return -1;
}

/// The device's own life: sends what is due.
void HidNode::Cable::serve() {
    for (;;) {
        std::this_thread::sleep_for(kTick);
        const std::lock_guard at_work(firmware_mutex);
        const std::lock_guard lock(mutex);
        if (ended) return;
        if (!plugged_in) continue;
        while (const auto report = firmware.send(now_s())) {
            for (const auto& [fd, handle] : handles) {
                if (handle->device_end < 0 || handle->queued.load() >= kQueue) continue;
                ++handle->queued;
                ::send(handle->device_end, report->data(), report->size(),
                       MSG_DONTWAIT | MSG_NOSIGNAL);
            }
        }
    }
}

HidNode::HidNode(const std::string& path, HidFirmware& firmware)
    : cable_(std::make_shared<Cable>(firmware)) {
    if (!is_node(path.c_str())) throw std::invalid_argument(path + ": not /dev/hidrawSIM*");
    {
        const std::lock_guard lock(table().mutex);
        table().nodes[path] = cable_;
        ++nodes_ever;
    }
    plug_in();
    service_ = std::thread([cable = cable_] { cable->serve(); });
}

HidNode::~HidNode() {
    unplug();
    {
        const std::lock_guard lock(cable_->mutex);
        cable_->ended = true;
    }
    service_.join();
    const std::lock_guard lock(table().mutex);
    std::erase_if(table().nodes, [this](const auto& node) { return node.second == cable_; });
}

void HidNode::plug_in() {
    const std::lock_guard at_work(cable_->firmware_mutex);
    const std::lock_guard lock(cable_->mutex);
    cable_->firmware.power_on(now_s());
    cable_->plugged_in = true;
}

void HidNode::unplug() {
    const std::lock_guard lock(cable_->mutex);
    cable_->plugged_in = false;
    cable_->hang_up();
}

void HidNode::set_write_fault(WriteFault fault) {
    const std::lock_guard lock(cable_->mutex);
    cable_->fault = fault;
    cable_->changed.notify_all();
}

std::mutex& HidNode::firmware_mutex() { return cable_->firmware_mutex; }

} // namespace palpate::test

// What stands before the C library's functions; all but simulated nodes goes to the kernel.
extern "C" {

int open(const char* path, int flags, ...) {
    if (palpate::test::is_node(path)) return palpate::test::open_node(path);
    va_list rest;
    va_start(rest, flags);
    const int mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, int) : 0;
    va_end(rest);
    return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

ssize_t read(int fd, void* bytes, std::size_t size) {
    const ssize_t length = ::syscall(SYS_read, fd, bytes, size);
    if (const auto cable = palpate::test::cable_of(fd); cable != nullptr && length >= 0) {
        const std::lock_guard lock(cable->mutex);
        const auto handle = cable->handles.find(fd);
        if (handle != cable->handles.end()) --handle->second->queued;
    }
    return length;
}

ssize_t write(int fd, const void* bytes, std::size_t size) {
    if (const auto cable = palpate::test::cable_of(fd)) return cable->write(fd, bytes, size);
    return ::syscall(SYS_write, fd, bytes, size);
}

int close(int fd) {
    if (const auto cable = palpate::test::cable_of(fd)) {
        const std::lock_guard nodes(palpate::test::table().mutex);
        palpate::test::table().open.erase(fd);
        const std::lock_guard lock(cable->mutex);
        const auto handle = cable->handles.find(fd);
        if (handle != cable->handles.end()) {
            if (handle->second->device_end >= 0) ::syscall(SYS_close, handle->second->device_end);
            cable->handles.erase(handle);
        }
    }
    return static_cast<int>(::syscall(SYS_close, fd));
}

int ioctl(int fd, unsigned long request, ...) noexcept {
    va_list rest;
    va_start(rest, request);
    void* const argument = va_arg(rest, void*);
    va_end(rest);
    if (const auto cable = palpate::test::cable_of(fd)) return cable->control(request, argument);
    return static_cast<int>(::syscall(SYS_ioctl, fd, request, argument));
}

} // extern "C"
