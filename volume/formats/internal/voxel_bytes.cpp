// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/voxel_bytes.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

// Numbers that are read and converted at a time: they stay in the cache between the two.
constexpr std::size_t kChunkNumbers = std::size_t{1} << 16;

constexpr unsigned kInflationBuffer = 1U << 17; // bytes; zlib's own 8 KiB costs calls

constexpr std::size_t kLargestRead = std::size_t{1} << 30; // bytes: counted in an int by zlib

using Code = VoxelType::Code;
constexpr std::array<VoxelType, 10> kTypes{{{Code::int8, "int8", 1},
                                            {Code::uint8, "uint8", 1},
                                            {Code::int16, "int16", 2},
                                            {Code::uint16, "uint16", 2},
                                            {Code::int32, "int32", 4},
                                            {Code::uint32, "uint32", 4},
                                            {Code::int64, "int64", 8},
                                            {Code::uint64, "uint64", 8},
                                            {Code::float32, "float32", 4},
                                            {Code::float64, "float64", 8}}};

} // namespace

const VoxelType& voxel_type(VoxelType::Code code) noexcept {
    return kTypes[static_cast<std::size_t>(code)]; // in the enumeration's order
}

namespace {

/// Inflates what a descriptor delivers, with zlib's header or gzip's.
class Inflater {
public:
    explicit Inflater(int descriptor) : descriptor_(descriptor), input_(kInflationBuffer) {
        if (inflateInit2(&stream_, MAX_WBITS + 32) != Z_OK) throw std::bad_alloc();
    }
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// At most so many bytes, 0 at the end; nothing where they cannot be inflated.
    std::optional<std::size_t> read_some(std::span<char> bytes) {
        stream_.next_out = reinterpret_cast<Bytef*>(bytes.data());
        stream_.avail_out = static_cast<uInt>(bytes.size());
        while (!ended_ && stream_.avail_out > 0) {
            if (stream_.avail_in == 0 && !refill()) return std::nullopt;
            const int status = inflate(&stream_, Z_NO_FLUSH);
            if (status != Z_OK && status != Z_STREAM_END) return std::nullopt;
            ended_ = status == Z_STREAM_END;
        }
        return bytes.size() - stream_.avail_out;
    }

private:
    bool refill() {
        const ssize_t got = ::read(descriptor_, input_.data(), input_.size());
        if (got <= 0) return false;
        stream_.next_in = input_.data();
        stream_.avail_in = static_cast<uInt>(got);
        return true;
    }

    int descriptor_;
    std::vector<Bytef> input_;
    z_stream stream_{};
    bool ended_ = false;
};

} // namespace

/// An open file; zlib owns the descriptor where it reads gzip.
struct InputBytes::Source {
    Source(std::filesystem::path name, std::uint64_t start, Packing packing)
        : file(std::move(name)), descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
        if (descriptor < 0) throw import_error(file, "cannot be opened; check its permissions");
        const bool found = ::lseek(descriptor, static_cast<off_t>(start), SEEK_SET) >= 0;
        const bool by_gzip = packing == Packing::gzip || packing == Packing::by_look;
        if (found && by_gzip) zipped = gzdopen(descriptor, "rb");
        if (!found || (by_gzip && zipped == nullptr)) {
            ::close(descriptor);
            throw import_error(file, "cannot be read; get the file again");
        }
        if (zipped != nullptr) gzbuffer(zipped, kInflationBuffer);
        if (packing == Packing::zlib) inflater.emplace(descriptor);
    }
    ~Source() {
        if (zipped != nullptr)
            gzclose(zipped);
        else
            ::close(descriptor);
    }
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;

    /// At most so many bytes, 0 at the end.
    std::size_t read_some(std::span<char> bytes) {
        const std::size_t wanted = std::min(bytes.size(), kLargestRead);
        if (inflater) {
            const auto got = inflater->read_some(bytes.first(wanted));
            if (!got) fail_inflating();
            return *got;
        }
        if (zipped == nullptr) return read_plain(bytes.first(wanted));
        const int got = gzread(zipped, bytes.data(), static_cast<unsigned>(wanted));
        int error = Z_OK;
        if (got <= 0) gzerror(zipped, &error);
        if (got < 0 || error != Z_OK) // Z_BUF_ERROR: the file ends before its deflated data do
            fail_inflating();
        return static_cast<std::size_t>(got);
    }

    [[noreturn]] void fail_inflating() const {
        throw import_error(file, "is truncated or damaged: it cannot be inflated; get the file "
                                 "again");
    }

    std::size_t read_plain(std::span<char> bytes) {
        for (;;) {
            const ssize_t got = ::read(descriptor, bytes.data(), bytes.size());
            if (got >= 0) return static_cast<std::size_t>(got);
            if (errno != EINTR)
                throw import_error(file, "cannot be read (" +
                                             std::generic_category().message(errno) +
                                             "); get the file again");
        }
    }

    std::filesystem::path file;
    int descriptor;
    gzFile zipped = nullptr;
    std::optional<Inflater> inflater;
};

InputBytes::InputBytes(const std::filesystem::path& file, std::uint64_t start, Packing packing)
    : source_(std::make_unique<Source>(file, start, packing)) {
    if (packing == Packing::gzip && !deflated())
        throw import_error(file, "has data that are not gzipped, as its header says they are; "
                                 "correct its encoding, or get the file again");
}

InputBytes::~InputBytes() = default;

bool InputBytes::deflated() const noexcept {
    if (source_->inflater) return true;
    return source_->zipped != nullptr && gzdirect(source_->zipped) == 0;
}

void InputBytes::read(std::span<char> bytes, const char* what) {
    while (!bytes.empty()) {
        const std::size_t got = source_->read_some(bytes);
        if (got == 0)
            throw import_error(source_->file, std::string("is truncated: it ends within its ") +
                                                  what + "; get the file again");
        bytes = bytes.subspan(got);
    }
}

void InputBytes::skip(std::uint64_t bytes) {
    std::array<char, 4096> ignored{};
    while (bytes > 0) {
        const std::size_t part =
            static_cast<std::size_t>(std::min<std::uint64_t>(bytes, ignored.size()));
        read(std::span(ignored).first(part), "header");
        bytes -= part;
    }
}

bool InputBytes::has_more() {
    char byte = 0;
    return source_->read_some({&byte, 1}) > 0;
}

void require_room(const std::filesystem::path& file, bool deflated, std::uint64_t stored,
                  std::uint64_t expected) {
    if (deflated) return require_plausible_deflation(file, stored, expected);
    if (stored < expected)
        throw import_error(file, "is truncated: " + std::to_string(stored) +
                                     " bytes of voxels of the " + std::to_string(expected) +
                                     " that its header states; get the file again");
}

VoxelSink::VoxelSink(const std::filesystem::path& file, std::size_t voxels, std::size_t components,
                     Components order)
    : voxels_(voxels), components_(components), order_(order) {
    require_memory(file, static_cast<double>(voxels) * static_cast<double>(components));
    try {
        values_.resize(voxels * components);
    } catch (const std::exception&) { // bad_alloc, length_error
        throw import_error(file, "does not fit into memory; crop or resample it");
    }
}

void VoxelSink::take(std::span<const float> numbers) noexcept {
    if (order_ == Components::first || components_ == 1) {
        std::copy(numbers.begin(), numbers.end(), values_.data() + taken_);
    } else {
        std::size_t component = taken_ / voxels_;
        std::size_t voxel = taken_ % voxels_;
        for (const float number : numbers) {
            values_[voxel * components_ + component] = number;
            if (++voxel < voxels_) continue;
            voxel = 0;
            ++component;
        }
    }
    taken_ += numbers.size();
}

namespace {

template <class T>
void reverse_each(std::span<char> bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(T))
        for (std::size_t n = 0; n < sizeof(T) / 2; ++n)
            std::swap(bytes[at + n], bytes[at + sizeof(T) - 1 - n]);
}

template <class T>
void convert(std::span<const char> bytes, const VoxelCoding& coding, std::span<float> numbers) {
    const bool as_it_is = coding.slope == 1.0 && coding.intercept == 0.0;
    for (std::size_t n = 0; n < numbers.size(); ++n) {
        T stored;
        std::memcpy(&stored, bytes.data() + n * sizeof(T), sizeof(T));
        numbers[n] =
            as_it_is
                ? static_cast<float>(stored)
                : static_cast<float>(coding.slope * static_cast<double>(stored) + coding.intercept);
    }
}

template <class T>
void read_as(InputBytes& input, const VoxelCoding& coding, std::size_t count, VoxelSink& sink) {
    std::vector<char> bytes(std::min(count, kChunkNumbers) * sizeof(T));
    std::vector<float> numbers(std::min(count, kChunkNumbers));
    for (std::size_t first = 0; first < count; first += kChunkNumbers) {
        const std::size_t part = std::min(kChunkNumbers, count - first);
        const std::span<char> stored = std::span(bytes).first(part * sizeof(T));
        input.read(stored, "voxels");
        if (coding.big_endian) reverse_each<T>(stored); // built for little-endian machines
        convert<T>(stored, coding, std::span(numbers).first(part));
        sink.take(std::span(numbers).first(part));
    }
}

} // namespace

void read_voxels(InputBytes& input, const VoxelCoding& coding, std::size_t count, VoxelSink& sink) {
    switch (coding.type.code) {
    case Code::int8:
        return read_as<std::int8_t>(input, coding, count, sink);
    case Code::uint8:
        return read_as<std::uint8_t>(input, coding, count, sink);
    case Code::int16:
        return read_as<std::int16_t>(input, coding, count, sink);
    case Code::uint16:
        return read_as<std::uint16_t>(input, coding, count, sink);
    case Code::int32:
        return read_as<std::int32_t>(input, coding, count, sink);
    case Code::uint32:
        return read_as<std::uint32_t>(input, coding, count, sink);
    case Code::int64:
        return read_as<std::int64_t>(input, coding, count, sink);
    case Code::uint64:
        return read_as<std::uint64_t>(input, coding, count, sink);
    case Code::float32:
        return read_as<float>(input, coding, count, sink);
    case Code::float64:
        return read_as<double>(input, coding, count, sink);
    }
}

} // namespace palpate::internal
