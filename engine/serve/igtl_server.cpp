// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/serve/igtl_server.h>

#include <array>
#include <chrono>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include <palpate/engine/serve/internal/served_client.h>
#include <palpate/engine/view/internal/listening.h>

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using internal::ServedBytes;
using internal::ServedClient;

// Between two batches, rounded up.
constexpr std::chrono::microseconds kTick{1 + static_cast<int>(1e6 / IgtlServer::kMostRate_hz)};

double clock_s() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

/// 0 or 1, for what there is of each.
std::size_t place_of(IgtlVersion version) { return version == IgtlVersion::one ? 0 : 1; }

} // namespace

/// All that runs in the server's thread, but what is said otherwise.
class IgtlServer::Server final : public internal::ServedHost {
public:
    Server(const IgtlServerSettings& settings, const std::vector<ServedSurface>& surfaces,
           Sink sink)
        : settings_(settings), sink_(std::move(sink)) {
        for (const ServedSurface& surface : surfaces) {
            names_.push_back(surface.name);
            for (const IgtlVersion version : {IgtlVersion::one, IgtlVersion::two})
                surfaces_[place_of(version)].push_back(std::make_shared<const IgtlBytes>(
                    igtl_bytes(poly_data_of(surface, version, clock_s()))));
        }
        listen();
        accept();
        tick();
        thread_ = std::thread([this] { io_.run(); });
    }
    ~Server() override {
        io_.stop();
        thread_.join();
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    // From any thread.
    std::uint16_t port() const noexcept { return port_; }
    void show(const RunFrame& run) {
        const ServedFrame frame = served_frame(run, clock_s());
        const std::lock_guard lock(shown_mutex_);
        shown_ = frame;
    }
    IgtlServerCounts counts() const {
        const std::lock_guard lock(counts_mutex_);
        return counts_;
    }

private:
    const IgtlServerSettings& settings() const override { return settings_; }
    std::uint64_t newest() const override { return newest_; }
    ServedBytes batch(IgtlVersion version) override;
    ServedBytes transforms(IgtlVersion version, const std::string& name) override;
    std::vector<ServedBytes> surfaces(IgtlVersion version, const std::string& name) override;
    void given(const std::string& name, const IgtlTransform& transform) override {
        if (sink_) sink_(name, transform);
    }
    void remove(const std::shared_ptr<ServedClient>& client) override {
        if (clients_.erase(client) > 0) count([](IgtlServerCounts& counts) { --counts.open; });
    }
    void count(const std::function<void(IgtlServerCounts&)>& change) override {
        const std::lock_guard lock(counts_mutex_);
        change(counts_);
    }

    void listen();
    void accept();
    void welcome(tcp::socket socket);
    void tick();
    void take_frame();

    const IgtlServerSettings settings_;
    const Sink sink_;
    std::vector<std::string> names_;                   ///< of the surfaces
    std::array<std::vector<ServedBytes>, 2> surfaces_; ///< by version, in the order of names_
    std::uint16_t port_ = 0;

    std::mutex shown_mutex_;
    std::optional<ServedFrame> shown_; ///< under it: a frame that was not taken

    std::optional<ServedFrame> frame_; ///< that clients are sent
    std::uint64_t newest_ = 0;         ///< how many there were
    std::array<ServedBytes, 2> batch_; ///< of it, by version; null: not made yet

    mutable std::mutex counts_mutex_;
    IgtlServerCounts counts_;

    asio::io_context io_{1};
    tcp::acceptor acceptor_{io_};
    asio::steady_timer timer_{io_};
    asio::steady_timer retry_{io_};
    std::set<std::shared_ptr<ServedClient>> clients_; // before io_ goes
    std::thread thread_;                              // last: it uses all of the above
};

ServedBytes IgtlServer::Server::transforms(IgtlVersion version, const std::string& name) {
    if (!frame_) return nullptr;
    IgtlBytes bytes;
    for (const IgtlMessage& message : transforms_of(*frame_, version)) {
        if (!name.empty() && message.device != name) continue;
        const IgtlBytes one = igtl_bytes(message);
        bytes.insert(bytes.end(), one.begin(), one.end());
    }
    return bytes.empty() ? nullptr : std::make_shared<const IgtlBytes>(std::move(bytes));
}

ServedBytes IgtlServer::Server::batch(IgtlVersion version) {
    ServedBytes& made = batch_[place_of(version)];
    if (!made) made = transforms(version, "");
    return made;
}

std::vector<ServedBytes> IgtlServer::Server::surfaces(IgtlVersion version,
                                                      const std::string& name) {
    std::vector<ServedBytes> found;
    for (std::size_t i = 0; i < names_.size(); ++i)
        if (name.empty() || names_[i] == name) found.push_back(surfaces_[place_of(version)][i]);
    return found;
}

void IgtlServer::Server::listen() {
    port_ = internal::listen_at(acceptor_, settings_.address, settings_.port,
                                "give another one, or 0 to get a free one");
}

void IgtlServer::Server::accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
        if (error == asio::error::operation_aborted) return;
        if (error) { // no file descriptor is left, as a rule
            retry_.expires_after(std::chrono::milliseconds(100));
            return retry_.async_wait([this](error_code) { accept(); });
        }
        welcome(std::move(socket));
        accept();
    });
}

void IgtlServer::Server::welcome(tcp::socket socket) {
    if (clients_.size() >= settings_.most_clients)
        return count([](IgtlServerCounts& counts) { ++counts.refused; }); // which closes it
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto client = std::make_shared<ServedClient>(*this, std::move(socket));
    clients_.insert(client);
    count([](IgtlServerCounts& counts) {
        ++counts.connections;
        ++counts.open;
    });
    client->begin();
}

void IgtlServer::Server::take_frame() {
    std::optional<ServedFrame> shown;
    {
        const std::lock_guard lock(shown_mutex_);
        shown = std::exchange(shown_, std::nullopt);
    }
    if (!shown) return;
    if (frame_) shown->velocity = velocity_between(*frame_, *shown);
    frame_ = shown;
    batch_ = {};
    ++newest_;
}

void IgtlServer::Server::tick() {
    timer_.expires_after(kTick);
    timer_.async_wait([this](error_code error) {
        if (error) return;
        take_frame();
        const std::vector<std::shared_ptr<ServedClient>> clients(clients_.begin(), clients_.end());
        for (const std::shared_ptr<ServedClient>& client : clients)
            client->tick();
        tick();
    });
}

IgtlServer::IgtlServer(const IgtlServerSettings& settings,
                       const std::vector<ServedSurface>& surfaces, Sink sink)
    : server_(std::make_unique<Server>(settings, surfaces, std::move(sink))) {}

IgtlServer::~IgtlServer() = default;

std::uint16_t IgtlServer::port() const noexcept { return server_->port(); }

void IgtlServer::show(const RunFrame& run) { server_->show(run); }

IgtlServerCounts IgtlServer::counts() const { return server_->counts(); }

} // namespace palpate
