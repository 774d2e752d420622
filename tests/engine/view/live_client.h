// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <palpate/engine/view/live_server.h>

namespace palpate::test {

namespace asio = boost::asio;
namespace beast = boost::beast;

/// A connection to a live server, as a browser's, that may misbehave.
class LiveClient {
public:
    explicit LiveClient(const LiveServer& server)
        : host_("127.0.0.1:" + std::to_string(server.port())) {
        // Small, so that what is not read soon stops the server's writing.
        stream().open(asio::ip::tcp::v4());
        stream().set_option(asio::socket_base::receive_buffer_size(16 * 1024));
        stream().connect({asio::ip::make_address("127.0.0.1"), server.port()});
    }

    const std::string& host() const { return host_; }
    asio::ip::tcp::socket& stream() { return socket_.next_layer(); }
    beast::websocket::stream<asio::ip::tcp::socket>& socket() { return socket_; }

    /// The status and the body of a request.
    std::pair<unsigned, std::string> request(const std::string& target, const std::string& host,
                                             beast::http::verb verb = beast::http::verb::get) {
        beast::http::request<beast::http::empty_body> request(verb, target, 11);
        request.set(beast::http::field::host, host);
        beast::http::write(stream(), request);
        beast::flat_buffer buffer;
        beast::http::response<beast::http::string_body> response;
        beast::http::read(stream(), buffer, response);
        return {response.result_int(), response.body()};
    }

    /// The status of a request for the socket: 101 where it opens.
    unsigned socket_status(const std::string& token, const std::optional<std::string>& origin) {
        namespace http = beast::http;
        http::request<http::empty_body> request(http::verb::get, "/" + token + "/socket", 11);
        request.set(http::field::host, host_);
        request.set(http::field::connection, "Upgrade");
        request.set(http::field::upgrade, "websocket");
        request.set(http::field::sec_websocket_version, "13");
        request.set(http::field::sec_websocket_key, "AAAAAAAAAAAAAAAAAAAAAA==");
        if (origin) request.set(http::field::origin, *origin);
        http::write(stream(), request);
        beast::flat_buffer buffer;
        http::response<http::string_body> response;
        http::read(stream(), buffer, response);
        return response.result_int();
    }

    /// Opens the socket, as the page does; false where that is refused.
    bool open(const LiveServer& server) {
        socket_.set_option(beast::websocket::stream_base::decorator(
            [this](beast::websocket::request_type& request) {
                request.set(beast::http::field::origin, "http://" + host_);
            }));
        beast::error_code error;
        socket_.handshake(host_, "/" + server.token() + "/socket", error);
        socket_.read_message_max(0);
        return !error;
    }

    void send(const std::string& text) {
        socket_.text(true);
        socket_.write(asio::buffer(text));
    }
    /// The next message; empty where the connection has ended.
    std::string next() {
        beast::flat_buffer buffer;
        beast::error_code error;
        socket_.read(buffer, error);
        return error ? std::string() : beast::buffers_to_string(buffer.data());
    }
    bool is_text() const { return socket_.got_text(); }

private:
    asio::io_context io_;
    std::string host_;
    beast::websocket::stream<asio::ip::tcp::socket> socket_{io_};
};

/// Waits until something is so; false where it is not within ten seconds.
inline bool becomes(const std::function<bool()>& is_so) {
    for (int i = 0; i < 1000; ++i) {
        if (is_so()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return is_so();
}

} // namespace palpate::test
