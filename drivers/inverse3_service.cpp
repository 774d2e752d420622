// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/inverse3_service.h>

#include <charconv>
#include <optional>
#include <stdexcept>

#include <palpate/drivers/internal/device_address.h>
#include <palpate/drivers/internal/inverse3_greeting.h>
#include <palpate/drivers/internal/websocket_client.h>

namespace palpate {
namespace {

template <class Number>
std::optional<Number> number_in(const std::string& text) {
    Number value{};
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || rest != end) return std::nullopt;
    return value;
}

} // namespace

namespace internal {

Greeted greeted(WebSocketClient& socket, const Inverse3Address& address, double patience_s) {
    Greeted outcome;
    outcome.reason = socket.connect(address.host, address.port, patience_s);
    if (!outcome.reason.empty()) return outcome;
    outcome.answer = InverseService::Answer::stranger;
    WebSocketClient::Event event = socket.wait(in_seconds(0.5 * patience_s));
    if (event == WebSocketClient::Event::quiet) {
        socket.send(inventory_request());
        event = socket.wait(in_seconds(0.5 * patience_s));
    }
    if (event == WebSocketClient::Event::message) {
        if (socket.is_text()) outcome.inventory = inventory_in(socket.message());
        if (outcome.inventory)
            outcome.answer = InverseService::Answer::service;
        else
            outcome.reason = "its first message lists no devices";
    } else {
        outcome.reason = event == WebSocketClient::Event::closed
                             ? socket.failure()
                             : std::string("it does not say what it has");
    }
    return outcome;
}

} // namespace internal

Inverse3Address inverse3_address(const std::string& text) {
    const auto fail = [&](const std::string& what, const std::string& remedy) {
        throw std::runtime_error("inverse3" + text + ": " + what + "; " + remedy);
    };
    const bool has_id = text.starts_with(":");
    const internal::DeviceAddress taken =
        internal::device_address(has_id ? "inverse3:" : "inverse3", text.substr(has_id ? 1 : 0));
    if (has_id == taken.place.empty())
        fail(has_id ? "names no device" : "is no address",
             "write inverse3, inverse3:DEVICE_ID, inverse3?key=value or both; `palpate devices` "
             "lists the ids");
    Inverse3Address address;
    address.device_id = taken.place;
    for (const auto& [key, value] : taken.options) {
        if (key == "host" && internal::is_numeric_address(value)) {
            address.host = value;
        } else if (key == "port" && number_in<std::uint16_t>(value).value_or(0) > 0) {
            address.port = *number_in<std::uint16_t>(value);
        } else if (key == "grip" && !value.empty()) {
            address.grip_id = value;
        } else if (const auto force_n = number_in<double>(value);
                   key == "force_n" && force_n && *force_n > 0.0 &&
                   *force_n <= internal::kMostForce_n) {
            address.force_n = *force_n;
        } else {
            std::string given = key;
            given += '=';
            given += value;
            given += " is no option with a value that it may have";
            fail(given, "give host=ADDRESS in digits, port=1..65535, grip=ID or force_n=NEWTONS up "
                        "to 10");
        }
    }
    return address;
}

InverseService ask_inverse_service(const Inverse3Address& address, double patience_s) {
    internal::WebSocketClient socket;
    const internal::Greeted outcome = internal::greeted(socket, address, patience_s);
    InverseService service{outcome.answer, outcome.reason, {}, {}};
    if (!outcome.inventory) return service;
    for (const internal::ServiceDevice& one : outcome.inventory->devices)
        service.devices.push_back(
            {one.id, one.type, one.handedness, one.is_calibrated, one.has_power, one.is_in_use});
    service.grips = outcome.inventory->grips;
    socket.close(internal::kFarewell_s);
    return service;
}

} // namespace palpate
