// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/live_server.h>

#include <algorithm>
#include <chrono>
#include <mutex>
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
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/view/internal/frame_history.h>
#include <palpate/engine/view/internal/listening.h>
#include <palpate/engine/view/internal/live_answer.h>
#include <palpate/engine/view/internal/live_page.h>

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::microseconds kTick{16'667}; // between two batches
constexpr double kHistory_s = 4.0; // of frames: a page that stands still for so long loses
                                   // none
constexpr std::size_t kMostConnections = 64; // requests that are under way included
constexpr std::uint32_t kHeader = 8192;      // bytes of a request

using internal::LiveMessage;
using internal::LivePage;
using internal::LiveRequest;

} // namespace

/// All that runs in the server's thread, but what is said otherwise.
class LiveServer::Server final : public internal::LiveHost {
public:
    Server(const LiveServerSettings& settings, std::string page, LiveMessage scene, Answer answer)
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
    ~Server() override {
        io_.stop();
        thread_.join();
        for (const std::shared_ptr<LivePage>& page : pages_)
            page->end_work();
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
            has_new_state_ = words.empty();
            if (!has_new_state_) send_all(internal::live_words(words, is_error, state_));
        });
    }
    LiveCounts counts() const {
        const std::lock_guard lock(counts_mutex_);
        return counts_;
    }

private:
    class Connection;

    asio::io_context& io() override { return io_; }
    asio::thread_pool& worker() override { return worker_; }
    const internal::FrameHistory& history() const override { return history_; }
    const nlohmann::json& state() const override { return state_; }
    const LiveMessage& scene() const override { return scene_; }
    std::chrono::duration<double> taking() const override { return taking_; }
    std::size_t& connections() override { return connections_; }
    std::size_t& button_holders() override { return button_holders_; }
    LiveReply answer(const ViewCommand& command) override { return answer_(command); }
    bool add(const std::shared_ptr<LivePage>& page) override;
    void remove(const std::shared_ptr<LivePage>& page) override;
    void count_error() override {
        count([](LiveCounts& counts) { ++counts.errors; });
    }
    void count_dropped() override {
        count([](LiveCounts& counts) { ++counts.dropped; });
    }

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
    const LiveMessage page_;
    const LiveMessage scene_;
    const Answer answer_;
    std::uint16_t port_ = 0;
    internal::FrameFeed feed_;
    internal::FrameHistory history_;
    std::vector<FrameReport> taken_;
    nlohmann::json state_ = nlohmann::json::object();
    bool has_new_state_ = false; ///< that pages have not been told
    mutable std::mutex counts_mutex_;
    LiveCounts counts_;
    std::size_t connections_ = 0;
    std::size_t button_holders_ = 0;

    asio::io_context io_{1};
    tcp::acceptor acceptor_{io_};
    asio::steady_timer timer_{io_};
    asio::steady_timer retry_{io_};
    std::set<std::shared_ptr<LivePage>> pages_; // before io_ goes
    asio::thread_pool worker_{1};
    std::thread thread_; // last: it uses all of the above
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
        stream_.expires_after(internal::kLiveRequest);
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
            return std::make_shared<LivePage>(server_, stream_.release_socket())->begin(request);
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

bool LiveServer::Server::add(const std::shared_ptr<LivePage>& page) {
    if (pages_.size() >= settings_.most_pages) {
        count([](LiveCounts& counts) { ++counts.refused; });
        return false;
    }
    pages_.insert(page);
    count([](LiveCounts& counts) {
        ++counts.pages;
        ++counts.open;
    });
    return true;
}

void LiveServer::Server::remove(const std::shared_ptr<LivePage>& page) {
    if (pages_.erase(page) > 0) count([](LiveCounts& counts) { --counts.open; });
}

void LiveServer::Server::listen() {
    port_ = internal::listen_at(acceptor_, settings_.address, settings_.port,
                                "give another one, or leave it out to get a free one");
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
        // However often it changed: one page's flood of commands is no flood for the others.
        if (std::exchange(has_new_state_, false)) send_all(internal::live_words("", false, state_));
        const std::uint64_t first = feed_.take(taken_);
        history_.add(first, taken_);
        const std::vector<std::shared_ptr<LivePage>> pages(pages_.begin(), pages_.end());
        for (const std::shared_ptr<LivePage>& page : pages)
            page->tick();
        tick();
    });
}

void LiveServer::Server::send_all(const std::string& message) {
    const auto shared = std::make_shared<const std::string>(message);
    const std::vector<std::shared_ptr<LivePage>> pages(pages_.begin(), pages_.end());
    for (const std::shared_ptr<LivePage>& page : pages)
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
