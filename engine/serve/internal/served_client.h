// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/ip/tcp.hpp>

#include <palpate/drivers/igtl_message.h>
#include <palpate/drivers/igtl_reader.h>
#include <palpate/engine/serve/igtl_server.h>

namespace palpate::internal {

/// Bytes for clients, which share them.
using ServedBytes = std::shared_ptr<const IgtlBytes>;

class ServedClient;

/// What a client needs of its server. All in the server's thread.
class ServedHost {
public:
    virtual ~ServedHost() = default;
    virtual const IgtlServerSettings& settings() const = 0; ///< its own
    /// How many batches there were: 0 before the first frame.
    virtual std::uint64_t newest() const = 0;
    virtual ServedBytes batch(IgtlVersion version) = 0; ///< the newest one, all transforms
    /// The newest transforms of that name, of all where it is empty; null: there are none.
    virtual ServedBytes transforms(IgtlVersion version, const std::string& name) = 0;
    /// The same of surfaces, a message each.
    virtual std::vector<ServedBytes> surfaces(IgtlVersion version, const std::string& name) = 0;
    virtual void given(const std::string& name,
                       const IgtlTransform& transform) = 0;                       ///< by a client
    virtual void remove(const std::shared_ptr<ServedClient>& client) = 0;         ///< it is closed
    virtual void count(const std::function<void(IgtlServerCounts&)>& change) = 0; ///< what happened
};

/// One connection of a client. All in the server's thread.
class ServedClient : public std::enable_shared_from_this<ServedClient> {
public:
    ServedClient(ServedHost& host, boost::asio::ip::tcp::socket&& socket);

    void begin();
    /// Sixty times a second: the newest transforms, unless something is still under way.
    void tick();
    /// Ends it without waiting for it.
    void leave();

private:
    using Error = boost::system::error_code;

    void read();
    void has_read(Error error, std::size_t count);
    void obey(const IgtlMessage& message);
    void answer_query(const IgtlMessage& query);
    void greet(IgtlVersion version);
    void say(const std::string& type, const std::string& device, IgtlBytes content);
    void queue(ServedBytes bytes);
    void next();
    void write(ServedBytes bytes);
    void write_piece();
    void drop();

    ServedHost& host_;
    boost::asio::ip::tcp::socket socket_;
    std::array<std::uint8_t, 16384> in_{};
    IgtlReader reader_;
    IgtlVersion version_ = IgtlVersion::one; ///< that it spoke last
    bool is_greeted_ = false;
    bool is_open_ = true;
    std::size_t faulty_ = 0;

    std::deque<ServedBytes> queued_; ///< behind what is under way
    ServedBytes under_way_;          ///< null: nothing is
    std::size_t written_ = 0;        ///< bytes of it
    std::uint64_t sent_ = 0;         ///< batch
    bool was_batch_ = false;         ///< what was under way last
    std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point began_; ///< the piece that is under way
};

} // namespace palpate::internal
