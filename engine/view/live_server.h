// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/view/view_command.h>
#include <palpate/geometry/isosurface.h>

namespace palpate {

/// Where a live page is served, and to whom.
struct LiveServerSettings {
    std::string address = "127.0.0.1"; ///< of this computer, in digits; 127.0.0.1: nobody else
                                       ///< reaches it
    std::uint16_t port = 0;            ///< 0: any that is free
    std::string token = {};            ///< in the link; empty: 128 random bits
    std::size_t most_pages = 8;        ///< that are connected at a time; others are refused
    double rate_hz = 1000.0;           ///< frames a second, for how many are kept
    double taking_s = 10.0;            ///< a page that takes nothing for so long is dropped, s
};

/// What a page is answered.
struct LiveReply {
    /// What becomes of a wish for a container while another one of the same page is being made.
    enum class Turn : std::uint8_t {
        one_by_one, ///< it is refused
        newest      ///< it takes the place of the other one, which is cancelled
    };

    std::string said;      ///< to whoever asked; empty: nothing
    bool is_error = false; ///< it was refused
    /// Makes a container for whoever asked, in another thread; empty: there is none. What it throws
    /// is told to the page. Its progress says false where nobody wants it any more.
    std::function<std::shared_ptr<const std::string>(const Progress&)> later = {};
    Turn turn = Turn::one_by_one; ///< of `later`
};

/// What the server did, since it began.
struct LiveCounts {
    std::uint64_t connections = 0; ///< accepted
    std::uint64_t pages = 0;       ///< that opened the socket
    std::uint64_t refused = 0;     ///< wrong path, token or origin, or too many
    std::uint64_t dropped = 0;     ///< pages that did not read, or sent what no page sends
    std::uint64_t errors = 0;      ///< messages that are no commands
    std::size_t open = 0;          ///< pages now
};

/// Serves one page and its socket to browsers, in a thread of its own, sixty times a second. What
/// is not taken is not waited for: each page has at most one batch under way, and a page that
/// takes nothing for LiveServerSettings::taking_s is dropped. Paths without the token are answered
/// by 404, sockets of pages of another origin by 403. Nothing else is served.
class LiveServer {
public:
    /// Is asked in the server's thread, one command at a time. What it throws is told to the page.
    using Answer = std::function<LiveReply(const ViewCommand&)>;

    /// Listens from here on. `page` is the HTML, `scene` the first message of a socket.  [setup]
    /// Throws std::runtime_error "port 8080: ...; what to do" where it cannot.
    LiveServer(const LiveServerSettings& settings, std::string page,
               std::shared_ptr<const std::string> scene, Answer answer);
    /// Every connection is closed.
    ~LiveServer();
    LiveServer(const LiveServer&) = delete;
    LiveServer& operator=(const LiveServer&) = delete;

    std::uint16_t port() const noexcept; ///< that it listens on                          [any]
    const std::string& token() const noexcept; ///< in the link                            [any]
    /// "http://127.0.0.1:PORT/TOKEN/".                                                      [any]
    std::string link() const;

    /// One more frame for all pages: copied under a lock that is held for as long as that takes.
    /// Not for the loop's thread, but for the one that records. Of frames that no page has taken
    /// the last four seconds are kept.                                                  [setup]
    void add(const FrameReport& frame);

    /// Tells every page, and the ones to come, how things are: `state` is a JSON object as text.
    /// `said` may be empty: then pages are told with the next batch of frames. Throws
    /// std::invalid_argument where `state` is no JSON object.                            [setup]
    void tell(std::string_view said, bool is_error, const std::string& state);

    LiveCounts counts() const; ///< [setup]

private:
    class Server;
    std::unique_ptr<Server> server_;
};

} // namespace palpate
