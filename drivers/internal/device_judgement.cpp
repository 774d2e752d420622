// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <exception>
#include <span>
#include <utility>

#include <palpate/drivers/internal/device_judgement.h>
#include <palpate/drivers/internal/hid_descriptor.h>
#include <palpate/drivers/internal/known_devices.h>
#include <palpate/drivers/internal/pid_reports.h>
#include <palpate/drivers/internal/wooden_codec.h>

namespace palpate::internal {
namespace {

using Weight = DeviceFinding::Weight;

constexpr HidUsage kWoodenUsage = hid_usage(0xFFAB, 0x0200);
constexpr HidUsage kKeyboard = hid_usage(0x01, 0x06), kMouse = hid_usage(0x01, 0x02);
constexpr HidUsage kPidSetEffect = hid_usage(0x0F, 0x21);
constexpr std::size_t kShortMotion = 7, kLongMotion = 13; // bytes of a SpaceMouse's report 1

std::string bytes(std::size_t count) {
    return std::to_string(count) + (count == 1 ? " byte" : " bytes");
}

/// That no driver of ours speaks to it over USB, and what leads to it.
void judge_foreign(const ForeignProduct& product, const std::string& form, AttachedDevice& device) {
    device.kind = AttachedKind::foreign;
    device.called = product.called;
    device.way = {product.by, product.page, product.tested};
    device.findings.push_back({Weight::obstacle,
                               std::string("Palpate does not reach it by USB: ") + product.speaks +
                                   (form.empty() ? "" : "; it is attached " + form),
                               std::string(product.remedy) + " (" + product.page + ")"});
    device.findings.push_back({Weight::note, product.tested, ""});
}

/// Reads the evidence and writes the findings down.
class Judge {
public:
    explicit Judge(const HidEvidence& evidence) : evidence_(evidence) {
        const HidDeviceInfo& first = evidence.collections.front();
        device_.path = first.path;
        device_.vendor = first.vendor;
        device_.product = first.product;
    }

    AttachedDevice judge() {
        read_descriptor();
        const char* known_as = recognise();
        device_.name = name(known_as);
        if (device_.kind == AttachedKind::other) return std::move(device_);
        judge_access();
        judge_holders();
        std::stable_partition(
            device_.findings.begin(), device_.findings.end(),
            [](const DeviceFinding& finding) { return finding.weight == Weight::obstacle; });
        return std::move(device_);
    }

private:
    void obstacle(std::string what, std::string remedy) {
        device_.findings.push_back({Weight::obstacle, std::move(what), std::move(remedy)});
    }
    void note(std::string what, std::string remedy = {}) {
        device_.findings.push_back({Weight::note, std::move(what), std::move(remedy)});
    }

    /// "PATH: what; remedy", as errors say it.
    void obstacle_of(std::string error) {
        if (error.starts_with(device_.path + ": ")) error.erase(0, device_.path.size() + 2);
        const std::size_t remedy = error.rfind("; ");
        if (remedy == std::string::npos)
            obstacle(std::move(error), "");
        else
            obstacle(error.substr(0, remedy), error.substr(remedy + 2));
    }

    bool has_usage(HidUsage usage) const {
        return std::any_of(evidence_.collections.begin(), evidence_.collections.end(),
                           [&](const HidDeviceInfo& one) {
                               return hid_usage(one.usage_page, one.usage) == usage;
                           });
    }

    const KnownProduct* among(std::span<const KnownProduct> products) const {
        return find_product(products, device_.vendor, device_.product);
    }

    void read_descriptor() {
        if (evidence_.descriptor.empty()) return;
        try {
            descriptor_ = read_hid_descriptor(evidence_.descriptor, device_.path);
        } catch (const std::exception& error) {
            descriptor_error_ = error.what();
        }
    }

    /// Sets the kind; how the product is known, null where it is not.
    const char* recognise() {
        if (const char* foreign = foreign_device()) return foreign;
        if (const KnownProduct* wooden = among(wooden_products())) return wooden_board(*wooden);
        const KnownProduct* mouse = among(space_mouse_products());
        const KnownProduct* capless = among(capless_products());
        const auto& collections = evidence_.collections;
        if (std::any_of(collections.begin(), collections.end(), is_space_mouse))
            return space_mouse(mouse);
        if (makes_forces()) return force_feedback();
        if (mouse != nullptr)
            note("this interface of the SpaceMouse has no axes (its usage is not 01/08)",
                 "use the one that has");
        else if (capless != nullptr)
            note("it has no cap with six degrees of freedom");
        else if (has_usage(kKeyboard) || has_usage(kMouse))
            note("it is a keyboard or a mouse");
        else
            note("it has neither six axes nor constant forces that its report descriptor tells of");
        return mouse != nullptr ? mouse->name : capless != nullptr ? capless->name : nullptr;
    }

    const char* foreign_device() {
        const ForeignProduct* product = find_foreign(device_.vendor, device_.product,
                                                     evidence_.collections.front().manufacturer);
        if (product == nullptr) return nullptr;
        judge_foreign(*product, "as a HID device", device_);
        return product->id.name;
    }

    const char* wooden_board(const KnownProduct& product) {
        if (!has_usage(kWoodenUsage)) {
            note("its USB ids are those of a WoodenHaptics board, its usage is not (FFAB/0200): "
                 "another board with borrowed ids, or the second interface of a Teensy");
            return nullptr;
        }
        device_.kind = AttachedKind::wooden_haptics;
        if (!judge_descriptor("the layout is found by its first report")) return product.name;
        const std::size_t in = descriptor_->longest_report(HidReportKind::input);
        const std::size_t out = descriptor_->longest_report(HidReportKind::output);
        if (!wooden_layout(*descriptor_)) {
            const bool is_known = in == out && (in == 8 || in == 14 || in == 64);
            obstacle("its reports have " + bytes(in) + " in and " + bytes(out) + " out; " +
                         (is_known ? "that is known of one collection, FFAB/0200, whose reports "
                                     "have no numbers, and here it is otherwise"
                                   : "8, 14 and 64 both ways are known"),
                     "put one of the public firmwares on the board");
        }
        return product.name;
    }

    const char* space_mouse(const KnownProduct* product) {
        device_.kind = AttachedKind::space_mouse;
        if (product == nullptr) note("a model that is not known, with the usage of a SpaceMouse");
        if (judge_descriptor("the layout is found by its reports")) {
            const std::size_t motion = descriptor_->report_bytes(HidReportKind::input, 1);
            if (motion != kShortMotion && motion < kLongMotion)
                obstacle("its report of motion has " + bytes(motion) + "; 7 and 13 are known",
                         "use another model");
        }
        return product != nullptr ? product->name : nullptr;
    }

    bool makes_forces() const {
        if (among(force_feedback_products()) != nullptr) return true;
        if (!descriptor_) return false;
        return std::any_of(descriptor_->collections.begin(), descriptor_->collections.end(),
                           [](const HidCollection& one) { return one.usage == kPidSetEffect; });
    }

    const char* force_feedback() {
        const KnownProduct* product = among(force_feedback_products());
        device_.kind = AttachedKind::force_feedback;
        if (judge_descriptor("")) {
            try {
                PidReports(*descriptor_, device_.path);
            } catch (const std::exception& error) {
                obstacle_of(error.what());
            }
        } else if (descriptor_error_.empty()) {
            obstacle("its report descriptor cannot be read, and without it there is no telling how "
                     "it wants its forces",
                     "let this user read " + device_.path);
        }
        if (evidence_.kernel_makes_forces)
            note("the kernel's hid-pidff has it too and makes the forces that other programs ask "
                 "for",
                 "close games and joystick tests while it is used");
        return product != nullptr ? product->name : nullptr;
    }

    /// Whether there is a descriptor to go on with; one that is damaged is an obstacle, one that is
    /// missing is worth a note.
    bool judge_descriptor(const char* without) {
        if (descriptor_) return true;
        if (!descriptor_error_.empty())
            obstacle_of(descriptor_error_);
        else if (*without != '\0')
            note(std::string("its report descriptor cannot be read; ") + without);
        return false;
    }

    void judge_access() {
        const std::string& path = device_.path;
        if (evidence_.access == NodeAccess::missing)
            obstacle(path + " is not there, though the kernel has the device",
                     "in a container, pass the node in (--device=" + path + ")");
        if (evidence_.access != NodeAccess::denied) return;
        const std::string what = "this user may not read and write " + path +
                                 (evidence_.owner.empty() ? "" : " (" + evidence_.owner + ")");
        if (!has_rule())
            obstacle(what, "add a rule of its own: echo '" +
                               udev_rule(device_.vendor, device_.product) +
                               "' | sudo tee /etc/udev/rules.d/71-palpate-own.rules; sudo udevadm "
                               "control --reload; then plug the device in again");
        else if (evidence_.rules_installed)
            obstacle(what + " although the udev rules are installed",
                     "plug the device in again; over ssh or without a desktop also: sudo adduser "
                     "$USER plugdev, and log in again");
        else
            obstacle(what, "install the udev rules: palpate devices --udev-rules | sudo tee "
                           "/etc/udev/rules.d/70-palpate.rules >/dev/null; sudo udevadm control "
                           "--reload; then plug the device in again");
    }

    bool has_rule() const {
        return among(wooden_products()) != nullptr || among(space_mouse_products()) != nullptr ||
               among(force_feedback_products()) != nullptr;
    }

    void judge_holders() {
        for (const std::string& holder : evidence_.holders) {
            if (holder.starts_with("palpate"))
                obstacle(holder + " uses it", "stop that first: two programs that send forces "
                                              "undo each other's");
            else if (device_.kind == AttachedKind::space_mouse)
                note(holder + " reads it as well, which does no harm");
            else
                note(holder + " has it open",
                     "stop it if it sends forces: two programs undo each other's");
        }
    }

    std::string name(const char* known_as) const {
        const HidDeviceInfo& said = evidence_.collections.front();
        std::string both = said.manufacturer;
        if (!both.empty() && !said.model.empty()) both += ' ';
        both += said.model;
        if (!both.empty()) return both;
        return known_as != nullptr ? known_as : "device without a name";
    }

    const HidEvidence& evidence_;
    AttachedDevice device_;
    std::optional<HidDescriptor> descriptor_;
    std::string descriptor_error_;
};

} // namespace

AttachedDevice judged(const HidEvidence& evidence) { return Judge(evidence).judge(); }

namespace {

AttachedDevice device_on_usb(const UsbEvidence& evidence, const char* name) {
    AttachedDevice device;
    device.path = evidence.place;
    device.vendor = evidence.vendor;
    device.product = evidence.product;
    device.name = evidence.name.empty() ? name : evidence.name;
    return device;
}

/// Whether this user may open what the library will open.
void judge_usb_access(const UsbEvidence& evidence, AttachedDevice& device) {
    if (evidence.access != NodeAccess::denied) return;
    device.findings.push_back(
        {Weight::note,
         "this user may not read and write " + evidence.node +
             (evidence.owner.empty() ? "" : " (" + evidence.owner + ")"),
         evidence.is_port
             ? "sudo adduser $USER dialout, and log in again"
             : "add a rule: echo '" + usb_udev_rule(evidence.vendor, evidence.product) +
                   "' | sudo tee /etc/udev/rules.d/71-palpate-own.rules; sudo udevadm control "
                   "--reload; then plug the device in again"});
}

} // namespace

std::optional<AttachedDevice> judged(const UsbEvidence& evidence,
                                     const std::vector<HidEvidence>& nodes) {
    const bool has_node = std::any_of(nodes.begin(), nodes.end(), [&](const HidEvidence& node) {
        const HidDeviceInfo& info = node.collections.front();
        return info.vendor == evidence.vendor && info.product == evidence.product;
    });
    if (has_node) return std::nullopt;
    if (const ForeignProduct* foreign =
            find_foreign(evidence.vendor, evidence.product, evidence.name)) {
        AttachedDevice device = device_on_usb(evidence, foreign->id.name);
        judge_foreign(*foreign,
                      evidence.is_port  ? "with the serial port " + evidence.node
                      : evidence.is_hid ? "as a HID device"
                                        : "",
                      device);
        judge_usb_access(evidence, device);
        return device;
    }
    const std::pair<AttachedKind, std::span<const KnownProduct>> ours[] = {
        {AttachedKind::wooden_haptics, wooden_products()},
        {AttachedKind::space_mouse, space_mouse_products()},
        {AttachedKind::force_feedback, force_feedback_products()}};
    for (const auto& [kind, products] : ours) {
        const auto* product = find_product(products, evidence.vendor, evidence.product);
        if (product == nullptr) continue;
        AttachedDevice device = device_on_usb(evidence, product->name);
        device.kind = kind;
        device.findings.push_back(
            {Weight::obstacle,
             "it is on the USB, but the kernel has no hidraw node for it: its driver is "
             "missing, or a program has taken it through libusb",
             "stop such a program, or: sudo modprobe usbhid hid-generic; the kernel "
             "needs CONFIG_HIDRAW"});
        return device;
    }
    return std::nullopt;
}

} // namespace palpate::internal
