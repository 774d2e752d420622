// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/igtl_device.h>

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// A server for one client at a time, on sockets of the system.
class Server {
public:
    Server() : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
        EXPECT_EQ(::listen(listener_, 4), 0);
        EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
        port_ = ntohs(address.sin_port);
    }
    ~Server() {
        hang_up();
        ::close(listener_);
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    std::uint16_t port() const { return port_; }
    void accept() { client_ = ::accept(listener_, nullptr, nullptr); }
    void hang_up() {
        if (client_ >= 0) ::close(client_);
        client_ = -1;
    }
    void send(const IgtlBytes& bytes) {
        EXPECT_EQ(::send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
                  static_cast<ssize_t>(bytes.size()));
    }

private:
    int listener_;
    int client_ = -1;
    std::uint16_t port_ = 0;
};

/// After how long the system gives up a silent connection of this process to a port, s.
std::optional<int> given_up_after_s(std::uint16_t port) {
    for (int file = 0; file < 1024; ++file) {
        sockaddr_in peer{};
        socklen_t size = sizeof peer;
        if (::getpeername(file, reinterpret_cast<sockaddr*>(&peer), &size) != 0) continue;
        if (peer.sin_family != AF_INET || ntohs(peer.sin_port) != port) continue;
        const auto option = [&](int level, int name) {
            int value = 0;
            socklen_t length = sizeof value;
            EXPECT_EQ(::getsockopt(file, level, name, &value, &length), 0);
            return value;
        };
        if (option(SOL_SOCKET, SO_KEEPALIVE) == 0) continue; // never
        return option(IPPROTO_TCP, TCP_KEEPIDLE) +
               option(IPPROTO_TCP, TCP_KEEPINTVL) * option(IPPROTO_TCP, TCP_KEEPCNT);
    }
    return std::nullopt;
}

IgtlBytes transform(const std::string& name, double x_m, IgtlVersion version) {
    IgtlMessage message;
    message.version = version;
    message.type = "TRANSFORM";
    message.device = name;
    message.content = igtl_transform_content(igtl_pose({{x_m, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}));
    return igtl_bytes(message);
}

/// Reads until the probe is there, for as long as a slow machine may take.
bool gets_to(IgtlDevice& device, double x_m) {
    for (int i = 0; i < 3000; ++i) {
        DeviceState state;
        device.read(state);
        if (state.trial > 0 && std::abs(state.position.x - x_m) < 1e-6) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

TEST(IgtlAddress, IsTakenApart) {
    const auto expect = [](const std::string& text, const std::string& transform,
                           const std::string& host, int port) {
        const IgtlAddress address = igtl_address(text);
        EXPECT_EQ(address.transform, transform) << text;
        EXPECT_EQ(address.host, host) << text;
        EXPECT_EQ(address.port, port) << text;
    };
    expect("Tool", "Tool", "", 18944);
    expect("StylusToReference@plus.lab", "StylusToReference", "plus.lab", 18944);
    expect("a b@127.0.0.1:5", "a b", "127.0.0.1", 5);
    expect("Tool@[::1]:65535", "Tool", "::1", 65535);
    expect("Tool@[::1]", "Tool", "::1", 18944);
    expect("Tool@fe80::2", "Tool", "fe80::2", 18944);
    for (const std::string text : {"", "@host", "Tool@", "Tool@:1", "Tool@host:", "Tool@host:0",
                                   "Tool@host:65536", "Tool@host:1x", "123456789012345678901@host"})
        EXPECT_THAT([&] { igtl_address(text); },
                    ThrowsMessage<std::invalid_argument>(HasSubstr("; write igtl:TRANSFORM@HOST")))
            << text;
}

TEST(IgtlDevice, FollowsItsTransformAndNoOther) {
    Server server;
    IgtlDevice device({"Tool", "127.0.0.1", server.port()});
    device.open();
    server.accept();
    for (const IgtlVersion version : {IgtlVersion::one, IgtlVersion::two}) {
        const double x_m = version == IgtlVersion::one ? 0.01 : 0.02;
        server.send(transform("Other", 0.5, version));
        IgtlBytes damaged = transform("Tool", 0.4, version);
        damaged.back() ^= 1;
        server.send(damaged);
        server.send(transform("Tool", x_m, version));
        EXPECT_TRUE(gets_to(device, x_m));
    }
    EXPECT_EQ(device.complaint(), "");
    device.close();
}

TEST(IgtlDevice, LooksForAServerThatIsGone) {
    Server server;
    IgtlDevice device({"Tool", "127.0.0.1", server.port()},
                      {.connect_s = 30.0, .reconnect_s = 0.01});
    device.open();
    server.accept();
    server.send(transform("Tool", 0.01, IgtlVersion::two));
    EXPECT_TRUE(gets_to(device, 0.01));
    server.hang_up();
    server.accept(); // it is back
    server.send(transform("Tool", 0.03, IgtlVersion::two));
    EXPECT_TRUE(gets_to(device, 0.03));
    server.send(IgtlBytes(100, 0xFF)); // no OpenIGTLink any more
    server.accept();
    server.send(transform("Tool", 0.04, IgtlVersion::two));
    EXPECT_TRUE(gets_to(device, 0.04));
    device.close();
    EXPECT_FALSE(device.has_failed()) << "it was there again";
}

TEST(IgtlDevice, AServerThatIsGoneAtTheEndIsAFailure) {
    auto server = std::make_unique<Server>();
    IgtlDevice device({"Tool", "127.0.0.1", server->port()},
                      {.connect_s = 30.0, .reconnect_s = 0.01});
    device.open();
    server->accept();
    EXPECT_TRUE(device.has_failed()) << "no pose has come";
    server->send(transform("Tool", 0.01, IgtlVersion::two));
    EXPECT_TRUE(gets_to(device, 0.01));
    EXPECT_FALSE(device.has_failed());
    server.reset();
    std::this_thread::sleep_for(std::chrono::seconds(1)); // until its thread has seen it
    device.close();
    EXPECT_TRUE(device.has_failed());
    EXPECT_THAT(device.complaint(), HasSubstr("went away; start it again"));
}

TEST(IgtlDevice, SaysThatNoServerAnswers) {
    std::uint16_t port = 0;
    {
        const Server gone;
        port = gone.port();
    }
    IgtlDevice device({"Tool", "127.0.0.1", port});
    EXPECT_THAT(
        [&] { device.open(); },
        ThrowsMessage<std::runtime_error>(testing::AllOf(
            HasSubstr("igtl:Tool@127.0.0.1:" + std::to_string(port)), HasSubstr("start it"))));
    device.close();
    DeviceState state;
    EXPECT_TRUE(device.read(state));
    EXPECT_EQ(state.freshness, Freshness::stale);
}

TEST(IgtlDevice, NoticesAComputerThatIsGoneWithoutAWord) {
    Server server;
    IgtlDevice device({"Tool", "127.0.0.1", server.port()});
    device.open();
    server.accept();
    EXPECT_LE(given_up_after_s(server.port()).value_or(7200), 5);
}

} // namespace
} // namespace palpate
