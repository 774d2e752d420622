// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/igtl_device.h>

#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <stdexcept>
#include <thread>
#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include <palpate/drivers/igtl_reader.h>

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

std::chrono::nanoseconds duration_of(double seconds) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(seconds));
}

/// A computer that is gone without a word is noticed within 5 s, and not after the two hours of
/// the system: nothing is ever sent to it that could fail.
void notice_silent_ends(int socket) noexcept {
    constexpr std::pair<int, int> kLooks[] = {
        {TCP_KEEPIDLE, 2}, {TCP_KEEPINTVL, 1}, {TCP_KEEPCNT, 3}}; // s, s, times
    for (const auto& [option, value] : kLooks)
        ::setsockopt(socket, IPPROTO_TCP, option, &value, sizeof value);
}

std::uint16_t port_of(std::string_view text) {
    std::uint16_t port = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    return error == std::errc() && end == text.data() + text.size() ? port : 0;
}

} // namespace

IgtlAddress igtl_address(const std::string& text) {
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument("igtl:" + text + ": " + what +
                                    "; write igtl:TRANSFORM@HOST:PORT, as "
                                    "igtl:StylusToReference@127.0.0.1:18944");
    };
    IgtlAddress address;
    const std::size_t at = text.rfind('@');
    address.transform = text.substr(0, at);
    if (address.transform.empty() || address.transform.size() > kIgtlLongestName)
        fail("the name of the TRANSFORM has 1 to 20 bytes");
    if (at == std::string::npos) return address;
    std::string server = text.substr(at + 1);
    // A colon within [..], or one of several, is of an address of IPv6.
    const std::size_t colon = server.rfind(':');
    const bool has_port = colon != std::string::npos &&
                          (server.find(':') == colon || (colon > 0 && server[colon - 1] == ']'));
    if (has_port) {
        address.port = port_of(std::string_view(server).substr(colon + 1));
        if (address.port == 0) fail("a port is a number from 1 to 65535");
        server.resize(colon);
    }
    if (server.size() > 2 && server.front() == '[' && server.back() == ']')
        server = server.substr(1, server.size() - 2);
    if (server.empty()) fail("names no host");
    address.host = std::move(server);
    return address;
}

/// Who waits for a name to be looked up. A name server may not answer for minutes, and the system's
/// call cannot be broken off: its thread is nobody's, and what it finds is for who is still there.
class Lookup {
public:
    using Found = std::function<void(error_code, const tcp::resolver::results_type&)>;

    /// Lets a thread look it up; `found` is called in `io`'s thread, unless leave() was called.
    static void begin(const std::shared_ptr<Lookup>& waits, asio::io_context& io,
                      const std::string& host, std::uint16_t port, Found found) {
        {
            const std::lock_guard lock(waits->mutex_);
            waits->io_ = &io;
        }
        std::thread([waits, host, port, found = std::move(found)] {
            asio::io_context own;
            error_code error;
            const auto result = tcp::resolver(own).resolve(host, std::to_string(port), error);
            const std::lock_guard lock(waits->mutex_);
            if (waits->io_ == nullptr) return;
            asio::post(*waits->io_, [found, error, result] { found(error, result); });
        }).detach();
    }
    void leave() {
        const std::lock_guard lock(mutex_);
        io_ = nullptr;
    }

private:
    std::mutex mutex_;
    asio::io_context* io_ = nullptr;
};

/// A connection that is looked for again and again. All but what is said otherwise is its thread's.
class IgtlDevice::Client {
public:
    Client(IgtlAddress address, const Patience& patience, TransformDevice& tool)
        : address_(std::move(address)), patience_(patience), tool_(tool) {}
    ~Client() {
        io_.stop();
        if (thread_.joinable()) thread_.join(); // which may have begun to look up anew
        lookup_->leave();
    }
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    void begin();
    /// Whether a server is there now.                                                      [any]
    bool is_connected() const noexcept { return is_there_.load(); }

private:
    void connect();
    void try_again(const std::string& why);
    void read();
    void understand(std::size_t count);
    void tell(bool is_connected, const std::string& why);

    const IgtlAddress address_;
    const Patience patience_;
    TransformDevice& tool_;

    asio::io_context io_{1};
    asio::executor_work_guard<asio::io_context::executor_type> stays_{io_.get_executor()};
    const std::shared_ptr<Lookup> lookup_ = std::make_shared<Lookup>();
    tcp::socket socket_{io_};
    asio::steady_timer timer_{io_};
    std::array<std::uint8_t, 16384> bytes_{};
    IgtlReader reader_;
    std::atomic<bool> is_there_{false};

    std::mutex mutex_; ///< of what follows
    std::condition_variable told_;
    bool is_told_ = false;
    bool is_connected_ = false;
    std::string why_;

    std::thread thread_; ///< last: it uses all of the above
};

/// Begins, and waits for the first connection. In the thread that opens the device.
void IgtlDevice::Client::begin() {
    connect();
    thread_ = std::thread([this] { io_.run(); });
    std::unique_lock lock(mutex_);
    told_.wait_for(lock, duration_of(patience_.connect_s), [this] { return is_told_; });
    if (is_connected_) return;
    throw std::runtime_error(
        "igtl:" + address_.transform + "@" + address_.host + ":" + std::to_string(address_.port) +
        ": no server of OpenIGTLink answers (" + (why_.empty() ? "it takes too long" : why_) +
        "); start it, in 3D Slicer a connector of type server that is active, or name another one");
}

void IgtlDevice::Client::tell(bool is_connected, const std::string& why) {
    {
        const std::lock_guard lock(mutex_);
        if (is_told_) return;
        is_told_ = true;
        is_connected_ = is_connected;
        why_ = why;
    }
    told_.notify_all();
}

void IgtlDevice::Client::connect() {
    Lookup::begin(lookup_, io_, address_.host, address_.port,
                  [this](error_code error, const tcp::resolver::results_type& found) {
                      if (error) return try_again(error.message());
                      asio::async_connect(
                          socket_, found, [this](error_code failure, const tcp::endpoint&) {
                              if (failure) return try_again(failure.message());
                              error_code ignored;
                              socket_.set_option(asio::socket_base::keep_alive(true), ignored);
                              notice_silent_ends(socket_.native_handle());
                              reader_ = IgtlReader();
                              is_there_ = true;
                              tell(true, "");
                              read();
                          });
                  });
}

void IgtlDevice::Client::try_again(const std::string& why) {
    is_there_ = false;
    tell(false, why);
    error_code ignored;
    socket_.close(ignored);
    timer_.expires_after(duration_of(patience_.reconnect_s));
    timer_.async_wait([this](error_code error) {
        if (!error) connect();
    });
}

void IgtlDevice::Client::read() {
    socket_.async_read_some(asio::buffer(bytes_), [this](error_code error, std::size_t count) {
        if (error) return try_again(error.message());
        understand(count);
    });
}

void IgtlDevice::Client::understand(std::size_t count) {
    std::span<const std::uint8_t> bytes(bytes_.data(), count);
    for (;;) {
        const IgtlReader::Found found = reader_.take(bytes);
        if (found == IgtlReader::Found::broken) return try_again("it speaks no OpenIGTLink");
        if (found == IgtlReader::Found::nothing) return read();
        if (found != IgtlReader::Found::message) continue;
        const IgtlMessage& message = reader_.message();
        if (message.type != "TRANSFORM" || message.device != address_.transform) continue;
        if (const auto transform = read_igtl_transform(message.content)) tool_.give(*transform);
    }
}

IgtlDevice::IgtlDevice(const IgtlAddress& address, const Patience& patience)
    : address_(address), patience_(patience), tool_(address.transform) {}

IgtlDevice::~IgtlDevice() = default;

DeviceProperties IgtlDevice::properties() const { return tool_.properties(); }

void IgtlDevice::open() {
    client_ = std::make_unique<Client>(address_, patience_, tool_);
    client_->begin();
}

void IgtlDevice::close() noexcept {
    if (client_) is_gone_ = !client_->is_connected();
    client_.reset();
}

bool IgtlDevice::read(DeviceState& state) noexcept { return tool_.read(state); }

std::string IgtlDevice::complaint() const {
    if (is_gone_)
        return "the server of OpenIGTLink at " + address_.host + " port " +
               std::to_string(address_.port) + " went away; start it again, or look at the network";
    return tool_.complaint();
}

bool IgtlDevice::has_failed() const { return is_gone_ || tool_.counts().used == 0; }

} // namespace palpate
