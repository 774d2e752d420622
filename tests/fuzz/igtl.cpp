// SPDX-License-Identifier: Apache-2.0
// What comes over a connection of OpenIGTLink. The first byte says how the stream is cut. The
// stream is read as it is, and once more with the right checksums: damage seldom gets past them.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <palpate/drivers/igtl_message.h>
#include <palpate/drivers/igtl_reader.h>

#include "tests/fuzz/target.h"

using namespace palpate;

namespace {

using Found = IgtlReader::Found;

bool are_same(const IgtlMessage& a, const IgtlMessage& b) {
    return a.version == b.version && a.type == b.type && a.device == b.device && a.time == b.time &&
           a.id == b.id && a.metadata == b.metadata && a.content == b.content;
}

struct Heard {
    std::vector<Found> found; ///< all but `nothing`
    std::vector<IgtlMessage> messages;
};

Heard heard(const IgtlBytes& stream, std::size_t piece) {
    Heard all;
    IgtlReader reader;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
        auto bytes = std::span(stream).subspan(at, std::min(piece, stream.size() - at));
        while (!bytes.empty()) {
            const std::size_t before = bytes.size();
            const Found found = reader.take(bytes);
            if (found == Found::message) all.messages.push_back(reader.message());
            if (found != Found::nothing) all.found.push_back(found);
            if (found == Found::broken) return all;
            test::must(bytes.size() < before || found != Found::nothing, "it stands still");
        }
    }
    return all;
}

/// Puts the checksum of each whole body into the header before it.
IgtlBytes with_checksums(IgtlBytes stream) {
    constexpr std::size_t kChecksum = 50; // where it is in a header
    for (std::size_t at = 0; stream.size() - at >= kIgtlHeader;) {
        const std::span<const std::uint8_t, kIgtlHeader> begin(stream.data() + at, kIgtlHeader);
        const std::optional<IgtlHeader> header = read_igtl_header(begin);
        if (!header || header->body_bytes > stream.size() - at - kIgtlHeader) return stream;
        const auto size = static_cast<std::size_t>(header->body_bytes);
        const std::uint64_t crc =
            igtl_crc64(std::span<const std::uint8_t>(stream).subspan(at + kIgtlHeader, size));
        for (std::size_t n = 0; n < sizeof crc; ++n)
            stream[at + kChecksum + n] = static_cast<std::uint8_t>(crc >> (56 - 8 * n));
        at += kIgtlHeader + size;
    }
    return stream;
}

void take(const IgtlMessage& message) {
    ++test::taken;
    test::must(!message.type.empty() && message.type.size() <= kIgtlLongestType, "a type");
    test::must(message.device.size() <= kIgtlLongestName, "a name");
    test::must(message.content.size() <= IgtlReader::kMostBody, "more than a message may have");
    if (const auto transform = read_igtl_transform(message.content))
        if (const auto pose = tool_pose(*transform)) {
            test::must(is_finite(pose->position) && glm::length(pose->position) <= 1e3 * (1 + 1e-6),
                       "a tool that is nowhere");
            test::must(std::abs(glm::length(pose->orientation) - 1.0) < 1e-9, "no rotation");
        }
    if (const auto status = read_igtl_status(message.content))
        test::must(status->name.size() <= 20 && status->words.size() <= message.content.size(),
                   "more words than there were");
    const Heard again = heard(igtl_bytes(message), IgtlReader::kMostBody + kIgtlHeader);
    test::must(again.messages.size() == 1 && are_same(again.messages.front(), message),
               "another message when it is written and read");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    test::Input input(data, size);
    const std::size_t piece = 1 + input.choice(128);
    const IgtlBytes stream(input.rest().begin(), input.rest().end());
    for (const IgtlBytes& bytes : {stream, with_checksums(stream)}) {
        const Heard whole = heard(bytes, std::max<std::size_t>(bytes.size(), 1));
        const Heard cut = heard(bytes, piece);
        test::must(whole.found == cut.found, "the cuts make a difference");
        test::must(std::equal(whole.messages.begin(), whole.messages.end(), cut.messages.begin(),
                              cut.messages.end(), are_same),
                   "the cuts make another message");
        for (const IgtlMessage& message : whole.messages)
            take(message);
    }
    return 0;
}
