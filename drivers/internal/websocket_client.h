// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace palpate::internal {

/// Whether a text is what connect() takes for a host: a numeric address, or localhost.     [any]
bool is_numeric_address(const std::string& host);

/// One end of a WebSocket (RFC 6455), of which nothing waits longer than it is told: not for a
/// connection, not for a message, not for the other side to close.
///
/// All but interrupt() is of one thread at a time. While wait() does not run, nothing comes and
/// nothing goes; what was sent is on its way when send() returns, as far as the other side takes
/// it.
class WebSocketClient {
public:
    using Time = std::chrono::steady_clock::time_point;

    /// Longer messages end the connection, bytes.
    static constexpr std::size_t kLongestMessage = std::size_t{256} * 1024;

    /// What a wait ends with.
    enum class Event : std::uint8_t {
        message,    ///< message() is new
        pong,       ///< the newest ping was answered: all that was sent before it has been read
        quiet,      ///< the time is over
        closed,     ///< failure() says why
        interrupted ///< interrupt() was called, and resume() not yet
    };

    WebSocketClient(); ///< [setup]
    /// Drops the connection.                                                            [setup]
    ~WebSocketClient();
    WebSocketClient(const WebSocketClient&) = delete;
    WebSocketClient& operator=(const WebSocketClient&) = delete;

    /// Connects, and drops what was connected before. `host` is a numeric address, or localhost
    /// (127.0.0.1): a name server may take longer than any patience. Empty, or why it could not be.
    /// [setup]
    std::string connect(const std::string& host, std::uint16_t port, double patience_s);
    /// True from a connect() that succeeds until drop(); also where wait() says that the other side
    /// has closed.                                                                      [setup]
    bool is_open() const noexcept;

    /// Sends a text message. False: none is open, or the one before is still on its way.
    /// [setup]
    bool send(std::string_view text);
    /// True while the other side has not taken all of the message that was sent last.   [setup]
    bool is_sending() const noexcept;

    /// Asks the other side to say when it has read all that was sent until now. Again only after
    /// that. False: none is open, or the one before is not answered.                    [setup]
    bool ping();

    /// Waits until a message or a pong has come, or the connection is over, or the time is. [setup]
    Event wait(Time until);
    /// The newest message, until the next wait().                                       [setup]
    std::string_view message() const noexcept;
    /// False where the newest message was sent as binary.                               [setup]
    bool is_text() const noexcept;
    /// Why the connection is over.                                                      [setup]
    const std::string& failure() const noexcept;

    /// Says goodbye, waits at most so long for the answer, and drops.                   [setup]
    void close(double patience_s) noexcept;
    /// Ends the connection at once; nothing that was sent and not yet taken gets there. [setup]
    void drop() noexcept;

    /// Ends each wait, that of connect() and close() too, from now on.                    [any]
    void interrupt() noexcept;
    /// Lets waits be waits again.                                                       [setup]
    void resume() noexcept;

private:
    class Work;
    std::unique_ptr<Work> work_;
};

/// The time in so many seconds.                                                           [any]
WebSocketClient::Time in_seconds(double seconds) noexcept;

} // namespace palpate::internal
