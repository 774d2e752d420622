// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <palpate/drivers/internal/hid_port.h>

namespace palpate::internal {

constexpr std::uint16_t kLogitech = 0x046D, k3Dconnexion = 0x256F; ///< sold SpaceMice, sells them

/// A product by its USB ids.
struct KnownProduct {
    std::uint16_t vendor;
    std::uint16_t product;
    const char* name;
};

/// Boards of the WoodenHaptics kind that are HID devices. The first id is one that nobody was
/// given: other boards have it too, and only their usage tells them apart.
std::span<const KnownProduct> wooden_products();
/// Devices of 3Dconnexion with a cap of six degrees of freedom.
std::span<const KnownProduct> space_mouse_products();
/// Devices of 3Dconnexion without one.
std::span<const KnownProduct> capless_products();
/// Sticks known to make constant forces; others are recognised by their report descriptor.
std::span<const KnownProduct> force_feedback_products();

/// A haptic device that does not speak HID.
struct ForeignProduct {
    KnownProduct id;
    const char* speaks; ///< "it talks over a serial port"
    const char* remedy;
};
std::span<const ForeignProduct> foreign_products();

/// Whether a collection is that of a WoodenHaptics board by ids and usage page.           [any]
bool is_wooden(const HidDeviceInfo& info) noexcept;

/// Whether a collection is that of a cap with six degrees of freedom: receivers and combined
/// devices have others beside it.                                                        [any]
bool is_space_mouse(const HidDeviceInfo& info) noexcept;

/// The line of udev's rules that lets users have the nodes of a product, by the name that the
/// kernel gives HID devices on USB and Bluetooth alike: BUS:VENDOR:PRODUCT.NUMBER, in capitals.
/// [any]
std::string udev_rule(std::uint16_t vendor, std::uint16_t product);

/// The product with these ids; null where it is not among them.                          [any]
const KnownProduct* find_product(std::span<const KnownProduct> among, std::uint16_t vendor,
                                 std::uint16_t product) noexcept;

} // namespace palpate::internal
