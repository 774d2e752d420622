// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/websocket_client.h>

#include <atomic>
#include <exception>
#include <optional>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

namespace palpate::internal {

namespace asio = boost::asio;
namespace beast = boost::beast;
using Stream = beast::websocket::stream<asio::ip::tcp::socket>;
using ErrorCode = boost::system::error_code;

constexpr double kPatienceToDrop_s = 0.1; // for handlers of a socket that is closed

WebSocketClient::Time in_seconds(double seconds) noexcept {
    return std::chrono::steady_clock::now() +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(
               std::chrono::duration<double>(seconds));
}

/// Everything of Boost. Handlers run within pump() and nowhere else.
class WebSocketClient::Work {
public:
    std::string connect(const std::string& host, std::uint16_t port, double patience_s);
    bool send(std::string_view text);
    bool ping();
    Event wait(Time until);
    void close(double patience_s);
    void drop();
    void interrupt() {
        interrupted_.store(true);
        asio::post(io_, [] {});
    }

    std::optional<Stream> stream_;
    beast::flat_buffer buffer_;
    std::string failure_;
    bool is_sending_ = false;
    std::atomic<bool> interrupted_{false};

private:
    template <class Condition>
    bool pump(Time until, Condition is_met);
    std::string step(const char* what, Time until);
    void begin_read();
    void fail(const ErrorCode& why) {
        if (failure_.empty()) failure_ = why.message();
    }

    asio::io_context io_{1};
    asio::executor_work_guard<asio::io_context::executor_type> guard_{io_.get_executor()};
    asio::steady_timer timer_{io_};
    std::uint64_t timing_ = 0;       ///< which waiting the timer is of
    bool is_over_ = false;           ///< its time
    int pending_ = 0;                ///< operations on the stream whose handlers have not run
    std::uint64_t connection_ = 0;   ///< which stream; what is left of an older one does nothing
    std::optional<ErrorCode> ended_; ///< how the step of connecting or closing ended
    std::string outgoing_;
    bool is_reading_ = false;
    bool has_message_ = false;
    bool is_pinging_ = false; ///< the pong has not come
    bool has_pong_ = false;
    int pings_ = 0; ///< tells pongs apart
};

/// Runs handlers until the condition is met: true; or the time is over, or all is interrupted.
template <class Condition>
bool WebSocketClient::Work::pump(Time until, Condition is_met) {
    is_over_ = false;
    timer_.expires_at(until);
    timer_.async_wait([this, of = ++timing_](const ErrorCode& ended) {
        if (!ended && of == timing_) is_over_ = true;
    });
    while (!is_met()) {
        if (is_over_ || interrupted_.load()) return false;
        io_.run_one();
    }
    return true;
}

/// Waits for a step of connecting; empty where it succeeded.
std::string WebSocketClient::Work::step(const char* what, Time until) {
    try {
        if (!pump(until, [&] { return ended_.has_value(); }))
            return std::string(what) +
                   (interrupted_.load() ? " was interrupted" : " takes too long");
    } catch (const std::exception&) { // Beast makes room for as long an answer as is announced
        return std::string(what) + ": an answer of an absurd size";
    }
    return *ended_ ? std::string(what) + ": " + ended_->message() : "";
}

namespace {

asio::ip::address numeric_address(const std::string& host, ErrorCode& wrong) {
    return asio::ip::make_address(host == "localhost" ? "127.0.0.1" : host, wrong);
}

} // namespace

bool is_numeric_address(const std::string& host) {
    ErrorCode wrong;
    numeric_address(host, wrong);
    return !wrong;
}

std::string WebSocketClient::Work::connect(const std::string& host, std::uint16_t port,
                                           double patience_s) {
    drop();
    ErrorCode wrong;
    const auto address = numeric_address(host, wrong);
    if (wrong) return host + " is no numeric address";
    const Time until = in_seconds(patience_s);
    const auto ends = [this, of = connection_](const ErrorCode& ended) {
        if (of != connection_) return;
        --pending_;
        ended_ = ended;
    };
    ended_.reset();
    stream_.emplace(io_);
    ++pending_;
    stream_->next_layer().async_connect({address, port}, ends);
    std::string failure = step("connecting", until);
    if (failure.empty()) {
        ended_.reset();
        stream_->next_layer().set_option(asio::ip::tcp::no_delay(true), wrong);
        stream_->read_message_max(kLongestMessage);
        stream_->auto_fragment(false);
        stream_->text(true);
        stream_->control_callback(
            [this](beast::websocket::frame_type kind, beast::string_view payload) {
                // A server may send others besides.
                if (kind == beast::websocket::frame_type::pong && is_pinging_ &&
                    payload == std::to_string(pings_))
                    has_pong_ = true;
            });
        ++pending_;
        const std::string name = address.is_v6() ? "[" + host + "]" : host; // RFC 3986, 3.2.2
        stream_->async_handshake(name + ":" + std::to_string(port), "/", ends);
        failure = step("the handshake", until);
    }
    if (!failure.empty()) drop();
    return failure;
}

bool WebSocketClient::Work::send(std::string_view text) {
    if (!stream_ || is_sending_) return false;
    outgoing_ = text;
    is_sending_ = true;
    ++pending_;
    stream_->async_write(asio::buffer(outgoing_),
                         [this, of = connection_](const ErrorCode& ended, std::size_t) {
                             if (of != connection_) return;
                             --pending_;
                             is_sending_ = false;
                             if (ended) fail(ended);
                         });
    return true;
}

bool WebSocketClient::Work::ping() {
    if (!stream_ || is_pinging_) return false;
    is_pinging_ = true;
    ++pending_;
    stream_->async_ping(std::to_string(++pings_).c_str(),
                        [this, of = connection_](const ErrorCode& ended) {
                            if (of != connection_) return;
                            --pending_;
                            if (ended) fail(ended);
                        });
    return true;
}

void WebSocketClient::Work::begin_read() {
    buffer_.clear();
    is_reading_ = true;
    ++pending_;
    stream_->async_read(buffer_, [this, of = connection_](const ErrorCode& ended, std::size_t) {
        if (of != connection_) return;
        --pending_;
        is_reading_ = false;
        has_message_ = !ended;
        if (ended) fail(ended);
    });
}

WebSocketClient::Event WebSocketClient::Work::wait(Time until) {
    if (stream_ && !is_reading_ && failure_.empty()) begin_read();
    pump(until, [&] { return has_message_ || has_pong_ || !failure_.empty(); });
    if (interrupted_.load()) return Event::interrupted;
    if (has_message_) {
        has_message_ = false;
        return Event::message;
    }
    if (has_pong_) {
        has_pong_ = is_pinging_ = false;
        return Event::pong;
    }
    return failure_.empty() ? Event::quiet : Event::closed;
}

void WebSocketClient::Work::close(double patience_s) {
    if (stream_ && failure_.empty()) {
        ended_.reset();
        ++pending_;
        stream_->async_close(beast::websocket::close_code::normal,
                             [this, of = connection_](const ErrorCode& ended) {
                                 if (of != connection_) return;
                                 --pending_;
                                 ended_ = ended;
                             });
        pump(in_seconds(patience_s), [&] { return ended_.has_value(); });
    }
    drop();
}

void WebSocketClient::Work::drop() {
    if (stream_) {
        ErrorCode ignored;
        stream_->next_layer().close(ignored);
        // Each ends at once now, but for one whose operation ended with an exception.
        const Time until = in_seconds(kPatienceToDrop_s);
        while (pending_ > 0 && std::chrono::steady_clock::now() < until)
            io_.run_one_until(until);
        stream_.reset();
    }
    ++connection_;
    pending_ = 0;
    failure_.clear();
    has_message_ = has_pong_ = false;
    is_sending_ = is_pinging_ = is_reading_ = false;
}

WebSocketClient::WebSocketClient() : work_(std::make_unique<Work>()) {}
WebSocketClient::~WebSocketClient() { drop(); }

std::string WebSocketClient::connect(const std::string& host, std::uint16_t port,
                                     double patience_s) {
    return work_->connect(host, port, patience_s);
}
bool WebSocketClient::is_open() const noexcept { return work_->stream_.has_value(); }
bool WebSocketClient::ping() { return work_->ping(); }
bool WebSocketClient::send(std::string_view text) { return work_->send(text); }
bool WebSocketClient::is_sending() const noexcept { return work_->is_sending_; }
WebSocketClient::Event WebSocketClient::wait(Time until) { return work_->wait(until); }

std::string_view WebSocketClient::message() const noexcept {
    return {static_cast<const char*>(work_->buffer_.data().data()), work_->buffer_.size()};
}

bool WebSocketClient::is_text() const noexcept {
    return work_->stream_ && work_->stream_->got_text();
}

const std::string& WebSocketClient::failure() const noexcept { return work_->failure_; }

void WebSocketClient::close(double patience_s) noexcept {
    try {
        work_->close(patience_s);
    } catch (const std::exception&) {
        drop();
    }
}

void WebSocketClient::drop() noexcept {
    try {
        work_->drop();
    } catch (const std::exception&) {
        work_->stream_.reset(); // with nothing left to run: the context still has the handlers
    }
}

void WebSocketClient::interrupt() noexcept {
    try {
        work_->interrupt();
    } catch (const std::exception&) {
        // Out of memory: the wait ends by its time.
    }
}

void WebSocketClient::resume() noexcept { work_->interrupted_.store(false); }

} // namespace palpate::internal
