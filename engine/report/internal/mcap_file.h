// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::internal {

/// Appends a number with its lowest byte first.                                         [setup]
template <std::unsigned_integral Number>
void append_little_endian(std::string& bytes, Number number) {
    for (std::size_t n = 0; n < sizeof(Number); ++n)
        bytes.push_back(static_cast<char>(number >> (8 * n) & 0xFF));
}

/// An MCAP file of the profile ros2, made in memory: https://mcap.dev/spec, major version 0. The
/// messages are in chunks without compression, each with an index; the summary has what readers
/// need to find a time or a topic. Every checksum is there. [setup]
class McapFile {
public:
    using Entries = std::vector<std::pair<std::string, std::string>>; ///< key, value

    McapFile();

    /// A message type, such as geometry_msgs/msg/PoseStamped, and its definition (ros2msg).
    /// @return the schema for add_channel().
    std::uint16_t add_schema(std::string_view type, std::string_view definition);

    /// @return the channel for add_message(). `entries`: metadata of the channel.
    std::uint16_t add_channel(std::uint16_t schema, std::string_view topic, const Entries& entries);

    void add_metadata(std::string_view name, const Entries& entries);

    /// A message, encoded as CDR. `time_ns` counts from an epoch of the user's.
    void add_message(std::uint16_t channel, std::uint64_t time_ns, std::string_view cdr);

    /// All bytes of the file; nothing can be added any more.
    std::string written() &&;

private:
    struct Times { ///< of messages
        std::uint64_t first_ns = std::numeric_limits<std::uint64_t>::max();
        std::uint64_t last_ns = 0;
        std::uint64_t count = 0;

        void add(std::uint64_t time_ns);
        std::uint64_t first_or_zero() const { return count > 0 ? first_ns : 0; }
    };
    struct Channel {
        std::uint64_t count = 0;
        std::vector<std::pair<std::uint64_t, std::uint64_t>> in_chunk; ///< time, place in chunk_
    };

    void finish_chunk();
    std::string statistics() const;

    std::string bytes_;
    std::string chunk_; ///< messages that are in no chunk yet
    Times chunk_times_;
    Times times_;
    std::vector<Channel> channels_; ///< number n has the id n + 1
    std::string schemas_;           ///< records for the summary
    std::string channel_records_;
    std::string chunk_indices_;
    std::string metadata_indices_;
    std::uint16_t schema_count_ = 0;
    std::uint32_t chunk_count_ = 0;
    std::uint32_t metadata_count_ = 0;
};

} // namespace palpate::internal
