// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <palpate/drivers/igtl_message.h>
#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/serve/served_scene.h>

namespace palpate {

/// Where a server of OpenIGTLink is, and how patient it is.
struct IgtlServerSettings {
    std::string address = "127.0.0.1";   ///< of this computer, in digits; 127.0.0.1: nobody else
                                         ///< reaches it
    std::uint16_t port = kIgtlUsualPort; ///< 0: any that is free
    std::string words;                   ///< of the STATUS that clients get
    std::size_t most_clients = 8;        ///< at a time; others are refused
    double taking_s = 10.0;              ///< a client that takes nothing for so long is dropped, s
    double hesitation_s = 0.25; ///< a client that says nothing for so long after it has connected
                                ///< speaks version one, s
};

/// What the server did, since it began.
struct IgtlServerCounts {
    std::uint64_t connections = 0; ///< accepted
    std::uint64_t refused = 0;     ///< too many at a time
    std::uint64_t dropped = 0;     ///< that did not read, or sent what is no OpenIGTLink
    std::uint64_t messages = 0;    ///< that were understood
    std::uint64_t faulty = 0;      ///< messages with a wrong checksum or wrong sizes
    std::uint64_t left_out = 0;    ///< messages of types that nobody here reads
    std::size_t open = 0;          ///< clients now
};

/// Sends surfaces and frames to clients of OpenIGTLink, in a thread of its own, at most sixty times
/// a second. Each client is answered in the version that it speaks. What is not taken is not waited
/// for: each client has at most one batch of transforms under way, the newest, and one that takes
/// nothing for IgtlServerSettings::taking_s is dropped.
class IgtlServer {
public:
    static constexpr double kMostRate_hz = 60.0; ///< batches of transforms a second

    /// Is told in the server's thread of each TRANSFORM that a client sends, by its name.
    using Sink = std::function<void(const std::string& name, const IgtlTransform& transform)>;

    /// Listens from here on. `sink` may be empty.                                        [setup]
    /// Throws std::runtime_error "port 18944: ...; what to do" where it cannot.
    IgtlServer(const IgtlServerSettings& settings, const std::vector<ServedSurface>& surfaces,
               Sink sink);
    /// Every connection is closed.
    ~IgtlServer();
    IgtlServer(const IgtlServer&) = delete;
    IgtlServer& operator=(const IgtlServer&) = delete;

    std::uint16_t port() const noexcept; ///< that it listens on                          [any]

    /// The newest frame: copied under a lock that is held for as long as that takes. Not for the
    /// loop's thread, but for the one that records.                                      [setup]
    void show(const RunFrame& run);

    IgtlServerCounts counts() const; ///< [setup]

private:
    class Server;
    std::unique_ptr<Server> server_;
};

} // namespace palpate
