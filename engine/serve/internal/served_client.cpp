// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/serve/internal/served_client.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include <boost/asio/buffer.hpp>

namespace palpate::internal {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using std::chrono::steady_clock;

constexpr std::size_t kPiece = 65536;     // bytes that are written at a time
constexpr std::size_t kMostFaulty = 100;  // messages of a client that still counts as one
constexpr std::size_t kMostQueued = 1024; // messages for a client that asks and does not read
constexpr std::uint8_t kRefused = 1;      // status of RTS_

/// What there is, for GET_CAPABIL: names of types, 12 bytes each.
IgtlBytes capabilities() {
    constexpr std::array<std::string_view, 3> kTypes{"TRANSFORM", "POLYDATA", "STATUS"};
    IgtlBytes content(kTypes.size() * kIgtlLongestType, 0);
    for (std::size_t i = 0; i < kTypes.size(); ++i)
        std::ranges::copy(kTypes[i],
                          content.begin() + static_cast<std::ptrdiff_t>(i * kIgtlLongestType));
    return content;
}

bool has_passed(steady_clock::time_point since, double seconds) {
    return steady_clock::now() - since > std::chrono::duration<double>(seconds);
}

} // namespace

ServedClient::ServedClient(ServedHost& host, asio::ip::tcp::socket&& socket)
    : host_(host), socket_(std::move(socket)) {}

void ServedClient::begin() { read(); }

void ServedClient::tick() {
    if (!is_open_) return;
    if (under_way_ && has_passed(began_, host_.settings().taking_s)) return drop();
    if (!is_greeted_ && has_passed(since_, host_.settings().hesitation_s)) greet(IgtlVersion::one);
    if (is_greeted_) next();
}

void ServedClient::read() {
    socket_.async_read_some(asio::buffer(in_),
                            [self = shared_from_this()](Error error, std::size_t count) {
                                self->has_read(error, count);
                            });
}

void ServedClient::has_read(Error error, std::size_t count) {
    if (error) return leave();
    std::span<const std::uint8_t> bytes(in_.data(), count);
    while (is_open_) {
        switch (reader_.take(bytes)) {
        case IgtlReader::Found::nothing:
            return read();
        case IgtlReader::Found::message:
            obey(reader_.message());
            break;
        case IgtlReader::Found::passed_over:
            host_.count([](IgtlServerCounts& counts) { ++counts.left_out; });
            break;
        case IgtlReader::Found::faulty:
            host_.count([](IgtlServerCounts& counts) { ++counts.faulty; });
            if (++faulty_ < kMostFaulty) break;
            [[fallthrough]];
        case IgtlReader::Found::broken:
            return drop();
        }
    }
}

void ServedClient::obey(const IgtlMessage& message) {
    version_ = message.version;
    if (!is_greeted_) greet(version_); // STATUS with which clients begin is answered by that
    bool is_understood = message.type == "STATUS";
    if (message.type == "TRANSFORM") {
        const std::optional<IgtlTransform> transform = read_igtl_transform(message.content);
        is_understood = transform.has_value();
        if (transform) host_.given(message.device, *transform);
    } else if (message.type.starts_with("GET_")) {
        answer_query(message);
        is_understood = true;
    } else if (message.type.starts_with("STT_") || message.type.starts_with("STP_")) {
        // What is sent is sent to all; nothing else can be had.
        say("RTS_" + message.type.substr(4), message.device, {kRefused});
        is_understood = true;
    }
    host_.count(
        [&](IgtlServerCounts& counts) { ++(is_understood ? counts.messages : counts.left_out); });
}

/// What there is not is answered by a message without content.
void ServedClient::answer_query(const IgtlMessage& query) {
    const std::string what = query.type.substr(4);
    if (what.empty()) return; // it asks for nothing, and an answer would be of no type
    if (what == "STATUS")
        return say("STATUS", query.device,
                   igtl_status_content({IgtlStatus::kOk, 0, "OK", host_.settings().words}));
    if (what == "CAPABIL") return say("CAPABILITY", query.device, capabilities());
    if (what == "TRANS" || what == "TRANSFOR") { // the specification has both spellings
        ServedBytes found = host_.transforms(version_, query.device);
        return found ? queue(std::move(found)) : say("TRANSFORM", query.device, {});
    }
    if (what != "POLYDATA") return say(what, query.device, {});
    const std::vector<ServedBytes> found = host_.surfaces(version_, query.device);
    if (found.empty()) say("POLYDATA", query.device, {});
    for (const ServedBytes& surface : found)
        queue(surface);
}

/// The first that it gets: what is here, and the surfaces.
void ServedClient::greet(IgtlVersion version) {
    version_ = version;
    is_greeted_ = true;
    was_batch_ = true; // what is said here goes first
    say("STATUS", "Palpate",
        igtl_status_content({IgtlStatus::kOk, 0, "OK", host_.settings().words}));
    for (const ServedBytes& surface : host_.surfaces(version_, ""))
        queue(surface);
}

void ServedClient::say(const std::string& type, const std::string& device, IgtlBytes content) {
    IgtlMessage message;
    message.version = version_;
    message.type = type;
    message.device = device;
    message.time = igtl_time(
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
    message.content = std::move(content);
    queue(std::make_shared<const IgtlBytes>(igtl_bytes(message)));
}

void ServedClient::queue(ServedBytes bytes) {
    if (queued_.size() >= kMostQueued) return drop();
    queued_.push_back(std::move(bytes));
    next();
}

/// Transforms and what is queued take turns, so that many surfaces hold up no movement.
void ServedClient::next() {
    if (under_way_ || !is_open_) return;
    const bool has_batch = host_.newest() != sent_;
    if (has_batch && (queued_.empty() || !was_batch_)) {
        sent_ = host_.newest();
        was_batch_ = true;
        write(host_.batch(version_));
    } else if (!queued_.empty()) {
        was_batch_ = false;
        ServedBytes bytes = std::move(queued_.front());
        queued_.pop_front();
        write(std::move(bytes));
    }
}

void ServedClient::write(ServedBytes bytes) {
    under_way_ = std::move(bytes);
    written_ = 0;
    write_piece();
}

// Piece by piece: a large surface that goes through a slow tunnel is being taken.
void ServedClient::write_piece() {
    began_ = steady_clock::now();
    const std::size_t size = std::min(kPiece, under_way_->size() - written_);
    socket_.async_write_some(asio::buffer(under_way_->data() + written_, size),
                             [self = shared_from_this()](Error error, std::size_t count) {
                                 if (error) return self->leave();
                                 self->written_ += count;
                                 if (self->written_ < self->under_way_->size())
                                     return self->write_piece();
                                 self->under_way_.reset();
                                 self->next();
                             });
}

void ServedClient::drop() {
    if (is_open_) host_.count([](IgtlServerCounts& counts) { ++counts.dropped; });
    leave();
}

void ServedClient::leave() {
    if (!std::exchange(is_open_, false)) return;
    error_code ignored;
    socket_.close(ignored);
    host_.remove(shared_from_this());
}

} // namespace palpate::internal
