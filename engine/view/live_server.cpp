// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/live_server.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/view/internal/frame_history.h>
#include <palpate/engine/view/internal/live_answer.h>
#include <palpate/engine/view/view_document.h>

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::steady_clock;

constexpr std::chrono::microseconds kTick{16'667}; // between two batches
constexpr std::chrono::seconds kRequest{10};       // for a request to come, and its answer to go
constexpr std::chrono::seconds kSilence{30};       // that does not answer a ping either
constexpr double kHistory_s = 4.0; // of frames: a page that stands still for so long loses
                                   // none
constexpr std::size_t kMostConnections = 64; // requests that are under way included
constexpr std::size_t kMostErrors = 100;     // then a page is no page of ours
constexpr std::size_t kMostCommands = 64;    // of one page in a tick; more wait for the next one
constexpr std::size_t kMostWaiting = 32;     // messages besides frames that a page has not taken
constexpr std::size_t kPiece = 65'536;       // bytes of a message that are sent at a time
constexpr std::uint32_t kHeader = 8192;      // bytes of a request

using internal::LiveRequest;
using Message = std::shared_ptr<const std::string>;

std::string message_of(std::string_view said, bool is_error, const nlohmann::json& state) {
    const nlohmann::json message = {
        {"say", said}, {"kind", is_error ? "error" : "info"}, {"state", state}};
    return message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

} // namespace

/// All that runs in the server's thread, but what is said otherwise.
class LiveServer::Server {
public:
    Server(const LiveServerSettings& settings, std::string page, Message scene, Answer answer)
        : settings_(settings),
          token_(settings.token.empty() ? internal::random_token() : settings.token),
          page_(std::make_shared<const std::string>(std::move(page))), scene_(std::move(scene)),
          answer_(std::move(answer)),
          feed_(static_cast<std::size_t>(kHistory_s * settings.rate_hz) + 1),
          history_(static_cast<std::size_t>(kHistory_s * settings.rate_hz) + 1) {
        listen();
        accept();
        tick();
        thread_ = std::thread([this] { io_.run(); });
    }
    ~Server() {
        io_.stop();
        thread_.join();
        worker_.stop();
        worker_.join();
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    // From any thread.
    std::uint16_t port() const noexcept { return port_; }
    const std::string& token() const noexcept { return token_; }
    const LiveServerSettings& settings() const noexcept { return settings_; }
    void add(const FrameReport& frame) { feed_.add(frame); }
    void tell(std::string_view said, bool is_error, const std::string& state) {
        nlohmann::json parsed = nlohmann::json::parse(state, nullptr, false);
        if (!parsed.is_object())
            throw std::invalid_argument("the state of a live page is no JSON object; give one");
        asio::post(io_, [this, words = std::string(said), is_error, now = std::move(parsed)] {
            state_ = now;
            send_all(message_of(words, is_error, state_));
        });
    }
    LiveCounts counts() const {
        const std::lock_guard lock(counts_mutex_);
        return counts_;
    }

private:
    class Connection;
    class Page;

    void listen();
    void accept();
    void tick();
    void send_all(const std::string& message);

    template <class Change>
    void count(const Change& change) {
        const std::lock_guard lock(counts_mutex_);
        change(counts_);
    }

    const LiveServerSettings settings_;
    const std::chrono::duration<double> taking_{settings_.taking_s};
    const std::string token_;
    const Message page_;
    const Message scene_;
    const Answer answer_;
    std::uint16_t port_ = 0;
    internal::FrameFeed feed_;
    internal::FrameHistory history_;
    std::vector<FrameReport> taken_;
    nlohmann::json state_ = nlohmann::json::object();
    mutable std::mutex counts_mutex_;
    LiveCounts counts_;
    std::size_t connections_ = 0;

    asio::io_context io_{1};
    tcp::acceptor acceptor_{io_};
    asio::steady_timer timer_{io_};
    asio::steady_timer retry_{io_};
    std::set<std::shared_ptr<Page>> pages_; // before io_ goes
    asio::thread_pool worker_{1};
    std::thread thread_; // last: it uses all of the above
};

/// A browser's socket.
class LiveServer::Server::Page : public std::enable_shared_from_this<Page> {
public:
    Page(Server& server, tcp::socket&& socket) : server_(server), socket_(std::move(socket)) {
        ++server_.connections_;
    }
    ~Page() { --server_.connections_; }
    Page(const Page&) = delete;
    Page& operator=(const Page&) = delete;

    void begin(const LiveRequest& request) {
        websocket::stream_base::timeout timeout{};
        timeout.handshake_timeout = kRequest;
        timeout.idle_timeout = kSilence;
        timeout.keep_alive_pings = true;
        socket_.set_option(timeout);
        socket_.read_message_max(kLongestCommand);
        // Of the kernel's room for what is not taken: enough for a second of frames.
        error_code ignored;
        constexpr int kRoom = 256 * 1024; // bytes
        beast::get_lowest_layer(socket_).socket().set_option(
            asio::socket_base::send_buffer_size(kRoom), ignored);
        socket_.async_accept(request, [self = shared_from_this()](error_code error) {
            if (!error) self->accepted();
        });
    }

    /// Frames that it has not been sent, unless the last ones are still under way.
    void tick() {
        if (is_writing_ && steady_clock::now() - began_ > server_.taking_) return drop();
        commands_ = 0;
        if (is_paused_) {
            is_paused_ = false;
            read();
        }
        const internal::FrameHistory& history = server_.history_;
        if (is_writing_ || !texts_.empty() || next_ == history.end()) return;
        const std::uint64_t from = std::max(next_, history.first());
        const std::vector<FrameReport> frames = history.from(from);
        const ViewFrames batch{frames, from, from - next_};
        next_ = history.end();
        write(std::make_shared<const std::string>(frames_message(batch)), Kind::binary);
    }

    void send(Message message, bool is_text) {
        const Kind kind = is_text ? Kind::text : Kind::binary;
        if (texts_.size() >= kMostWaiting) return drop();
        if (is_writing_)
            texts_.emplace_back(std::move(message), kind);
        else
            write(std::move(message), kind);
    }

private:
    enum class Kind : std::uint8_t { text, binary };

    void accepted() {
        if (server_.pages_.size() >= server_.settings_.most_pages) {
            server_.count([](LiveCounts& counts) { ++counts.refused; });
            return say_full();
        }
        server_.pages_.insert(shared_from_this());
        server_.count([](LiveCounts& counts) {
            ++counts.pages;
            ++counts.open;
        });
        next_ = server_.history_.end();
        send(server_.scene_, false);
        say("", false);
        read();
    }

    /// A browser shows a socket's reason, and not the words of a refused request.
    void say_full() {
        is_open_ = false;
        socket_.async_close({websocket::close_code::try_again_later, "too many pages are open"},
                            [self = shared_from_this()](error_code) {});
    }

    void read() {
        socket_.async_read(in_, [self = shared_from_this()](error_code error, std::size_t) {
            self->has_read(error);
        });
    }

    void has_read(error_code error) {
        if (error == websocket::error::message_too_big ||
            error == websocket::error::buffer_overflow)
            return drop();
        if (error) return leave();
        obey();
        in_.consume(in_.size());
        if (!is_open_) return;
        if (++commands_ < kMostCommands)
            read();
        else
            is_paused_ = true; // until the next tick
    }

    void obey() {
        LiveReply reply;
        try {
            if (!socket_.got_text())
                throw std::invalid_argument("a binary message is no command; send JSON as text");
            const auto bytes = in_.cdata();
            reply = server_.answer_(parse_view_command(
                std::string_view(static_cast<const char*>(bytes.data()), bytes.size())));
        } catch (const std::exception& error) {
            reply = {error.what(), true};
        }
        if (reply.is_error) {
            server_.count([](LiveCounts& counts) { ++counts.errors; });
            if (++errors_ >= kMostErrors) return drop();
        }
        if (reply.later) {
            if (is_making_)
                reply.said = "one mesh after the other: wait for the one that is being made";
            else
                make(std::move(reply.later));
        }
        if (!reply.said.empty()) say(reply.said, reply.is_error);
    }

    /// What takes longer, in the other thread, and sends it.
    void make(std::function<Message()> later) {
        is_making_ = true;
        asio::post(
            server_.worker_, [self = shared_from_this(), later = std::move(later)]() mutable {
                Message made;
                std::string why;
                try {
                    made = later();
                } catch (const std::exception& error) {
                    why = error.what();
                }
                Server& server = self->server_;
                asio::post(server.io_, [self = std::move(self), made = std::move(made),
                                        why = std::move(why)] { self->has_made(made, why); });
            });
    }

    void has_made(const Message& made, const std::string& why) {
        is_making_ = false;
        if (!is_open_) return;
        if (made)
            send(made, false);
        else
            say(why, true);
    }

    void say(const std::string& words, bool is_error) {
        send(std::make_shared<const std::string>(message_of(words, is_error, server_.state_)),
             true);
    }

    void write(Message message, Kind kind) {
        is_writing_ = true;
        under_way_ = std::move(message);
        written_ = 0;
        socket_.text(kind == Kind::text);
        write_piece();
    }

    /// Piece by piece: a large message that goes through a slow tunnel is being taken.
    void write_piece() {
        began_ = steady_clock::now();
        const std::size_t size = std::min(kPiece, under_way_->size() - written_);
        const bool is_last = written_ + size == under_way_->size();
        const auto piece = asio::buffer(under_way_->data() + written_, size);
        written_ += size;
        socket_.async_write_some(
            is_last, piece, [self = shared_from_this(), is_last](error_code error, std::size_t) {
                self->has_written(error, is_last);
            });
    }

    void has_written(error_code error, bool is_last) {
        if (error) return leave();
        if (!is_open_) return;
        if (!is_last) return write_piece();
        is_writing_ = false;
        under_way_.reset();
        if (texts_.empty()) return;
        auto [message, kind] = std::move(texts_.front());
        texts_.pop_front();
        write(std::move(message), kind);
    }

    /// Ends what does not behave as a page, without waiting for it.
    void drop() {
        if (is_open_) server_.count([](LiveCounts& counts) { ++counts.dropped; });
        leave();
    }

    void leave() {
        if (!std::exchange(is_open_, false)) return;
        beast::get_lowest_layer(socket_).close();
        if (server_.pages_.erase(shared_from_this()) > 0)
            server_.count([](LiveCounts& counts) { --counts.open; });
    }

    Server& server_;
    websocket::stream<beast::tcp_stream> socket_;
    beast::flat_buffer in_{2 * kLongestCommand};
    Message under_way_;
    std::size_t written_ = 0;                    // bytes of it
    std::deque<std::pair<Message, Kind>> texts_; // behind what is under way
    steady_clock::time_point began_;
    std::uint64_t next_ = 0; // frame
    std::size_t commands_ = 0;
    std::size_t errors_ = 0;
    bool is_writing_ = false;
    bool is_paused_ = false;
    bool is_making_ = false;
    bool is_open_ = true;
};

/// One request and its answer, or a socket from it.
class LiveServer::Server::Connection : public std::enable_shared_from_this<Connection> {
public:
    Connection(Server& server, tcp::socket&& socket) : server_(server), stream_(std::move(socket)) {
        ++server_.connections_;
        parser_.header_limit(kHeader);
        parser_.body_limit(0);
    }
    ~Connection() { --server_.connections_; }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void begin() {
        stream_.expires_after(kRequest);
        http::async_read(stream_, buffer_, parser_,
                         [self = shared_from_this()](error_code error, std::size_t) {
                             if (!error) self->answer();
                         });
    }

private:
    void answer() {
        const LiveRequest& request = parser_.get();
        internal::LiveAnswer answer = internal::live_answer(
            request, server_.token_, server_.settings_.address, *server_.page_);
        if (answer.is_socket) {
            stream_.expires_never();
            return std::make_shared<Page>(server_, stream_.release_socket())->begin(request);
        }
        response_ = std::move(answer.response);
        if (response_.result() != http::status::ok)
            server_.count([](LiveCounts& counts) { ++counts.refused; });
        http::async_write(stream_, response_, [self = shared_from_this()](error_code, std::size_t) {
            error_code ignored;
            self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
        });
    }

    Server& server_;
    beast::tcp_stream stream_;
    beast::flat_buffer buffer_{std::size_t{2} * kHeader};
    http::request_parser<http::empty_body> parser_;
    internal::LiveResponse response_;
};

void LiveServer::Server::listen() {
    const auto refuse = [this](const std::string& why, const char* remedy) {
        throw std::runtime_error(
            fmt::format("port {} of {}: {}; {}", settings_.port, settings_.address, why, remedy));
    };
    error_code error;
    const auto address = asio::ip::make_address(settings_.address, error);
    if (error) refuse("is no address", "give one in digits, as 127.0.0.1");
    const tcp::endpoint endpoint(address, settings_.port);
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error == asio::error::address_in_use)
        refuse("another program has it", "give another one, or leave it out to get a free one");
    if (error == asio::error::access_denied)
        refuse("is for the system alone", "give one from 1024 on");
    if (error) refuse(error.message(), "give an address of this computer and a free port");
    port_ = acceptor_.local_endpoint().port();
}

void LiveServer::Server::accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
        if (error == asio::error::operation_aborted) return;
        if (error) { // no file descriptor is left, as a rule
            retry_.expires_after(std::chrono::milliseconds(100));
            return retry_.async_wait([this](error_code) { accept(); });
        }
        count([](LiveCounts& counts) { ++counts.connections; });
        if (connections_ < kMostConnections) {
            error_code ignored;
            socket.set_option(tcp::no_delay(true), ignored);
            std::make_shared<Connection>(*this, std::move(socket))->begin();
        } else {
            count([](LiveCounts& counts) { ++counts.refused; });
        }
        accept();
    });
}

void LiveServer::Server::tick() {
    timer_.expires_after(kTick);
    timer_.async_wait([this](error_code error) {
        if (error) return;
        const std::uint64_t first = feed_.take(taken_);
        history_.add(first, taken_);
        const std::vector<std::shared_ptr<Page>> pages(pages_.begin(), pages_.end());
        for (const std::shared_ptr<Page>& page : pages)
            page->tick();
        tick();
    });
}

void LiveServer::Server::send_all(const std::string& message) {
    const auto shared = std::make_shared<const std::string>(message);
    const std::vector<std::shared_ptr<Page>> pages(pages_.begin(), pages_.end());
    for (const std::shared_ptr<Page>& page : pages)
        page->send(shared, true);
}

LiveServer::LiveServer(const LiveServerSettings& settings, std::string page,
                       std::shared_ptr<const std::string> scene, Answer answer)
    : server_(std::make_unique<Server>(settings, std::move(page), std::move(scene),
                                       std::move(answer))) {}

LiveServer::~LiveServer() = default;

std::uint16_t LiveServer::port() const noexcept { return server_->port(); }

const std::string& LiveServer::token() const noexcept { return server_->token(); }

std::string LiveServer::link() const {
    const std::string& address = server_->settings().address;
    const bool is_six = address.find(':') != std::string::npos;
    return fmt::format("http://{}:{}/{}/", is_six ? "[" + address + "]" : address, port(), token());
}

void LiveServer::add(const FrameReport& frame) { server_->add(frame); }

void LiveServer::tell(std::string_view said, bool is_error, const std::string& state) {
    server_->tell(said, is_error, state);
}

LiveCounts LiveServer::counts() const { return server_->counts(); }

} // namespace palpate
