// SPDX-License-Identifier: Apache-2.0
#include "tests/engine/view/live_client.h"

#include <chrono>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace palpate::test {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;

struct LiveClient::Connection {
    asio::io_context io;
    std::string host;
    beast::websocket::stream<asio::ip::tcp::socket> socket{io};

    asio::ip::tcp::socket& stream() { return socket.next_layer(); }

    http::response<http::string_body> asked(const http::request<http::empty_body>& request) {
        http::write(stream(), request);
        beast::flat_buffer buffer;
        http::response<http::string_body> response;
        http::read(stream(), buffer, response);
        return response;
    }
};

LiveClient::LiveClient(const LiveServer& server) : connection_(std::make_unique<Connection>()) {
    connection_->host = "127.0.0.1:" + std::to_string(server.port());
    // Small, so that what is not read soon stops the server's writing.
    asio::ip::tcp::socket& stream = connection_->stream();
    stream.open(asio::ip::tcp::v4());
    stream.set_option(asio::socket_base::receive_buffer_size(16 * 1024));
    stream.connect({asio::ip::make_address("127.0.0.1"), server.port()});
}

LiveClient::~LiveClient() = default;

const std::string& LiveClient::host() const { return connection_->host; }

std::pair<unsigned, std::string> LiveClient::request(const std::string& target,
                                                     const std::string& host, Method method) {
    http::request<http::empty_body> request(
        method == Method::post ? http::verb::post : http::verb::get, target, 11);
    request.set(http::field::host, host);
    const auto response = connection_->asked(request);
    return {response.result_int(), response.body()};
}

unsigned LiveClient::socket_status(const std::string& token,
                                   const std::optional<std::string>& origin) {
    http::request<http::empty_body> request(http::verb::get, "/" + token + "/socket", 11);
    request.set(http::field::host, host());
    request.set(http::field::connection, "Upgrade");
    request.set(http::field::upgrade, "websocket");
    request.set(http::field::sec_websocket_version, "13");
    request.set(http::field::sec_websocket_key, "AAAAAAAAAAAAAAAAAAAAAA==");
    if (origin) request.set(http::field::origin, *origin);
    return connection_->asked(request).result_int();
}

bool LiveClient::open(const LiveServer& server) {
    connection_->socket.set_option(
        beast::websocket::stream_base::decorator([this](beast::websocket::request_type& request) {
            request.set(http::field::origin, "http://" + host());
        }));
    beast::error_code error;
    connection_->socket.handshake(host(), "/" + server.token() + "/socket", error);
    connection_->socket.read_message_max(0);
    return !error;
}

void LiveClient::send(const std::string& text) {
    connection_->socket.text(true);
    connection_->socket.write(asio::buffer(text));
}

void LiveClient::send_bytes(const std::string& bytes) {
    connection_->socket.binary(true);
    connection_->socket.write(asio::buffer(bytes));
}

bool LiveClient::try_send(const std::string& text) {
    beast::error_code error;
    connection_->socket.text(true);
    connection_->socket.write(asio::buffer(text), error);
    return !error;
}

std::string LiveClient::next() {
    beast::flat_buffer buffer;
    beast::error_code error;
    connection_->socket.read(buffer, error);
    return error ? std::string() : beast::buffers_to_string(buffer.data());
}

bool LiveClient::is_text() const { return connection_->socket.got_text(); }

bool LiveClient::is_told_to_try_later() const {
    return connection_->socket.reason().code == beast::websocket::close_code::try_again_later;
}

void LiveClient::close() {
    beast::error_code ignored;
    connection_->socket.close(beast::websocket::close_code::normal, ignored);
}

void LiveClient::shut_down() {
    beast::error_code ignored;
    connection_->stream().shutdown(asio::ip::tcp::socket::shutdown_both, ignored);
}

bool becomes(const std::function<bool()>& is_so) {
    for (int i = 0; i < 6000; ++i) {
        if (is_so()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return is_so();
}

} // namespace palpate::test
