// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/drivers/inverse3_service.h>

namespace palpate {

/// Haply's Inverse Service in the list of devices: where it was asked for, and what it answered.
struct ListedInverseService {
    Inverse3Address address; ///< who was asked
    InverseService found;    ///< what came of it
    bool is_named = false;   ///< somebody said where: that nobody answers is told, too
};

/// Asks the service at `where` what it has: HOST, HOST:PORT or empty, which is this computer.
/// Waits at most 4 s, and nearly not at all where nobody listens. Throws std::runtime_error where
/// that is no numeric address.                                                          [setup]
ListedInverseService listed_inverse_service(const std::string& where);

/// What scenes and --device call one of its devices.                                      [any]
std::string address_of(const ListedInverseService& service, const ListedInverse3& device);

/// How many of its devices can be used.                                                   [any]
std::size_t usable_devices(const ListedInverseService& service);

/// A line for each device, and one for a service that has none. Where no service answers it says
/// so, but only of one that was named.                                                    [any]
std::string inverse_service_text(const ListedInverseService& service);
/// The same with what is in the way of each, and what to do about it; also where no service
/// answers.                                                                               [any]
std::string inverse_service_why(const ListedInverseService& service);

} // namespace palpate
