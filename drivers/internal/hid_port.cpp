// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/hid_port.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <linux/hidraw.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <hidapi/hidapi.h>

namespace palpate::internal {

namespace {

using SteadyClock = std::chrono::steady_clock;

/// hidapi keeps one error text for all that open, close and enumerate, without a lock of its own.
std::mutex& hidapi_mutex() {
    static std::mutex mutex;
    return mutex;
}

std::string utf8(const wchar_t* text) {
    std::string result;
    for (; text != nullptr && *text != L'\0'; ++text) {
        const auto code = static_cast<char32_t>(*text);
        const auto tail = [&](int shift) {
            result += static_cast<char>(0x80 | ((code >> shift) & 0x3F));
        };
        if (code < 0x80) {
            result += static_cast<char>(code);
        } else if (code < 0x800) {
            result += static_cast<char>(0xC0 | (code >> 6));
            tail(0);
        } else if (code < 0x10000) {
            result += static_cast<char>(0xE0 | (code >> 12));
            tail(6);
            tail(0);
        } else {
            result += static_cast<char>(0xF0 | ((code >> 18) & 0x07));
            tail(12);
            tail(6);
            tail(0);
        }
    }
    return result;
}

/// A file descriptor that closes itself.
struct OpenFile {
    int number = -1;
    explicit OpenFile(int opened) noexcept : number(opened) {}
    ~OpenFile() {
        if (number >= 0) ::close(number);
    }
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
};

/// A file that keeps others from a device as long as it is open.
struct LockFile {
    std::string name;
    int opened = -1;
};

/// A lock's file that is there and does not open, for the reason `why` (errno). In another folder
/// there would be a second lock.
std::string why_not_locked(const std::string& path, const std::string& file, int why) {
    const bool is_refused = why == EACCES || why == EPERM || why == ELOOP;
    return path + ": its lock, " + file + ", cannot be opened (" +
           std::generic_category().message(why) + ")" +
           (is_refused ? "; remove it, or let this user read it" : "");
}

/// The lock's file is only ever locked, never written: another user's will do. Kernels refuse to
/// create over another user's file in such folders, so creating comes second.
LockFile open_lock_file(const std::string& path) {
    std::string name = "palpate" + path + ".lock";
    std::replace(name.begin(), name.end(), '/', '-');
    for (const char* folder : {"/run/lock/", "/tmp/"}) {
        const std::string file = folder + name;
        for (const int create : {0, O_CREAT | O_EXCL, 0}) {
            constexpr mode_t kOfAll = S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH;
            const int opened =
                ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | create, kOfAll);
            if (opened < 0) continue; // errno stays
            // Whoever comes next has to be able to open it, whatever this user's umask is.
            if (create != 0) static_cast<void>(::fchmod(opened, kOfAll));
            return {file, opened};
        }
        const int why = errno;
        struct stat there {};
        if (::lstat(file.c_str(), &there) != 0) continue;
        throw std::runtime_error(why_not_locked(path, file, why));
    }
    throw std::runtime_error(path + ": no lock file can be made for it; let this user write to "
                                    "/run/lock or /tmp");
}

/// The node itself, where udev or somebody else has made a link to it: one device has one lock.
std::string node_of(const std::string& path) {
    std::error_code failed;
    const std::filesystem::path node = std::filesystem::canonical(path, failed);
    return failed ? path : node.string();
}

/// Whether the file of that name is still the one that was opened: its last holder removed it.
bool is_current(const LockFile& file) {
    struct stat of_opened {
    }, of_name{};
    return ::fstat(file.opened, &of_opened) == 0 && ::stat(file.name.c_str(), &of_name) == 0 &&
           of_opened.st_ino == of_name.st_ino && of_opened.st_dev == of_name.st_dev;
}

/// Why `path` did not open, and what helps; `said` is hidapi's own reason.
std::string why_not_open(const std::string& path, const std::string& said) {
    if (::access(path.c_str(), F_OK) != 0)
        return path + ": there is no such device; plug it in, `palpate devices` lists what is "
                      "attached";
    if (::access(path.c_str(), R_OK | W_OK) != 0)
        return path + ": no permission to read and write it; install the udev rules "
                      "(70-palpate.rules) and plug the device in again, `palpate devices --why` "
                      "says how";
    return path + ": " + said + "; `palpate devices --why` says what it is";
}

} // namespace

struct HidPort::Lock {
    LockFile file;

    explicit Lock(const std::string& path) {
        for (;;) {
            file = open_lock_file(node_of(path));
            if (::flock(file.opened, LOCK_EX | LOCK_NB) != 0) {
                ::close(file.opened);
                throw std::runtime_error(path + ": another program of Palpate uses this device; "
                                                "stop it first");
            }
            if (is_current(file)) return;
            ::close(file.opened);
        }
    }
    ~Lock() {
        ::unlink(file.name.c_str());
        ::close(file.opened);
    }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
};

struct HidPort::Handle {
    hid_device* device = nullptr;

    explicit Handle(const std::string& path) {
        const std::lock_guard alone(hidapi_mutex());
        device = hid_open_path(path.c_str());
        if (device == nullptr)
            throw std::runtime_error(why_not_open(path, utf8(hid_error(nullptr))));
    }
    ~Handle() {
        const std::lock_guard alone(hidapi_mutex());
        hid_close(device);
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
};

std::vector<HidDeviceInfo> attached_hid_devices() {
    const std::lock_guard alone(hidapi_mutex());
    std::vector<HidDeviceInfo> devices;
    hid_device_info* const first = hid_enumerate(0, 0);
    for (const hid_device_info* d = first; d != nullptr; d = d->next)
        devices.push_back({d->path == nullptr ? "" : d->path, d->vendor_id, d->product_id,
                           d->usage_page, d->usage, d->interface_number,
                           utf8(d->manufacturer_string), utf8(d->product_string),
                           utf8(d->serial_number)});
    hid_free_enumeration(first);
    return devices;
}

std::vector<std::uint8_t> hid_report_descriptor(const std::string& path) {
    const std::string node = path.substr(path.rfind('/') + 1);
    std::ifstream sysfs("/sys/class/hidraw/" + node + "/device/report_descriptor",
                        std::ios::binary);
    if (sysfs) return {std::istreambuf_iterator<char>(sysfs), {}};

    const OpenFile file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
    int size = 0;
    if (file.number < 0 || ::ioctl(file.number, HIDIOCGRDESCSIZE, &size) < 0) return {};
    hidraw_report_descriptor descriptor{};
    descriptor.size = static_cast<__u32>(std::clamp(size, 0, HID_MAX_DESCRIPTOR_SIZE));
    if (::ioctl(file.number, HIDIOCGRDESC, &descriptor) < 0) return {};
    return {descriptor.value, descriptor.value + descriptor.size};
}

HidPort::HidPort(const std::string& path)
    : path_(path), lock_(std::make_unique<Lock>(path)), reading_(std::make_unique<Handle>(path)),
      writing_(std::make_unique<Handle>(path)) {}

HidPort::~HidPort() = default;

HidRead HidPort::read(std::span<std::uint8_t> buffer, std::size_t& size,
                      std::chrono::milliseconds wait) noexcept {
    const auto until = SteadyClock::now() + wait;
    for (;;) {
        errno = 0;
        const int length = hid_read_timeout(reading_->device, buffer.data(), buffer.size(),
                                            static_cast<int>(wait.count()));
        if (length > 0) {
            size = static_cast<std::size_t>(length);
            return HidRead::report;
        }
        if (length == 0) return HidRead::nothing;
        // A signal during the wait is no loss of the device, though hidapi reports both alike.
        if (errno != EINTR) return HidRead::gone;
        wait = std::max(
            std::chrono::milliseconds(0),
            std::chrono::duration_cast<std::chrono::milliseconds>(until - SteadyClock::now()));
    }
}

bool HidPort::write(std::span<const std::uint8_t> report_with_id) noexcept {
    int written = -1;
    do {
        errno = 0;
        written = hid_write(writing_->device, report_with_id.data(), report_with_id.size());
    } while (written < 0 && errno == EINTR);
    return written == static_cast<int>(report_with_id.size());
}

bool HidPort::send_feature(std::span<const std::uint8_t> report_with_id) noexcept {
    return hid_send_feature_report(writing_->device, report_with_id.data(),
                                   report_with_id.size()) >= 0;
}

std::optional<std::size_t> HidPort::get_feature(std::span<std::uint8_t> buffer) noexcept {
    const int length = hid_get_feature_report(writing_->device, buffer.data(), buffer.size());
    if (length < 0) return std::nullopt;
    return static_cast<std::size_t>(length);
}

} // namespace palpate::internal
