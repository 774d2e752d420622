// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/igtl_message.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

namespace palpate {
namespace {

constexpr std::size_t kExtendedHeader = 12;
constexpr std::size_t kMetadataEntry = 8; // of its table
constexpr std::uint16_t kAscii = 3;       // IANA's numbers of character sets
constexpr std::uint16_t kUtf8 = 106;
constexpr std::size_t kStatusHead = 30;
constexpr std::size_t kTransform = 48;

constexpr std::array<std::uint64_t, 256> kCrcTable = [] {
    constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693u; // x^64 is not written
    std::array<std::uint64_t, 256> table{};
    for (std::uint64_t byte = 0; byte < table.size(); ++byte) {
        std::uint64_t rest = byte << 56;
        for (int bit = 0; bit < 8; ++bit)
            rest = (rest >> 63) != 0 ? (rest << 1) ^ kPolynomial : rest << 1;
        table[byte] = rest;
    }
    return table;
}();

template <class Number>
void put(IgtlBytes& bytes, Number number) {
    for (int shift = 8 * (static_cast<int>(sizeof number) - 1); shift >= 0; shift -= 8)
        bytes.push_back(static_cast<std::uint8_t>(number >> shift));
}

void put_float(IgtlBytes& bytes, float number) { put(bytes, std::bit_cast<std::uint32_t>(number)); }

void put_text(IgtlBytes& bytes, std::string_view text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
}

/// As much of a text as `bytes` hold, whole characters of UTF-8.
std::string_view cut(std::string_view text, std::size_t bytes) {
    if (text.size() <= bytes) return text;
    const auto goes_on = [](char one) {
        return (static_cast<unsigned char>(one) & 0xC0u) == 0x80u;
    };
    while (bytes > 0 && goes_on(text[bytes]))
        --bytes;
    return text.substr(0, bytes);
}

bool is_ascii(std::string_view text) {
    return std::ranges::all_of(text,
                               [](char one) { return static_cast<unsigned char>(one) < 128; });
}

/// A field of fixed length, filled up with zeros.
void put_field(IgtlBytes& bytes, std::string_view text, std::size_t length) {
    const std::string_view fits = cut(text, length);
    put_text(bytes, fits);
    bytes.insert(bytes.end(), length - fits.size(), 0);
}

/// Takes numbers and texts from the front of bytes that are known to be there.
class Front {
public:
    explicit Front(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

    std::size_t left() const noexcept { return bytes_.size(); }
    template <class Number>
    Number number() noexcept {
        std::uint64_t value = 0;
        for (const std::uint8_t byte : take(sizeof(Number)))
            value = value << 8 | byte;
        return static_cast<Number>(value);
    }
    /// Up to its first zero.
    std::string text(std::size_t length) {
        const std::span<const std::uint8_t> field = take(length);
        return {field.begin(), std::find(field.begin(), field.end(), 0)};
    }
    std::span<const std::uint8_t> take(std::size_t length) noexcept {
        const std::span<const std::uint8_t> taken = bytes_.first(length);
        bytes_ = bytes_.subspan(length);
        return taken;
    }

private:
    std::span<const std::uint8_t> bytes_;
};

/// Header, content and metadata in the order of version two.
IgtlBytes body_of(const IgtlMessage& message) {
    if (message.version == IgtlVersion::one) return message.content;
    IgtlBytes table;
    IgtlBytes pairs;
    put(table, static_cast<std::uint16_t>(message.metadata.size()));
    for (const auto& [key, value] : message.metadata) {
        put(table, static_cast<std::uint16_t>(key.size()));
        put(table, is_ascii(value) ? kAscii : kUtf8);
        put(table, static_cast<std::uint32_t>(value.size()));
        put_text(pairs, key);
        put_text(pairs, value);
    }
    IgtlBytes body;
    body.reserve(kExtendedHeader + message.content.size() + table.size() + pairs.size());
    put(body, static_cast<std::uint16_t>(kExtendedHeader));
    put(body, static_cast<std::uint16_t>(table.size()));
    put(body, static_cast<std::uint32_t>(pairs.size()));
    put(body, message.id);
    body.insert(body.end(), message.content.begin(), message.content.end());
    body.insert(body.end(), table.begin(), table.end());
    body.insert(body.end(), pairs.begin(), pairs.end());
    return body;
}

/// False where its sizes do not fit.
bool read_metadata(Front table, Front pairs,
                   std::vector<std::pair<std::string, std::string>>& metadata) {
    if (table.left() == 0) return true; // some senders leave it out where there is none
    if (table.left() < sizeof(std::uint16_t)) return false;
    const auto count = table.number<std::uint16_t>();
    if (table.left() != count * kMetadataEntry) return false;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t key_bytes = table.number<std::uint16_t>();
        table.number<std::uint16_t>(); // the encoding: bytes are kept as they are
        const std::size_t value_bytes = table.number<std::uint32_t>();
        if (pairs.left() < key_bytes + value_bytes) return false;
        const std::span<const std::uint8_t> key = pairs.take(key_bytes);
        const std::span<const std::uint8_t> value = pairs.take(value_bytes);
        metadata.emplace_back(std::string(key.begin(), key.end()),
                              std::string(value.begin(), value.end()));
    }
    return true;
}

/// LPS to RAS, and back. No zero gets a sign.
Vec3 turned(const Vec3& vector) noexcept { return {0.0 - vector.x, 0.0 - vector.y, vector.z}; }

/// D R D of the columns of R.
Mat3 turned(const Mat3& rotation) noexcept {
    const Vec3 zero{0.0};
    return {zero - turned(rotation[0]), zero - turned(rotation[1]), turned(rotation[2])};
}

IgtlTransform transform_of(const Mat3& columns, const Vec3& last) noexcept {
    IgtlTransform transform;
    std::size_t at = 0;
    for (const Vec3& column : {columns[0], columns[1], columns[2], last})
        for (int row = 0; row < 3; ++row)
            transform.values[at++] = static_cast<float>(column[row]);
    return transform;
}

} // namespace

std::uint64_t igtl_crc64(std::span<const std::uint8_t> bytes, std::uint64_t crc) noexcept {
    for (const std::uint8_t byte : bytes)
        crc = kCrcTable[(crc >> 56) ^ byte] ^ (crc << 8);
    return crc;
}

std::uint64_t igtl_time(double seconds) noexcept {
    constexpr double kEnd = 4294967296.0; // 2^32 s: in the year 2106
    if (!(seconds >= 0.0 && seconds < kEnd)) return 0;
    const double whole = std::floor(seconds);
    return static_cast<std::uint64_t>(whole) << 32 |
           static_cast<std::uint64_t>((seconds - whole) * kEnd);
}

IgtlBytes igtl_bytes(const IgtlMessage& message) {
    const IgtlBytes body = body_of(message);
    IgtlBytes bytes;
    bytes.reserve(kIgtlHeader + body.size());
    put(bytes, static_cast<std::uint16_t>(message.version));
    put_field(bytes, message.type, kIgtlLongestType);
    put_field(bytes, message.device, kIgtlLongestName);
    put(bytes, message.time);
    put(bytes, static_cast<std::uint64_t>(body.size()));
    put(bytes, igtl_crc64(body));
    bytes.insert(bytes.end(), body.begin(), body.end());
    return bytes;
}

std::optional<IgtlHeader> read_igtl_header(std::span<const std::uint8_t, kIgtlHeader> bytes) {
    Front front(bytes);
    const auto version = front.number<std::uint16_t>();
    if (version != 1 && version != 2) return std::nullopt;
    IgtlHeader header;
    header.version = static_cast<IgtlVersion>(version);
    header.type = front.text(kIgtlLongestType);
    header.device = front.text(kIgtlLongestName);
    header.time = front.number<std::uint64_t>();
    header.body_bytes = front.number<std::uint64_t>();
    header.crc = front.number<std::uint64_t>();
    const bool is_name = !header.type.empty() && std::ranges::all_of(header.type, [](char one) {
        return one > ' ' && one <= '~';
    });
    if (!is_name) return std::nullopt;
    return header;
}

std::optional<IgtlMessage> read_igtl_body(const IgtlHeader& header,
                                          std::span<const std::uint8_t> body) {
    if (body.size() != header.body_bytes || igtl_crc64(body) != header.crc) return std::nullopt;
    IgtlMessage message;
    message.version = header.version;
    message.type = header.type;
    message.device = header.device;
    message.time = header.time;
    if (header.version == IgtlVersion::one) {
        message.content.assign(body.begin(), body.end());
        return message;
    }
    if (body.size() < kExtendedHeader) return std::nullopt;
    Front front(body);
    const std::size_t extended = front.number<std::uint16_t>();
    const std::size_t table = front.number<std::uint16_t>();
    const std::size_t pairs = front.number<std::uint32_t>();
    message.id = front.number<std::uint32_t>();
    if (extended < kExtendedHeader || extended + table + pairs > body.size()) return std::nullopt;
    const auto content = body.subspan(extended, body.size() - extended - table - pairs);
    message.content.assign(content.begin(), content.end());
    if (!read_metadata(Front(body.last(table + pairs).first(table)), Front(body.last(pairs)),
                       message.metadata))
        return std::nullopt;
    return message;
}

IgtlTransform igtl_pose(const ToolPose& pose) noexcept {
    constexpr double kMmPerM = 1e3;
    return transform_of(turned(glm::mat3_cast(pose.orientation)), kMmPerM * turned(pose.position));
}

IgtlTransform igtl_vector(const Vec3& vector, double factor) noexcept {
    return transform_of(Mat3(1.0), factor * turned(vector));
}

std::optional<ToolPose> tool_pose(const IgtlTransform& transform) noexcept {
    constexpr double kFarthest_mm = 1e6;
    constexpr double kRounding = 0.01; // of a rotation's elements, in a stream of floats
    const auto column = [&](std::size_t i) {
        return Vec3(transform.values[3 * i], transform.values[3 * i + 1],
                    transform.values[3 * i + 2]);
    };
    const Mat3 rotation(column(0), column(1), column(2));
    const Mat3 unit = glm::transpose(rotation) * rotation;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(unit[i][j] - (i == j ? 1.0 : 0.0)) <= kRounding)) return std::nullopt;
    const Vec3 place_mm = column(3);
    if (!is_finite(place_mm) || glm::length(place_mm) > kFarthest_mm ||
        glm::determinant(rotation) < 0.0)
        return std::nullopt;
    return ToolPose{1e-3 * turned(place_mm), glm::normalize(glm::quat_cast(turned(rotation)))};
}

IgtlBytes igtl_transform_content(const IgtlTransform& transform) {
    IgtlBytes content;
    content.reserve(kTransform);
    for (const float value : transform.values)
        put_float(content, value);
    return content;
}

std::optional<IgtlTransform> read_igtl_transform(std::span<const std::uint8_t> content) {
    if (content.size() != kTransform) return std::nullopt;
    Front front(content);
    IgtlTransform transform;
    for (float& value : transform.values)
        value = std::bit_cast<float>(front.number<std::uint32_t>());
    return transform;
}

IgtlBytes igtl_status_content(const IgtlStatus& status) {
    IgtlBytes content;
    put(content, status.code);
    put(content, static_cast<std::uint64_t>(status.subcode));
    put_field(content, status.name, kIgtlLongestName);
    put_text(content, status.words);
    content.push_back(0);
    return content;
}

std::optional<IgtlStatus> read_igtl_status(std::span<const std::uint8_t> content) {
    if (content.size() < kStatusHead) return std::nullopt;
    Front front(content);
    IgtlStatus status;
    status.code = front.number<std::uint16_t>();
    status.subcode = static_cast<std::int64_t>(front.number<std::uint64_t>());
    status.name = front.text(kIgtlLongestName);
    status.words = front.text(front.left());
    return status;
}

IgtlBytes igtl_poly_data_content(const TriangleMesh& mesh, const std::array<float, 4>& rgba) {
    constexpr std::uint8_t kPointRgba = 0x04;
    constexpr std::string_view kName = "RGBA";
    constexpr std::size_t kNumbers = 4; // bytes of each: uint32 and float32
    constexpr double kMmPerM = 1e3;
    const auto points = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto polygons = static_cast<std::uint32_t>(mesh.triangles.size());
    IgtlBytes content;
    content.reserve(10 * kNumbers + kNumbers * (std::size_t{points} * (3 + 4)) +
                    kNumbers * (std::size_t{polygons} * 4) + 12);
    put(content, points);
    for (int kind = 0; kind < 2; ++kind) { // vertices and lines: how many, and their bytes
        put(content, std::uint32_t{0});
        put(content, std::uint32_t{0});
    }
    put(content, polygons);
    put(content, static_cast<std::uint32_t>(std::size_t{polygons} * 4 * kNumbers));
    put(content, std::uint32_t{0}); // strips
    put(content, std::uint32_t{0});
    put(content, std::uint32_t{1}); // attributes
    for (const Vec3& vertex : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis)
            put_float(content, static_cast<float>(kMmPerM * turned(vertex)[axis]));
    for (const auto& triangle : mesh.triangles) {
        put(content, std::uint32_t{3});
        for (const std::uint32_t vertex : triangle)
            put(content, vertex);
    }
    content.push_back(kPointRgba);
    content.push_back(static_cast<std::uint8_t>(rgba.size()));
    put(content, points);
    put_text(content, kName);
    content.push_back(0);
    if (kName.size() % 2 == 0) content.push_back(0); // names end at an even byte
    for (std::uint32_t point = 0; point < points; ++point)
        for (const float part : rgba)
            put_float(content, part);
    return content;
}

} // namespace palpate
