// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

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

/// A haptic device that Palpate has no driver for, and what leads to it.
struct ForeignProduct {
    KnownProduct id;    ///< product 0: every one of the vendor's
    const char* maker;  ///< part of the maker's name as the device says it; null: known by its ids
    const char* called; ///< what users call it, spaces between the names
    const char* speaks; ///< "it talks over a serial port"
    const char* remedy; ///< what to do
    const char* by;     ///< of DeviceWay
    const char* page;   ///< of DeviceWay
    const char* tested; ///< of DeviceWay
};
std::span<const ForeignProduct> foreign_products();

/// The one with these ids, or whose maker's name is in `name`; null where there is none.  [any]
const ForeignProduct* find_foreign(std::uint16_t vendor, std::uint16_t product,
                                   std::string_view name) noexcept;

/// Whether `word` is one of `words`, which have spaces between them.                      [any]
bool has_word(std::string_view words, std::string_view word) noexcept;

/// Whether a collection is that of a WoodenHaptics board by ids and usage page.           [any]
bool is_wooden(const HidDeviceInfo& info) noexcept;

/// Whether a collection is that of a cap with six degrees of freedom: receivers and combined
/// devices have others beside it.                                                        [any]
bool is_space_mouse(const HidDeviceInfo& info) noexcept;

/// The line of udev's rules that lets users have the nodes of a product, by the name that the
/// kernel gives HID devices on USB and Bluetooth alike: BUS:VENDOR:PRODUCT.NUMBER, in capitals.
/// [any]
std::string udev_rule(std::uint16_t vendor, std::uint16_t product);

/// The same for a device that libraries open on the USB itself.                           [any]
std::string usb_udev_rule(std::uint16_t vendor, std::uint16_t product);

/// The product with these ids; null where it is not among them.                          [any]
const KnownProduct* find_product(std::span<const KnownProduct> among, std::uint16_t vendor,
                                 std::uint16_t product) noexcept;

} // namespace palpate::internal
