// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <palpate/drivers/internal/inverse3_messages.h>
#include <palpate/drivers/internal/websocket_client.h>
#include <palpate/drivers/inverse3_service.h>

namespace palpate::internal {

constexpr double kMostForce_n = 10.0; ///< of Inverse3Address::force_n
/// For the last zero force, and again for the goodbye, s.
constexpr double kFarewell_s = 0.05;

/// A service's first message; else what answered instead, in words.
struct Greeted {
    std::optional<ServiceInventory> inventory;
    InverseService::Answer answer = InverseService::Answer::nobody;
    std::string reason;
};

/// Connects, and waits for the first message; each takes at most `patience_s`. It comes without
/// being asked for; to be sure, it is asked for in the middle of the patience. Where there is no
/// inventory, the connection may still be open.                                         [setup]
Greeted greeted(WebSocketClient& socket, const Inverse3Address& address, double patience_s);

} // namespace palpate::internal
