// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <palpate/drivers/internal/device_judgement.h>

namespace palpate::internal {

/// Where the system tells of itself; others than its own only in tests.
struct SystemFolders {
    std::filesystem::path sys = "/sys";
    std::filesystem::path proc = "/proc";
    std::filesystem::path rules = "/etc/udev/rules.d";
    std::filesystem::path dev = "/dev";
};

/// Those under a folder.                                                                  [any]
SystemFolders system_folders(const std::filesystem::path& root);

/// What can be learnt of the HID devices that hidapi lists, a node each. Reads, opens no node.
///                                                                                      [setup]
std::vector<HidEvidence> hid_evidence(const std::vector<HidDeviceInfo>& listed,
                                      const SystemFolders& system = {});

/// Why the devices on the USB cannot be listed, as an AttachedDevice of kind unseen; nothing where
/// they can.                                                                            [setup]
std::optional<AttachedDevice> unseen_usb(const SystemFolders& system = {});

/// Everything on the USB.                                                               [setup]
std::vector<UsbEvidence> usb_evidence(const SystemFolders& system = {});

/// Programs that have a file open, as far as this user may see.                         [setup]
std::vector<std::string> holders_of(const std::string& path, const SystemFolders& system = {});

} // namespace palpate::internal
