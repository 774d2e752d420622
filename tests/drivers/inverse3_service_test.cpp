// SPDX-License-Identifier: Apache-2.0
// The Inverse Service as it is found, asked and refused, before a device runs over it.
#include <palpate/drivers/inverse3_service.h>

#include <arpa/inet.h>
#include <dlfcn.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/drivers/internal/websocket_client.h>
#include <palpate/drivers/inverse3_device.h>

#include "tests/support/simulated_inverse_service.h"

namespace palpate {
namespace {

using test::settings_of;
using Service = test::SimulatedInverseService;
using Version = Service::Version;

std::string refusal(const Inverse3Device::Settings& settings) {
    Inverse3Device device(settings);
    try {
        device.open();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

#define EXPECT_PART(text, part)                                                                    \
    EXPECT_NE(std::string(text).find(part), std::string::npos) << std::string(text)

TEST(Inverse3Service, AddressesAreReadOptionByOption) {
    const Inverse3Address usual = inverse3_address("");
    EXPECT_EQ(usual.device_id, "");
    EXPECT_EQ(usual.host, "127.0.0.1");
    EXPECT_EQ(usual.port, 10001);
    const Inverse3Address all =
        inverse3_address(":049D?host=10.0.0.7&port=8500&grip=61576&force_n=2.5");
    EXPECT_EQ(all.device_id, "049D");
    EXPECT_EQ(all.host, "10.0.0.7");
    EXPECT_EQ(all.port, 8500);
    EXPECT_EQ(all.grip_id, "61576");
    EXPECT_EQ(all.force_n, 2.5);
    for (const char* wrong : {":", "x", ":?port=1", "?port=0", "?port=65536", "?port=7x",
                              "?force_n=0", "?force_n=11", "?force_n=nan", "?force_n=", "?host=",
                              "?grip=", "?rate=3", "?port=1&port=2", "?port", "?=1"})
        EXPECT_THROW(inverse3_address(wrong), std::runtime_error) << wrong;
}

TEST(Inverse3Service, WhatIsInTheWayIsSaidWithARemedy) {
    Service service(Version::v3_5, {"049D", "04EA"});
    EXPECT_EQ(refusal(settings_of(service)), "");
    auto other = settings_of(service);
    other.address.device_id = "0512";
    EXPECT_PART(refusal(other), "has 049D, 04EA and no 0512; give one of these");
    service.greet_with(R"({"inverse3":[]})");
    EXPECT_PART(refusal(settings_of(service)), "has no device; plug one in");
    service.greet_with(R"({"inverse3":[{"device_id":"A","status":{"calibrated":false}}]})");
    EXPECT_PART(refusal(settings_of(service)), "A is not calibrated");
    service.greet_with("hello");
    EXPECT_PART(refusal(settings_of(service)), "is no Inverse Service of version 3.1 or later");
    service.stop();
    EXPECT_PART(refusal(settings_of(service)), "no Inverse Service answers at 127.0.0.1:");
    auto named = settings_of(service);
    named.address.host = "example.org";
    EXPECT_PART(refusal(named), "example.org is no numeric address");
}

TEST(Inverse3Service, AListenerThatSaysNothingHoldsNobodyUp) {
    Service service;
    service.greet_with(" "); // a message, and no inventory
    auto settings = settings_of(service);
    settings.patience_s = 0.2;
    EXPECT_PART(refusal(settings), "its first message lists no devices");
    const InverseService asked = ask_inverse_service(settings.address, 0.2);
    EXPECT_EQ(asked.answer, InverseService::Answer::stranger);
}

/// Listens at a free port of an address, and says there which; -1: it cannot.
int listener_at(sockaddr* here, socklen_t size) {
    const int listener = ::socket(here->sa_family, SOCK_STREAM, 0);
    if (listener < 0) return -1;
    if (::bind(listener, here, size) == 0 && ::listen(listener, 1) == 0 &&
        ::getsockname(listener, here, &size) == 0)
        return listener;
    ::close(listener);
    return -1;
}

// Beast never ends a handshake whose answer states a body beyond its limit: the driver waited for
// it.
TEST(Inverse3Service, AListenerThatAnswersWithAnEndlessPageHoldsNobodyUp) {
    if (::dlsym(RTLD_DEFAULT, "__asan_init") != nullptr)
        GTEST_SKIP() << "AddressSanitizer ends the process where room for it is asked for";
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int listener = listener_at(reinterpret_cast<sockaddr*>(&here), sizeof here);
    ASSERT_GE(listener, 0);
    int page = -1;
    std::thread answers([&] {
        page = ::accept(listener, nullptr, nullptr);
        std::array<char, 4096> request{};
        EXPECT_GT(::recv(page, request.data(), request.size(), 0), 0);
        const std::string head = "HTTP/1.1 200 OK\r\nContent-Length: 99999999999999\r\n\r\n{";
        EXPECT_EQ(::send(page, head.data(), head.size(), MSG_NOSIGNAL), ssize_t(head.size()));
    });
    const InverseService asked =
        ask_inverse_service(inverse3_address("?port=" + std::to_string(ntohs(here.sin_port))), 0.5);
    EXPECT_NE(asked.answer, InverseService::Answer::service);
    answers.join();
    ::close(page);
    ::close(listener);
}

// RFC 3986, 3.2.2: without brackets nobody knows where the port begins.
TEST(Inverse3Service, AnAddressOfVersionSixIsInBracketsInTheRequest) {
    sockaddr_in6 here{};
    here.sin6_family = AF_INET6;
    here.sin6_addr = in6addr_loopback;
    const int listener = listener_at(reinterpret_cast<sockaddr*>(&here), sizeof here);
    if (listener < 0) GTEST_SKIP() << "this machine has no address ::1";
    std::string request;
    std::thread hears([&] {
        const int client = ::accept(listener, nullptr, nullptr);
        std::array<char, 4096> bytes{};
        while (request.find("\r\n\r\n") == std::string::npos) {
            const ssize_t count = ::recv(client, bytes.data(), bytes.size(), 0);
            if (count <= 0) break;
            request.append(bytes.data(), static_cast<std::size_t>(count));
        }
        ::close(client);
    });
    Inverse3Address address;
    address.host = "::1";
    address.port = ntohs(here.sin6_port);
    EXPECT_NE(ask_inverse_service(address, 5.0).answer, InverseService::Answer::service);
    ::shutdown(listener, SHUT_RDWR);
    hears.join();
    ::close(listener);
    EXPECT_PART(request, "\r\nHost: [::1]:" + std::to_string(address.port) + "\r\n");
}

TEST(Inverse3Service, APongThatNobodyAskedForChangesNothing) {
    using Event = internal::WebSocketClient::Event;
    Service service;
    service.add_pongs();
    internal::WebSocketClient client;
    ASSERT_EQ(client.connect("127.0.0.1", service.port(), 20.0), "");
    ASSERT_EQ(client.wait(internal::in_seconds(20.0)), Event::message) << "the greeting";
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(client.ping()) << "the one before was answered";
        ASSERT_EQ(client.wait(internal::in_seconds(20.0)), Event::pong) << i;
    }
    EXPECT_EQ(client.wait(internal::in_seconds(0.05)), Event::quiet) << "none is for nothing";
}

TEST(Inverse3Service, AServiceIsAskedWhatItHasAndGetsNoForce) {
    Service service(Version::v3_1, {"049D", "04EA"});
    const InverseService asked = ask_inverse_service(inverse3_address(service.options()), 5.0);
    EXPECT_EQ(asked.answer, InverseService::Answer::service);
    ASSERT_EQ(asked.devices.size(), 2u);
    EXPECT_EQ(asked.devices[1].device_id, "04EA");
    EXPECT_EQ(asked.devices[1].handedness, "right");
    EXPECT_EQ(asked.grips, std::vector<std::string>{"61576"});
    EXPECT_TRUE(service.heard().empty());
    service.stop();
    EXPECT_EQ(ask_inverse_service(inverse3_address(service.options()), 5.0).answer,
              InverseService::Answer::nobody);
}

} // namespace
} // namespace palpate
