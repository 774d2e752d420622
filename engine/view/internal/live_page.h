// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

#include <palpate/engine/view/internal/frame_history.h>
#include <palpate/engine/view/internal/live_answer.h>
#include <palpate/engine/view/internal/page_work.h>
#include <palpate/engine/view/live_server.h>

namespace palpate::internal {

/// A message for pages, which share it.
using LiveMessage = std::shared_ptr<const std::string>;

constexpr std::chrono::seconds kLiveRequest{10}; ///< for a request to come, and its answer to go

/// What words for a page are about.
enum class LiveTopic : std::uint8_t {
    any,
    mesh ///< the mesh that the page asked for does not come: it may ask for the next one
};

/// Words and state for pages, as JSON.                                                    [setup]
std::string live_words(std::string_view said, bool is_error, const nlohmann::json& state,
                       LiveTopic about = LiveTopic::any);

class LivePage;

/// What a page needs of its server. All in the server's thread.
class LiveHost {
public:
    virtual ~LiveHost() = default;
    virtual boost::asio::io_context& io() = 0;                ///< runs the server's thread
    virtual boost::asio::thread_pool& worker() = 0;           ///< for what takes longer
    virtual const FrameHistory& history() const = 0;          ///< the last frames
    virtual const nlohmann::json& state() const = 0;          ///< that pages are told
    virtual const LiveMessage& scene() const = 0;             ///< the first message of a socket
    virtual std::chrono::duration<double> taking() const = 0; ///< LiveServerSettings::taking_s
    virtual std::size_t& connections() = 0;                   ///< that are open now
    virtual std::size_t& button_holders() = 0;                ///< pages that hold the button down
    /// Throws std::exception: what is told to the page.
    virtual LiveReply answer(const ViewCommand& command) = 0;
    /// A socket is open. False: there are as many as may be.
    virtual bool add(const std::shared_ptr<LivePage>& page) = 0;
    virtual void remove(const std::shared_ptr<LivePage>& page) = 0; ///< it is closed
    virtual void count_error() = 0;                                 ///< a message was no command
    virtual void count_dropped() = 0;                               ///< a page was dropped
};

/// A browser's socket. All in the server's thread.
class LivePage : public std::enable_shared_from_this<LivePage> {
public:
    LivePage(LiveHost& host, boost::asio::ip::tcp::socket&& socket);
    ~LivePage();
    LivePage(const LivePage&) = delete;
    LivePage& operator=(const LivePage&) = delete;

    /// Answers the request that opens the socket.
    void begin(const LiveRequest& request);
    /// Frames that it has not been sent, unless the last ones are still under way.
    void tick();
    /// One more message, behind those that are under way.
    void send(LiveMessage message, bool is_text);
    /// What is being made for it is cancelled, and nothing more is sent of it.
    void end_work();

private:
    enum class Kind : std::uint8_t { text, binary };
    using Error = boost::system::error_code;

    void accepted();
    void say_full();
    void read();
    void has_read(Error error);
    void obey();
    void has_made(const LiveMessage& made, const std::string& why);
    void say(const std::string& words, bool is_error, LiveTopic about = LiveTopic::any);
    void write(LiveMessage message, Kind kind);
    void write_piece();
    void has_written(Error error, bool is_last);
    /// Ends what does not behave as a page, without waiting for it.
    void drop();
    void leave();
    bool hold_button(bool on);
    void release_button();

    LiveHost& host_;
    boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
    boost::beast::flat_buffer in_{2 * kLongestCommand};
    LiveMessage under_way_;
    std::size_t written_ = 0;                        ///< bytes of it
    std::deque<std::pair<LiveMessage, Kind>> texts_; ///< behind what is under way
    std::shared_ptr<PageWork> work_;                 ///< from accepted() on
    std::chrono::steady_clock::time_point began_;
    std::uint64_t next_ = 0; ///< frame
    std::size_t commands_ = 0;
    std::size_t errors_ = 0;
    bool is_writing_ = false;
    bool is_paused_ = false;
    bool is_open_ = true;
    bool holds_button_ = false; ///< it has said that the button is down, and not that it is up
};

} // namespace palpate::internal
