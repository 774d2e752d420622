// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/internal/live_page.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <palpate/engine/view/view_document.h>

namespace palpate::internal {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::steady_clock;

constexpr std::chrono::seconds kSilence{30}; // that does not answer a ping either
constexpr std::size_t kMostErrors = 100;     // no commands: then a page is no page of ours
constexpr std::size_t kMostCommands = 64;    // of one page in a tick; more wait for the next one
constexpr std::size_t kMostWaiting = 32;     // messages besides frames that a page has not taken
constexpr std::size_t kPiece = 65'536;       // bytes of a message that are sent at a time

} // namespace

std::string live_words(std::string_view said, bool is_error, const nlohmann::json& state,
                       LiveTopic about) {
    nlohmann::json message = {
        {"say", said}, {"kind", is_error ? "error" : "info"}, {"state", state}};
    if (about == LiveTopic::mesh) message["about"] = "mesh";
    return message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

LivePage::LivePage(LiveHost& host, tcp::socket&& socket) : host_(host), socket_(std::move(socket)) {
    ++host_.connections();
}

LivePage::~LivePage() { --host_.connections(); }

void LivePage::begin(const LiveRequest& request) {
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = kLiveRequest;
    timeout.idle_timeout = kSilence;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.read_message_max(kLongestCommand);
    // Of the kernel's room for what is not taken: enough for a second of frames.
    error_code ignored;
    constexpr int kRoom = 256 * 1024; // bytes
    beast::get_lowest_layer(socket_).socket().set_option(asio::socket_base::send_buffer_size(kRoom),
                                                         ignored);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
        if (!error) self->accepted();
    });
}

void LivePage::tick() {
    if (is_writing_ && steady_clock::now() - began_ > host_.taking()) return drop();
    commands_ = 0;
    if (is_paused_) {
        is_paused_ = false;
        read();
    }
    const FrameHistory& history = host_.history();
    if (is_writing_ || !texts_.empty() || next_ == history.end()) return;
    const std::uint64_t from = std::max(next_, history.first());
    const std::vector<FrameReport> frames = history.from(from);
    const ViewFrames batch{frames, from, from - next_};
    next_ = history.end();
    write(std::make_shared<const std::string>(frames_message(batch)), Kind::binary);
}

void LivePage::send(LiveMessage message, bool is_text) {
    const Kind kind = is_text ? Kind::text : Kind::binary;
    if (texts_.size() >= kMostWaiting) {
        // Each text has the newest state: of a page that stands still, the oldest words go.
        const auto oldest =
            std::ranges::find(texts_, Kind::text, [](const auto& one) { return one.second; });
        if (oldest == texts_.end()) return drop();
        texts_.erase(oldest);
    }
    if (is_writing_)
        texts_.emplace_back(std::move(message), kind);
    else
        write(std::move(message), kind);
}

void LivePage::accepted() {
    if (!host_.add(shared_from_this())) return say_full();
    work_ = std::make_shared<PageWork>(
        host_.io(), host_.worker(),
        [this](const LiveMessage& made, const std::string& why) { has_made(made, why); });
    next_ = host_.history().end();
    send(host_.scene(), false);
    say("", false);
    read();
}

// A browser shows a socket's reason, and not the words of a refused request.
void LivePage::say_full() {
    is_open_ = false;
    socket_.async_close({websocket::close_code::try_again_later, "too many pages are open"},
                        [self = shared_from_this()](error_code) {});
}

void LivePage::read() {
    socket_.async_read(
        in_, [self = shared_from_this()](error_code error, std::size_t) { self->has_read(error); });
}

void LivePage::has_read(error_code error) {
    if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow)
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

void LivePage::obey() {
    LiveReply reply;
    bool is_command = false;
    LiveTopic about = LiveTopic::any;
    try {
        if (!socket_.got_text())
            throw std::invalid_argument("a binary message is no command; send JSON as text");
        const auto bytes = in_.cdata();
        auto command = parse_view_command(
            std::string_view(static_cast<const char*>(bytes.data()), bytes.size()));
        is_command = true;
        if (std::holds_alternative<view_commands::Level>(command)) about = LiveTopic::mesh;
        if (auto* button = std::get_if<view_commands::Button>(&command))
            button->on = hold_button(button->on);
        reply = host_.answer(command);
    } catch (const std::exception& error) {
        reply = {error.what(), true};
    }
    if (reply.later && reply.turn == LiveReply::Turn::one_by_one && work_->is_busy())
        reply = {"one mesh after the other: wait for the one that is being made", true};
    if (reply.is_error) host_.count_error();
    // What the loop refuses is a page of ours all the same: a slider asks a hundred times.
    if (!is_command && ++errors_ >= kMostErrors) return drop();
    if (reply.later) work_->begin(std::move(reply.later));
    if (!reply.said.empty()) say(reply.said, reply.is_error, about);
}

void LivePage::has_made(const LiveMessage& made, const std::string& why) {
    if (made)
        send(made, false);
    else
        say(why, true, LiveTopic::mesh);
}

void LivePage::end_work() {
    if (work_) work_->end();
}

void LivePage::say(const std::string& words, bool is_error, LiveTopic about) {
    send(std::make_shared<const std::string>(live_words(words, is_error, host_.state(), about)),
         true);
}

void LivePage::write(LiveMessage message, Kind kind) {
    is_writing_ = true;
    under_way_ = std::move(message);
    written_ = 0;
    socket_.text(kind == Kind::text);
    write_piece();
}

// Piece by piece: a large message that goes through a slow tunnel is being taken.
void LivePage::write_piece() {
    began_ = steady_clock::now();
    const std::size_t size = std::min(kPiece, under_way_->size() - written_);
    const bool is_last = written_ + size == under_way_->size();
    const auto piece = asio::buffer(under_way_->data() + written_, size);
    written_ += size;
    socket_.async_write_some(is_last, piece,
                             [self = shared_from_this(), is_last](error_code error, std::size_t) {
                                 self->has_written(error, is_last);
                             });
}

void LivePage::has_written(error_code error, bool is_last) {
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

void LivePage::drop() {
    if (is_open_) host_.count_dropped();
    leave();
}

void LivePage::leave() {
    if (!std::exchange(is_open_, false)) return;
    end_work();
    release_button();
    beast::get_lowest_layer(socket_).close();
    host_.remove(shared_from_this());
}

/// Whether any page holds the button, once this one does or does not.
bool LivePage::hold_button(bool on) {
    if (on && !holds_button_) ++host_.button_holders();
    if (!on && holds_button_) --host_.button_holders();
    holds_button_ = on;
    return host_.button_holders() > 0;
}

// A page that is closed, has crashed or is cut off says nothing any more.
void LivePage::release_button() {
    if (!holds_button_) return;
    try {
        host_.answer(view_commands::Button{hold_button(false)});
    } catch (const std::exception&) {
        host_.count_error();
    }
}

} // namespace palpate::internal
