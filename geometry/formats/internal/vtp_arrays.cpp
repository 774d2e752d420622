// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/internal/vtp_arrays.h>

#include <algorithm>
#include <array>

#include <zlib.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kMaxDeflation = 1032; // zlib.net/zlib_tech.html

constexpr const char* kAgain = "; copy or export it again";

/// 0 to 63; -1 for what is no letter of base64, -2 for padding.
int sextet(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+') return 62;
    if (c == '/') return 63;
    return c == '=' ? -2 : -1;
}

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

/// Hands out the bytes of an array in order.
class Feed {
public:
    Feed(const MeshSource& source, const VtpPlace& place) : source_(source), place_(place) {}

    std::string take(std::size_t count) {
        const std::size_t left = place_.bytes.size() - at_ + ready_.size();
        if (count > left) cut_off(count);
        if (place_.text == VtpPlace::Text::raw) {
            at_ += count;
            return std::string(place_.bytes.substr(at_ - count, count));
        }
        while (ready_.size() < count)
            decode_four(count);
        std::string taken = ready_.substr(0, count);
        ready_.erase(0, count);
        return taken;
    }

    [[noreturn]] void fail(const std::string& what) const {
        source_.fail_at(place_.at, "an array " + what + kAgain);
    }

    std::size_t most() const { return place_.bytes.size(); } ///< more bytes there cannot be

private:
    [[noreturn]] void cut_off(std::size_t count) const {
        fail("ends before the next " + std::to_string(count) + " bytes of it");
    }

    /// A stream that ends with padding may be followed by another one: the header has its own.
    void decode_four(std::size_t count) {
        std::array<int, 4> four{};
        for (int& one : four) {
            while (at_ < place_.bytes.size() && is_space(place_.bytes[at_]))
                ++at_;
            if (at_ == place_.bytes.size() || place_.bytes[at_] == '<') cut_off(count);
            one = sextet(place_.bytes[at_++]);
            if (one == -1) fail("is not written in base64");
        }
        const bool is_sound = four[0] >= 0 && four[1] >= 0 && (four[2] >= 0 || four[3] < 0);
        if (!is_sound) fail("is not written in base64");
        ready_ += static_cast<char>(four[0] << 2 | four[1] >> 4);
        if (four[2] >= 0) ready_ += static_cast<char>((four[1] & 0xF) << 4 | four[2] >> 2);
        if (four[3] >= 0) ready_ += static_cast<char>((four[2] & 0x3) << 6 | four[3]);
    }

    const MeshSource& source_;
    VtpPlace place_;
    std::size_t at_ = 0;
    std::string ready_; ///< decoded and not yet taken
};

/// Numbers before an array. Those beyond the file are absurd whatever they count.
std::vector<std::size_t> header(Feed& feed, std::size_t count, const VtpCoding& coding) {
    const VtkType type{VtkType::Kind::natural, coding.header_bytes};
    if (count > feed.most() / coding.header_bytes) feed.fail("has an absurd number of blocks");
    std::vector<std::size_t> numbers;
    for (const double number : vtk_numbers(feed.take(count * type.bytes), type, coding.order)) {
        if (!(number <= static_cast<double>(feed.most()) * kMaxDeflation))
            feed.fail("states an absurd size");
        numbers.push_back(static_cast<std::size_t>(number));
    }
    return numbers;
}

std::string inflated(Feed& feed, const VtpCoding& coding, std::size_t most) {
    const std::size_t blocks = header(feed, 1, coding).front();
    if (blocks == 0) return {};
    const std::vector<std::size_t> whole = header(feed, 2, coding); // of a block, of the last one
    const std::vector<std::size_t> deflated = header(feed, blocks, coding);
    std::string bytes;
    for (std::size_t n = 0; n < blocks; ++n) {
        const bool is_last = n + 1 == blocks;
        const std::size_t size = is_last && whole[1] > 0 ? whole[1] : whole[0];
        if (size / kMaxDeflation > deflated[n]) feed.fail("cannot have been deflated so far");
        if (size > most || bytes.size() > most - size)
            feed.fail("inflates to more than the piece states");
        const std::string block = feed.take(deflated[n]);
        const std::size_t before = bytes.size();
        bytes.resize(before + size);
        uLongf length = size;
        const int status = ::uncompress(reinterpret_cast<Bytef*>(bytes.data() + before), &length,
                                        reinterpret_cast<const Bytef*>(block.data()), block.size());
        if (status != Z_OK || length != size) feed.fail("does not inflate to what it states");
    }
    return bytes;
}

} // namespace

std::string vtp_bytes(const MeshSource& source, const VtpPlace& place, const VtpCoding& coding,
                      std::size_t most) {
    Feed feed(source, place);
    if (coding.is_deflated) return inflated(feed, coding, most);
    return feed.take(header(feed, 1, coding).front());
}

} // namespace palpate::internal
