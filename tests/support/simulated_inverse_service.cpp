// SPDX-License-Identifier: Apache-2.0
#include "tests/support/simulated_inverse_service.h"

#include <algorithm>
#include <array>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

namespace palpate::test {

namespace asio = boost::asio;
namespace beast = boost::beast;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using Json = nlohmann::json;

namespace {

double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

Json xyz(const Vec3& v) { return {{"x", v.x}, {"y", v.y}, {"z", v.z}}; }

HeardCommand understood(const std::string& text) {
    HeardCommand command;
    command.time_s = now_s();
    const Json json = Json::parse(text);
    command.has_session = json.contains("session");
    for (const Json& device : json.value("inverse3", Json::array())) {
        command.device_id = device.at("device_id").get<std::string>();
        if (!device.contains("commands")) continue;
        const Json& force = device.at("commands").at("set_cursor_force");
        command.key = force.contains("vector") ? "vector" : "values";
        const Json& values = force.at(command.key);
        command.force = Vec3(values.at("x").get<double>(), values.at("y").get<double>(),
                             values.at("z").get<double>());
    }
    return command;
}

constexpr std::size_t kHead = 2, kMask = 4;

/// How long a client's frame is that begins here (RFC 6455, 5.2; masked, below 64 KiB); 0: not
/// whole.
std::size_t frame_length(const std::string& bytes) {
    if (bytes.size() < kHead) return 0;
    std::size_t length = static_cast<unsigned char>(bytes[1]) & 0x7Fu, more = 0;
    if (length == 126) {
        if (bytes.size() < kHead + 2) return 0;
        more = 2;
        length = static_cast<unsigned char>(bytes[2]) * 256u + static_cast<unsigned char>(bytes[3]);
    }
    const std::size_t whole = kHead + more + kMask + length;
    return bytes.size() >= whole ? whole : 0;
}

/// What a client's ping says, whose frame this is: 125 bytes at most.
std::string said_by_ping(const std::string& frame) {
    std::string said = frame.substr(kHead + kMask);
    for (std::size_t i = 0; i < said.size(); ++i)
        said[i] = static_cast<char>(said[i] ^ frame[kHead + i % kMask]);
    return said;
}

/// Of text, of any length below 64 KiB.
std::string text_frame(const std::string& text) {
    return std::string{'\x81', '\x7E', static_cast<char>(text.size() / 256),
                       static_cast<char>(text.size() % 256)} +
           text;
}

/// Of 125 bytes at most.
std::string pong_frame(const std::string& said) {
    return std::string{'\x8A', static_cast<char>(said.size())} + said;
}

} // namespace

/// Threads that wait in the kernel: one for who connects, one for each connection. A socket is shut
/// down by its number, which any thread may do.
class SimulatedInverseService::Server {
public:
    Server(SimulatedInverseService& service, std::uint16_t port) : service_(service) {
        listen(port);
    }
    ~Server() { stop(); }

    std::uint16_t listen(std::uint16_t port);
    void stop();
    void hang_up();

    std::mutex mutex_; ///< of what follows
    Behaviour behaviour_;
    std::string greeting_;
    Vec3 position_{0.0, -0.12, 0.15};
    Vec3 applied_{0.0};
    std::vector<HeardCommand> heard_;

    std::uint16_t port_ = 0;

private:
    struct Connection {
        explicit Connection(Tcp::socket accepted)
            // No dup(): ThreadSanitizer takes that for a close of whatever had the number before.
            : socket(std::move(accepted)),
              number(::fcntl(socket.next_layer().native_handle(), F_DUPFD_CLOEXEC, 0)) {}
        ~Connection() { ::close(number); }
        Connection(const Connection&) = delete;
        Connection& operator=(const Connection&) = delete;
        beast::websocket::stream<Tcp::socket> socket;
        int number; ///< ours alone: Beast closes its own, which then is another socket's
        std::thread thread;
    };
    void accept();
    void serve(Connection& connection);
    void serve_by_hand(const Connection& connection);
    void answer(Connection& connection, const HeardCommand& command);

    SimulatedInverseService& service_;
    asio::io_context io_;
    std::unique_ptr<Tcp::acceptor> acceptor_;
    int listening_ = -1;
    std::thread accepting_;
    std::list<Connection> connections_;
};

std::uint16_t SimulatedInverseService::Server::listen(std::uint16_t port) {
    acceptor_ = std::make_unique<Tcp::acceptor>(
        io_, Tcp::endpoint(asio::ip::address_v4::loopback(), port), true);
    port_ = acceptor_->local_endpoint().port();
    listening_ = acceptor_->native_handle();
    accepting_ = std::thread([this] { accept(); });
    return port_;
}

void SimulatedInverseService::Server::accept() {
    for (;;) {
        ErrorCode ended;
        Tcp::socket socket(io_);
        acceptor_->accept(socket, ended);
        if (ended) return;
        const std::lock_guard lock(mutex_);
        Connection& connection = connections_.emplace_back(std::move(socket));
        connection.thread = std::thread([this, &connection] { serve(connection); });
    }
}

void SimulatedInverseService::Server::stop() {
    ::shutdown(listening_, SHUT_RDWR);
    if (accepting_.joinable()) accepting_.join();
    acceptor_.reset();
    hang_up();
    for (Connection& connection : connections_)
        connection.thread.join();
    connections_.clear();
}

void SimulatedInverseService::Server::hang_up() {
    const std::lock_guard lock(mutex_);
    for (Connection& connection : connections_)
        ::shutdown(connection.number, SHUT_RDWR);
}

void SimulatedInverseService::Server::serve(Connection& connection) {
    ErrorCode ended;
    connection.socket.next_layer().set_option(Tcp::no_delay(true), ended);
    connection.socket.accept(ended);
    if (ended) return;
    std::string first;
    {
        const std::lock_guard lock(mutex_);
        first = greeting_;
    }
    if (first.empty()) first = service_.first_message();
    connection.socket.text(true);
    connection.socket.write(asio::buffer(first), ended);
    ++service_.connections_;
    if (service_.pongs_.load() != Pongs::right) return serve_by_hand(connection);
    for (std::uint64_t number = 0; !ended; ++number) {
        beast::flat_buffer buffer;
        connection.socket.read(buffer, ended);
        if (ended) break;
        HeardCommand command = understood(beast::buffers_to_string(buffer.data()));
        command.number = number;
        answer(connection, command);
    }
    ::shutdown(connection.number, SHUT_RDWR);
}

/// Beast answers pings by itself, so here frames are read and written by hand.
void SimulatedInverseService::Server::serve_by_hand(const Connection& connection) {
    constexpr int kText = 1, kPing = 9;
    const bool has_pongs = service_.pongs_.load() == Pongs::one_too_many;
    std::string bytes;
    std::array<char, 4096> chunk{};
    for (;;) {
        const ssize_t count = ::recv(connection.number, chunk.data(), chunk.size(), 0);
        if (count <= 0) return;
        bytes.append(chunk.data(), static_cast<std::size_t>(count));
        while (const std::size_t length = frame_length(bytes)) {
            const std::string heard = bytes.substr(0, length);
            bytes.erase(0, length);
            std::string answer; // in one piece, so that all of it comes at once
            if ((heard[0] & 0xF) == kText) answer = text_frame(service_.state_message());
            if ((heard[0] & 0xF) == kPing && has_pongs)
                answer = pong_frame(said_by_ping(heard)) + pong_frame("unasked");
            if (answer.empty()) continue;
            if (::send(connection.number, answer.data(), answer.size(), MSG_NOSIGNAL) < 0) return;
        }
    }
}

void SimulatedInverseService::Server::answer(Connection& connection, const HeardCommand& command) {
    Behaviour behaviour;
    {
        const std::lock_guard lock(mutex_);
        heard_.push_back(command);
        applied_ = command.force;
        behaviour = behaviour_;
    }
    const std::vector<ServiceFrame> frames =
        behaviour ? behaviour(command)
                  : std::vector<ServiceFrame>{{service_.state_message(), false, {}}};
    for (const ServiceFrame& frame : frames) {
        std::this_thread::sleep_for(frame.after);
        connection.socket.binary(frame.is_binary);
        ErrorCode ended;
        connection.socket.write(asio::buffer(frame.text), ended);
        if (ended) return;
    }
}

SimulatedInverseService::SimulatedInverseService(Version version, std::vector<std::string> ids)
    : version_(version), ids_(std::move(ids)), server_(std::make_unique<Server>(*this, 0)) {
    port_ = server_->port_;
}

SimulatedInverseService::~SimulatedInverseService() { stop(); }

void SimulatedInverseService::behave(Behaviour behaviour) {
    const std::lock_guard lock(server_->mutex_);
    server_->behaviour_ = std::move(behaviour);
}

void SimulatedInverseService::greet_with(std::string text) {
    const std::lock_guard lock(server_->mutex_);
    server_->greeting_ = std::move(text);
}

void SimulatedInverseService::stop() { server_->stop(); }
void SimulatedInverseService::restart() { server_->listen(port_); }
void SimulatedInverseService::hang_up() { server_->hang_up(); }

void SimulatedInverseService::move_to(const Vec3& position) {
    const std::lock_guard lock(server_->mutex_);
    server_->position_ = position;
}

std::vector<HeardCommand> SimulatedInverseService::heard() {
    const std::lock_guard lock(server_->mutex_);
    return std::exchange(server_->heard_, {});
}

std::string SimulatedInverseService::state_message() const { return message(false); }
std::string SimulatedInverseService::first_message() const { return message(true); }

/// The members that the documents show; those of 3.1 are a part of those of 3.5.
std::string SimulatedInverseService::message(bool is_first) const {
    Vec3 position, applied;
    {
        const std::lock_guard lock(server_->mutex_);
        position = server_->position_;
        applied = server_->applied_;
    }
    const bool is_new = version_ == Version::v3_5;
    Json all = {{"inverse3", Json::array()}, {"wireless_verse_grip", Json::array()}};
    if (is_first && is_new) all["session_id"] = 7;
    for (const std::string& id : ids_) {
        Json device = {{"device_id", id},
                       {"state",
                        {{"cursor_position", xyz(position)},
                         {"cursor_velocity", xyz(Vec3(0.01, 0.02, 0.03))},
                         {"angular_position", {{"a0", -30.9}, {"a1", 53.8}, {"a2", -6.6}}},
                         {"current_cursor_force", xyz(applied)},
                         {"control_mode", "cursor_force"}}},
                       {"status",
                        {{"calibrated", true},
                         {"in_use", false},
                         {"power_supply", true},
                         {"ready", true},
                         {"started", true}}}};
        if (is_first) {
            device["config"] = {
                {"type", "inverse3"}, {"handedness", "right"}, {"port", "/dev/ttyACM0"}};
            if (is_new) {
                device["config"]["basis"] = {{"permutation", "XYZ"}};
                device["config"]["preset"] = "defaults";
            }
        }
        all["inverse3"].push_back(std::move(device));
    }
    all["wireless_verse_grip"].push_back(
        {{"device_id", "61576"},
         {"state",
          {{"orientation", {{"w", 0.6}, {"x", 0.8}, {"y", 0.0}, {"z", 0.0}}},
           {"buttons", {{"a", false}, {"b", true}, {"c", false}}},
           {"battery_level", 0.8}}}});
    return all.dump();
}

} // namespace palpate::test
