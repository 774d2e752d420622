// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <palpate/engine/view/live_server.h>

namespace palpate::test {

/// A connection to a live server, as a browser's, that may misbehave. What fails throws
/// std::exception, but where something else is said.
class LiveClient {
public:
    enum class Method { get, post };

    explicit LiveClient(const LiveServer& server);
    ~LiveClient();

    const std::string& host() const;
    /// The status and the body of a request.
    std::pair<unsigned, std::string> request(const std::string& target, const std::string& host,
                                             Method method = Method::get);
    /// The status of a request for the socket: 101 where it opens.
    unsigned socket_status(const std::string& token, const std::optional<std::string>& origin);

    /// Opens the socket, as the page does; false where that is refused.
    bool open(const LiveServer& server);
    void send(const std::string& text);
    void send_bytes(const std::string& bytes);
    /// False where the server is gone.
    bool try_send(const std::string& text);
    /// The next message; empty where the connection has ended.
    std::string next();
    bool is_text() const; ///< the last one
    /// Whether the server closed it, and said that the page may try again later.
    bool is_told_to_try_later() const;
    /// Says goodbye. What fails is nobody's concern.
    void close();
    /// Goes without a word.
    void shut_down();

private:
    struct Connection;
    std::unique_ptr<Connection> connection_;
};

/// Waits until something is so; false where it is not within a minute.
bool becomes(const std::function<bool()>& is_so);

} // namespace palpate::test
