// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/mcap_file.h>

#include <algorithm>

#include <zlib.h>

#include <palpate/engine/text/internal/mcap_mark.h>
#include <palpate/version.h>

namespace palpate::internal {
namespace {

/// A chunk is closed once it has so many bytes: a reader that wants one moment reads one chunk.
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

enum class Op : std::uint8_t {
    header = 0x01,
    footer = 0x02,
    schema = 0x03,
    channel = 0x04,
    message = 0x05,
    chunk = 0x06,
    message_index = 0x07,
    chunk_index = 0x08,
    statistics = 0x0B,
    metadata = 0x0C,
    metadata_index = 0x0D,
    summary_offset = 0x0E,
    data_end = 0x0F
};

template <class Size>
void append_sized(std::string& bytes, std::string_view content) {
    append_little_endian(bytes, static_cast<Size>(content.size()));
    bytes += content;
}

void append_text(std::string& bytes, std::string_view text) {
    append_sized<std::uint32_t>(bytes, text);
}

void append_entries(std::string& bytes, const McapFile::Entries& entries) {
    std::string map;
    for (const auto& [key, value] : entries) {
        append_text(map, key);
        append_text(map, value);
    }
    append_text(bytes, map);
}

void append_record(std::string& bytes, Op op, std::string_view content) {
    bytes.push_back(static_cast<char>(op));
    append_sized<std::uint64_t>(bytes, content);
}

std::uint32_t crc_of(std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

} // namespace

void McapFile::Times::add(std::uint64_t time_ns) {
    first_ns = std::min(first_ns, time_ns);
    last_ns = std::max(last_ns, time_ns);
    ++count;
}

McapFile::McapFile() : bytes_(kMcapMagic) {
    std::string content;
    append_text(content, "ros2");
    append_text(content, std::string(kMcapLibrary) + kVersion);
    append_record(bytes_, Op::header, content);
}

std::uint16_t McapFile::add_schema(std::string_view type, std::string_view definition) {
    std::string content;
    append_little_endian(content, ++schema_count_);
    append_text(content, type);
    append_text(content, "ros2msg");
    append_text(content, definition);
    append_record(schemas_, Op::schema, content);
    append_record(bytes_, Op::schema, content);
    return schema_count_;
}

std::uint16_t McapFile::add_channel(std::uint16_t schema, std::string_view topic,
                                    const Entries& entries) {
    channels_.emplace_back();
    const auto id = static_cast<std::uint16_t>(channels_.size());
    std::string content;
    append_little_endian(content, id);
    append_little_endian(content, schema);
    append_text(content, topic);
    append_text(content, "cdr");
    append_entries(content, entries);
    append_record(channel_records_, Op::channel, content);
    append_record(bytes_, Op::channel, content);
    return id;
}

void McapFile::add_metadata(std::string_view name, const Entries& entries) {
    std::string content;
    append_text(content, name);
    append_entries(content, entries);
    std::string index;
    append_little_endian(index, std::uint64_t{bytes_.size()});
    append_record(bytes_, Op::metadata, content);
    append_little_endian(index, std::uint64_t{1 + 8 + content.size()}); // with opcode and length
    append_text(index, name);
    append_record(metadata_indices_, Op::metadata_index, index);
    ++metadata_count_;
}

void McapFile::add_message(std::uint16_t channel, std::uint64_t time_ns, std::string_view cdr) {
    Channel& of = channels_.at(channel - std::size_t{1});
    of.in_chunk.emplace_back(time_ns, chunk_.size());
    std::string content;
    append_little_endian(content, channel);
    append_little_endian(content, static_cast<std::uint32_t>(of.count++));
    append_little_endian(content, time_ns); // recorded
    append_little_endian(content, time_ns); // published
    content += cdr;
    append_record(chunk_, Op::message, content);
    chunk_times_.add(time_ns);
    times_.add(time_ns);
    if (chunk_.size() >= kChunkBytes) finish_chunk();
}

void McapFile::finish_chunk() {
    if (chunk_.empty()) return;
    const std::uint64_t began = bytes_.size();
    std::string content;
    append_little_endian(content, chunk_times_.first_ns);
    append_little_endian(content, chunk_times_.last_ns);
    append_little_endian(content, std::uint64_t{chunk_.size()});
    append_little_endian(content, crc_of(chunk_));
    append_text(content, ""); // no compression
    append_sized<std::uint64_t>(content, chunk_);
    append_record(bytes_, Op::chunk, content);
    const std::uint64_t ended = bytes_.size();

    std::string places;
    for (std::size_t n = 0; n < channels_.size(); ++n) {
        if (channels_[n].in_chunk.empty()) continue;
        const auto id = static_cast<std::uint16_t>(n + 1);
        append_little_endian(places, id);
        append_little_endian(places, std::uint64_t{bytes_.size()});
        std::string entries;
        for (const auto& [time_ns, place] : channels_[n].in_chunk) {
            append_little_endian(entries, time_ns);
            append_little_endian(entries, place);
        }
        std::string index;
        append_little_endian(index, id);
        append_text(index, entries);
        append_record(bytes_, Op::message_index, index);
        channels_[n].in_chunk.clear();
    }

    std::string index;
    append_little_endian(index, chunk_times_.first_ns);
    append_little_endian(index, chunk_times_.last_ns);
    append_little_endian(index, began);
    append_little_endian(index, ended - began);
    append_text(index, places);
    append_little_endian(index, std::uint64_t{bytes_.size()} - ended);
    append_text(index, ""); // no compression
    append_little_endian(index, std::uint64_t{chunk_.size()});
    append_little_endian(index, std::uint64_t{chunk_.size()});
    append_record(chunk_indices_, Op::chunk_index, index);
    ++chunk_count_;
    chunk_times_ = {};
    chunk_.clear();
}

std::string McapFile::statistics() const {
    std::string counts;
    for (std::size_t n = 0; n < channels_.size(); ++n) {
        append_little_endian(counts, static_cast<std::uint16_t>(n + 1));
        append_little_endian(counts, channels_[n].count);
    }
    std::string content, record;
    append_little_endian(content, times_.count);
    append_little_endian(content, schema_count_);
    append_little_endian(content, static_cast<std::uint32_t>(channels_.size()));
    append_little_endian(content, std::uint32_t{0}); // attachments
    append_little_endian(content, metadata_count_);
    append_little_endian(content, chunk_count_);
    append_little_endian(content, times_.first_or_zero());
    append_little_endian(content, times_.last_ns);
    append_text(content, counts);
    append_record(record, Op::statistics, content);
    return record;
}

std::string McapFile::written() && {
    finish_chunk();
    std::string end;
    append_little_endian(end, crc_of(bytes_));
    append_record(bytes_, Op::data_end, end);

    const std::uint64_t summary = bytes_.size();
    std::string offsets;
    const auto add_group = [&](Op op, const std::string& records) {
        if (records.empty()) return;
        std::string offset(1, static_cast<char>(op));
        append_little_endian(offset, std::uint64_t{bytes_.size()});
        append_little_endian(offset, std::uint64_t{records.size()});
        append_record(offsets, Op::summary_offset, offset);
        bytes_ += records;
    };
    add_group(Op::schema, schemas_);
    add_group(Op::channel, channel_records_);
    add_group(Op::statistics, statistics());
    add_group(Op::chunk_index, chunk_indices_);
    add_group(Op::metadata_index, metadata_indices_);

    const std::uint64_t summary_offsets = bytes_.size();
    bytes_ += offsets;
    bytes_.push_back(static_cast<char>(Op::footer));
    append_little_endian(bytes_, std::uint64_t{8 + 8 + 4}); // its length
    append_little_endian(bytes_, summary);
    append_little_endian(bytes_, summary_offsets);
    append_little_endian(bytes_, crc_of(std::string_view(bytes_).substr(summary)));
    bytes_ += kMcapMagic;
    return std::move(bytes_);
}

} // namespace palpate::internal
