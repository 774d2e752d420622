// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <palpate/drivers/igtl_message.h>

namespace palpate {

/// Makes messages of OpenIGTLink of the bytes of a stream, however they are cut. It keeps no more
/// than one message of kMostBody bytes: larger ones, as images, are passed over by their size.
class IgtlReader {
public:
    static constexpr std::uint64_t kMostBody = 65536; ///< of a message that is read, bytes
    static constexpr std::uint64_t kMostPassedOver = std::uint64_t{1} << 31; ///< of one that is not

    /// What the bytes led to.
    enum class Found : std::uint8_t {
        nothing,     ///< they are used up, and more are needed
        message,     ///< message() is new
        faulty,      ///< a message with a wrong checksum or sizes that do not fit was left out
        passed_over, ///< a message that is too large begins, and is left out
        broken       ///< this is no OpenIGTLink; nothing that follows means anything
    };

    /// Takes bytes from the front of `bytes`, until something is found or they are used up. After
    /// `broken` it takes nothing any more.                                              [setup]
    Found take(std::span<const std::uint8_t>& bytes);

    /// The last one that was found.                                                       [setup]
    const IgtlMessage& message() const noexcept { return message_; }

private:
    Found take_header(std::span<const std::uint8_t>& bytes);
    Found take_body(std::span<const std::uint8_t>& bytes);
    bool gather(std::span<const std::uint8_t>& bytes, std::size_t wanted);

    IgtlBytes gathered_; ///< of the header or the body that is coming
    std::optional<IgtlHeader> header_;
    std::uint64_t passing_ = 0; ///< bytes that are still to be passed over
    bool is_broken_ = false;
    IgtlMessage message_;
};

} // namespace palpate
