// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <palpate/drivers/internal/system_devices.h>

namespace palpate::internal {
namespace {

namespace fs = std::filesystem;

/// The entries of a folder in order; none where it cannot be listed.
std::vector<fs::path> entries(const fs::path& folder) {
    std::vector<fs::path> found;
    std::error_code failed;
    for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed))
        found.push_back(at->path());
    std::sort(found.begin(), found.end());
    return found;
}

/// The first line of a file; empty where there is none.
std::string line_of(const fs::path& file) {
    std::string line;
    std::ifstream in(file);
    std::getline(in, line);
    return line;
}

std::optional<std::uint16_t> id_of(const fs::path& file) {
    const std::string text = line_of(file);
    std::uint16_t id = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id, 16);
    if (error != std::errc() || end == text.data()) return std::nullopt;
    return id;
}

NodeAccess access_to(const std::string& path) {
    if (::access(path.c_str(), R_OK | W_OK) == 0) return NodeAccess::granted;
    return errno == ENOENT ? NodeAccess::missing : NodeAccess::denied;
}

/// "root:plugdev, mode 0660".
std::string owner_of(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return {};
    // Their names by the functions that any thread may call; who has a longer entry stays a number.
    std::array<char, 4096> user_text, group_text;
    passwd user_entry{};
    group group_entry{};
    passwd* user = nullptr;
    group* of = nullptr;
    ::getpwuid_r(status.st_uid, &user_entry, user_text.data(), user_text.size(), &user);
    ::getgrgid_r(status.st_gid, &group_entry, group_text.data(), group_text.size(), &of);
    std::string mode = "0000";
    for (int digit = 0; digit < 3; ++digit)
        mode[3 - digit] = static_cast<char>('0' + (status.st_mode >> 3 * digit & 7));
    return (user ? user->pw_name : std::to_string(status.st_uid)) + ":" +
           (of ? of->gr_name : std::to_string(status.st_gid)) + ", mode " + mode;
}

/// A node's force feedback, of the input devices that the kernel has made of it: a bit set, or
/// none at all.
bool kernel_makes_forces(const fs::path& hid_device) {
    for (const fs::path& input : entries(hid_device / "input")) {
        const std::string forces = line_of(input / "capabilities" / "ff");
        if (forces.find_first_not_of("0 ") != std::string::npos) return true;
    }
    return false;
}

} // namespace

std::vector<std::string> holders_of(const std::string& path, const SystemFolders& system) {
    std::vector<std::string> holders;
    for (const fs::path& process : entries(system.proc)) {
        const std::string number = process.filename().string();
        if (number.find_first_not_of("0123456789") != std::string::npos) continue;
        const std::vector<fs::path> open = entries(process / "fd");
        const bool holds = std::any_of(open.begin(), open.end(), [&](const fs::path& file) {
            std::error_code failed;
            return fs::read_symlink(file, failed) == path && !failed;
        });
        if (holds) holders.push_back(line_of(process / "comm") + " (process " + number + ")");
    }
    return holders;
}

std::vector<HidEvidence> hid_evidence(const std::vector<HidDeviceInfo>& listed,
                                      const SystemFolders& system) {
    std::map<std::string, HidEvidence> nodes; // hidapi lists a node once for each collection
    for (const HidDeviceInfo& info : listed)
        nodes[info.path].collections.push_back(info);
    std::error_code ignored;
    const bool rules = fs::exists(system.rules / "70-palpate.rules", ignored);
    std::vector<HidEvidence> evidence;
    for (auto& [path, node] : nodes) {
        const fs::path device =
            system.sys / "class" / "hidraw" / fs::path(path).filename() / "device";
        std::ifstream descriptor(device / "report_descriptor", std::ios::binary);
        node.descriptor.assign(std::istreambuf_iterator<char>(descriptor), {});
        node.access = access_to(path);
        node.owner = owner_of(path);
        node.rules_installed = rules;
        node.kernel_makes_forces = kernel_makes_forces(device);
        node.holders = holders_of(path, system);
        evidence.push_back(std::move(node));
    }
    return evidence;
}

SystemFolders system_folders(const fs::path& root) {
    return {root / "sys", root / "proc", root / "etc/udev/rules.d", root / "dev"};
}

std::optional<AttachedDevice> unseen_usb(const SystemFolders& system) {
    const fs::path list = system.sys / "bus/usb/devices";
    std::error_code failed;
    const fs::directory_iterator readable(list, failed);
    if (!failed) return std::nullopt;
    AttachedDevice unseen;
    unseen.path = list.string();
    unseen.kind = AttachedKind::unseen;
    unseen.name = "the list of what is on the USB";
    const bool has_bus_list = fs::is_directory(system.sys / "bus", failed) && !failed;
    unseen.findings.push_back(
        fs::exists(system.sys / "bus/usb", failed) || !has_bus_list
            ? DeviceFinding{DeviceFinding::Weight::obstacle,
                            unseen.path + " cannot be read, so nobody knows what is on the USB",
                            "let this user read it; in a container, mount /sys"}
            : DeviceFinding{DeviceFinding::Weight::obstacle,
                            "this system has no USB (" + unseen.path + " is not there)",
                            "in a virtual machine or a container, pass the device's USB on to it"});
    return unseen;
}

namespace {

/// What a library opens of a device: the serial port that the kernel has made of it, else the
/// device itself.
void find_node(const fs::path& device, const SystemFolders& system, UsbEvidence& evidence) {
    const std::string interface_begin = device.filename().string() + ":";
    std::string port;
    for (const fs::path& one : entries(device.parent_path())) {
        if (!one.filename().string().starts_with(interface_begin)) continue;
        evidence.is_hid = evidence.is_hid || line_of(one / "bInterfaceClass") == "03";
        for (const fs::path& tty : entries(one / "tty"))
            port = tty.filename().string();
    }
    evidence.is_port = !port.empty();
    std::string bus = line_of(device / "busnum"), number = line_of(device / "devnum");
    for (std::string* digits : {&bus, &number})
        digits->insert(0, digits->size() < 3 ? 3 - digits->size() : 0, '0');
    evidence.node =
        (evidence.is_port ? system.dev / port : system.dev / "bus/usb" / bus / number).string();
    evidence.access = access_to(evidence.node);
    evidence.owner = owner_of(evidence.node);
}

} // namespace

std::vector<UsbEvidence> usb_evidence(const SystemFolders& system) {
    std::vector<UsbEvidence> found;
    for (const fs::path& device : entries(system.sys / "bus" / "usb" / "devices")) {
        const auto vendor = id_of(device / "idVendor");
        const auto product = id_of(device / "idProduct");
        if (!vendor || !product) continue; // an interface
        std::string name = line_of(device / "manufacturer");
        const std::string model = line_of(device / "product");
        if (!name.empty() && !model.empty()) name += ' ';
        UsbEvidence evidence;
        evidence.place = "usb " + device.filename().string();
        evidence.vendor = *vendor;
        evidence.product = *product;
        evidence.name = name + model;
        find_node(device, system, evidence);
        found.push_back(std::move(evidence));
    }
    return found;
}

} // namespace palpate::internal
