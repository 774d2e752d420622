// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/igtl_message.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// Bytes as the specification's field tables put them together: a second way to write messages,
/// which shares nothing with the first.
class Fields {
public:
    Fields& number(std::uint64_t value, std::size_t bytes) {
        for (std::size_t i = bytes; i-- > 0;)
            bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i) & 0xFF));
        return *this;
    }
    Fields& real(float value) {
        std::uint32_t bits = 0;
        std::memcpy(&bits, &value, sizeof bits);
        return number(bits, 4);
    }
    Fields& text(std::string_view text, std::size_t length) {
        for (std::size_t i = 0; i < length; ++i)
            bytes_.push_back(i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0);
        return *this;
    }
    Fields& add(const Fields& other) {
        bytes_.insert(bytes_.end(), other.bytes_.begin(), other.bytes_.end());
        return *this;
    }
    const IgtlBytes& bytes() const { return bytes_; }

private:
    IgtlBytes bytes_;
};

/// Header and body with a checksum that somebody else has computed.
IgtlBytes message(unsigned version, std::string_view type, std::string_view device,
                  std::uint64_t time, std::uint64_t crc, const Fields& body) {
    return Fields()
        .number(version, 2)
        .text(type, 12)
        .text(device, 20)
        .number(time, 8)
        .number(body.bytes().size(), 8)
        .number(crc, 8)
        .add(body)
        .bytes();
}

/// The same, with the checksum of its body.
IgtlBytes message(unsigned version, std::string_view type, const Fields& body) {
    return message(version, type, "Device", 7, igtl_crc64(body.bytes()), body);
}

std::optional<IgtlMessage> read(const IgtlBytes& bytes) {
    if (bytes.size() < kIgtlHeader) return std::nullopt;
    const std::span<const std::uint8_t> all(bytes);
    const auto header = read_igtl_header(all.first<kIgtlHeader>());
    return header ? read_igtl_body(*header, all.subspan(kIgtlHeader)) : std::nullopt;
}

/// The matrix of the specification's examples, as the bits of its floats.
constexpr std::array<std::uint32_t, 12> kExampleBits{
    0xBF7473CD, 0x3E4959E6, 0xBE63DD98, 0xBE4959E6, 0x3E12491B, 0x3F7852D6,
    0x3E63DD98, 0x3F7852D6, 0xBDC830AE, 0x42383660, 0x419BC467, 0x42383660};

IgtlTransform example_transform() {
    IgtlTransform transform;
    for (std::size_t i = 0; i < kExampleBits.size(); ++i)
        transform.values[i] = std::bit_cast<float>(kExampleBits[i]);
    return transform;
}

Fields example_matrix() {
    Fields fields;
    for (const std::uint32_t bits : kExampleBits)
        fields.number(bits, 4);
    return fields;
}

TEST(IgtlMessage, ChecksumIsThatOfEcma182) {
    const std::string_view text = "123456789";
    const IgtlBytes bytes(text.begin(), text.end());
    EXPECT_EQ(igtl_crc64(bytes), 0x6C40DF5F0B497347u); // the catalogue's check value
    EXPECT_EQ(igtl_crc64({}), 0u);
    // In two halves, and bit by bit.
    const std::span<const std::uint8_t> all(bytes);
    EXPECT_EQ(igtl_crc64(all.subspan(4), igtl_crc64(all.first(4))), igtl_crc64(bytes));
    std::uint64_t rest = 0;
    for (const std::uint8_t byte : bytes)
        for (int bit = 7; bit >= 0; --bit) {
            const bool is_odd = ((rest >> 63) ^ (byte >> bit & 1u)) != 0;
            rest = rest << 1 ^ (is_odd ? 0x42F0E1EBA9EA3693u : 0u);
        }
    EXPECT_EQ(rest, igtl_crc64(bytes));
}

// Fields and checksums of the examples in the specification's own tests.
TEST(IgtlMessage, TransformsAreTheExamplesOfTheSpecification) {
    IgtlMessage sent;
    sent.version = IgtlVersion::one;
    sent.type = "TRANSFORM";
    sent.device = "DeviceName";
    sent.time = 1234567890;
    sent.content = igtl_transform_content(example_transform());
    EXPECT_EQ(igtl_bytes(sent), message(1, "TRANSFORM", "DeviceName", 1234567890,
                                        0xF6DD2B8EB4DF6DD2u, example_matrix()));

    sent.version = IgtlVersion::two;
    sent.time = 1234567892;
    sent.id = 1;
    sent.metadata = {{"First patient age", "22"}, {"Second patient age", "25"}};
    Fields body;
    body.number(12, 2).number(18, 2).number(39, 4).number(1, 4).add(example_matrix());
    body.number(2, 2).number(17, 2).number(3, 2).number(2, 4).number(18, 2).number(3, 2).number(2,
                                                                                                4);
    body.text("First patient age22Second patient age25", 39);
    EXPECT_EQ(igtl_bytes(sent),
              message(2, "TRANSFORM", "DeviceName", 1234567892, 0xF698F64FDAE266DDu, body));
    const auto back = read(igtl_bytes(sent));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->metadata, sent.metadata);
    EXPECT_EQ(read_igtl_transform(back->content), example_transform());
}

TEST(IgtlMessage, StatusIsTheExampleOfTheSpecification) {
    IgtlMessage sent;
    sent.version = IgtlVersion::one;
    sent.type = "STATUS";
    sent.device = "DeviceName";
    sent.time = 1234567892;
    sent.content = igtl_status_content({15, 10, "ACTUATOR_DISABLED", "Actuator A is disabled."});
    const Fields body = Fields()
                            .number(15, 2)
                            .number(10, 8)
                            .text("ACTUATOR_DISABLED", 20)
                            .text("Actuator A is disabled.", 24);
    EXPECT_EQ(igtl_bytes(sent),
              message(1, "STATUS", "DeviceName", 1234567892, 0x98EE43EED8E431CFu, body));
    const auto back = read_igtl_status(sent.content);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->code, 15);
    EXPECT_EQ(back->subcode, 10);
    EXPECT_EQ(back->name, "ACTUATOR_DISABLED");
    EXPECT_EQ(back->words, "Actuator A is disabled.");
    EXPECT_FALSE(read_igtl_status(std::span(sent.content).first(29)));
}

/// A POLYDATA by the field table: points, polygons of equal length, one attribute.
Fields poly_data(const std::vector<std::array<float, 3>>& points,
                 const std::vector<std::vector<std::uint32_t>>& polygons, unsigned type,
                 unsigned components, std::string_view name, const std::vector<float>& values) {
    Fields fields;
    fields.number(points.size(), 4);
    for (int i = 0; i < 4; ++i) // vertices and lines
        fields.number(0, 4);
    std::uint64_t bytes = 0;
    for (const auto& polygon : polygons)
        bytes += 4 * (polygon.size() + 1);
    fields.number(polygons.size(), 4).number(bytes, 4);
    fields.number(0, 4).number(0, 4).number(1, 4);
    for (const auto& point : points)
        for (const float part : point)
            fields.real(part);
    for (const auto& polygon : polygons) {
        fields.number(polygon.size(), 4);
        for (const std::uint32_t vertex : polygon)
            fields.number(vertex, 4);
    }
    fields.number(type, 1).number(components, 1).number(values.size() / components, 4);
    const std::size_t with_zero = name.size() + 1;
    fields.text(name, with_zero + with_zero % 2);
    for (const float value : values)
        fields.real(value);
    return fields;
}

TEST(IgtlMessage, PolyDataIsWrittenByTheFieldTableOfTheSpecification) {
    // The table as it is written down here has the checksum of the specification's cube.
    const std::vector<std::array<float, 3>> corners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                    {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const Fields cube = poly_data(
        corners,
        {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}, 0, 1,
        "attr", {0, 1, 2, 3, 4, 5, 6, 7});
    ASSERT_EQ(cube.bytes().size(), 300u);
    ASSERT_EQ(igtl_crc64(cube.bytes()), 0x73DDDFC80C48C62Bu);

    // By that table: a triangle and its colour, in RAS and mm.
    const TriangleMesh mesh{{{0.01, 0.02, 0.03}, {0.0, 0.5, -0.25}, {-1.0, 0.0, 0.125}},
                            {{0, 1, 2}, {2, 1, 0}}};
    const std::array<float, 4> rgba{0.25f, 0.5f, 0.75f, 1.0f};
    std::vector<float> colors;
    for (int point = 0; point < 3; ++point)
        colors.insert(colors.end(), rgba.begin(), rgba.end());
    EXPECT_EQ(igtl_poly_data_content(mesh, rgba),
              poly_data({{-10, -20, 30}, {0, -500, -250}, {1000, 0, 125}}, {{0, 1, 2}, {2, 1, 0}},
                        0x04, 4, "RGBA", colors)
                  .bytes());
    EXPECT_EQ(igtl_poly_data_content({}, rgba), poly_data({}, {}, 4, 4, "RGBA", {}).bytes());
}

TEST(IgtlMessage, WhatIsWrittenIsReadBack) {
    std::mt19937 random(20261124); // the seed
    const auto any = [&](unsigned most) { return random() % (most + 1); };
    for (int i = 0; i < 500; ++i) {
        IgtlMessage sent;
        sent.version = any(1) == 0 ? IgtlVersion::one : IgtlVersion::two;
        sent.type = std::string(1 + any(11), static_cast<char>('A' + any(25)));
        sent.device = std::string(any(20), static_cast<char>('a' + any(25)));
        sent.time = std::uint64_t{random()} << 32 | random();
        sent.content.resize(any(300));
        for (std::uint8_t& byte : sent.content)
            byte = static_cast<std::uint8_t>(any(255));
        if (sent.version == IgtlVersion::two) {
            sent.id = static_cast<std::uint32_t>(random());
            for (unsigned pair = any(3); pair > 0; --pair)
                sent.metadata.emplace_back(std::string(any(30), 'k'), std::string(any(300), 'v'));
        }
        const auto back = read(igtl_bytes(sent));
        ASSERT_TRUE(back) << i;
        EXPECT_EQ(back->version, sent.version);
        EXPECT_EQ(back->type, sent.type);
        EXPECT_EQ(back->device, sent.device);
        EXPECT_EQ(back->time, sent.time);
        EXPECT_EQ(back->id, sent.id);
        EXPECT_EQ(back->metadata, sent.metadata);
        EXPECT_EQ(back->content, sent.content);
    }
}

TEST(IgtlMessage, NoBitOfABodyMayChange) {
    IgtlMessage sent;
    sent.type = "TRANSFORM";
    sent.metadata = {{"unit", "mm"}};
    sent.content = igtl_transform_content({});
    const IgtlBytes bytes = igtl_bytes(sent);
    for (std::size_t at = kIgtlHeader; at < bytes.size(); ++at)
        for (int bit = 0; bit < 8; ++bit) {
            IgtlBytes changed = bytes;
            changed[at] ^= static_cast<std::uint8_t>(1 << bit);
            EXPECT_FALSE(read(changed)) << at << ", " << bit;
        }
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(read({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}));
}

TEST(IgtlMessage, SizesThatDoNotFitAreFaulty) {
    const auto with = [](std::uint64_t extended, std::uint64_t table, std::uint64_t pairs,
                         std::uint64_t count, std::uint64_t key, std::uint64_t value) {
        return message(2, "STRING",
                       Fields()
                           .number(extended, 2)
                           .number(table, 2)
                           .number(pairs, 4)
                           .number(0, 4)
                           .text("content", 7)
                           .number(count, 2)
                           .number(key, 2)
                           .number(3, 2)
                           .number(value, 4)
                           .text("kv", 2));
    };
    const auto right = read(with(12, 10, 2, 1, 1, 1));
    ASSERT_TRUE(right);
    EXPECT_EQ(right->content.size(), 7u);
    // A longer extended header is of a version to come: what it adds is passed over.
    ASSERT_TRUE(read(with(14, 10, 2, 1, 1, 1)));
    EXPECT_EQ(read(with(14, 10, 2, 1, 1, 1))->content.size(), 5u);
    EXPECT_TRUE(read(with(12, 0, 0, 1, 1, 1))); // without metadata: all of it is content
    EXPECT_FALSE(read(with(11, 10, 2, 1, 1, 1)));
    EXPECT_FALSE(read(with(0, 10, 2, 1, 1, 1)));
    EXPECT_FALSE(read(with(0xFFFF, 10, 2, 1, 1, 1)));
    EXPECT_FALSE(read(with(12, 0xFFFF, 2, 1, 1, 1)));
    EXPECT_FALSE(read(with(12, 10, 0xFFFFFFFF, 1, 1, 1)));
    EXPECT_FALSE(read(with(12, 1, 2, 1, 1, 1)));
    EXPECT_FALSE(read(with(12, 10, 2, 2, 1, 1)));
    EXPECT_FALSE(read(with(12, 10, 2, 0xFFFF, 1, 1)));
    EXPECT_FALSE(read(with(12, 10, 2, 1, 0xFFFF, 1)));
    EXPECT_FALSE(read(with(12, 10, 2, 1, 1, 0xFFFFFFFF)));
    EXPECT_FALSE(read(message(2, "STRING", Fields().text("too short", 9))));
}

TEST(IgtlMessage, WhatBeginsNoMessageIsNoHeader) {
    const auto is_header = [](unsigned version, std::string_view type) {
        return read(message(version, type, Fields())).has_value();
    };
    EXPECT_TRUE(is_header(1, "STATUS"));
    EXPECT_TRUE(is_header(1, "ABCDEFGHIJKL"));
    EXPECT_FALSE(is_header(0, "STATUS"));
    EXPECT_FALSE(is_header(3, "STATUS"));
    EXPECT_FALSE(is_header(0x4745, "T / HTTP/1.1"));
    EXPECT_FALSE(is_header(1, ""));
    EXPECT_FALSE(is_header(1, "STA\x01"));
    EXPECT_FALSE(is_header(1, "STA\xE4"));
}

TEST(IgtlMessage, NamesThatAreTooLongAreCutBetweenCharacters) {
    IgtlMessage sent;
    sent.type = "ABCDEFGHIJKLM";
    sent.device = "1234567890123456789\xC3\xA4"; // an umlaut of which one byte would fit
    const auto back = read(igtl_bytes(sent));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->type, "ABCDEFGHIJKL");
    EXPECT_EQ(back->device, "1234567890123456789");
}

TEST(IgtlMessage, TimeIsSecondsAndTheirFraction) {
    EXPECT_EQ(igtl_time(1.5), 0x180000000u);
    EXPECT_EQ(igtl_time(1234567890.25) >> 32, 1234567890u);
    EXPECT_EQ(igtl_time(1234567890.25) & 0xFFFFFFFFu, 0x40000000u);
    EXPECT_EQ(igtl_time(-1.0), 0u);
    EXPECT_EQ(igtl_time(5e9), 0u);
    EXPECT_EQ(igtl_time(std::numeric_limits<double>::quiet_NaN()), 0u);
}

TEST(IgtlMessage, APoseGoesToRasAndBack) {
    const IgtlTransform at = igtl_pose({{0.010, 0.020, 0.030}, {1.0, 0.0, 0.0, 0.0}});
    EXPECT_EQ(at.values, (std::array<float, 12>{1, 0, 0, 0, 1, 0, 0, 0, 1, -10, -20, 30}));
    // A quarter of a turn from patient left (x) to posterior (y) turns, in RAS, right to anterior:
    // from x to y as well. One from left to superior turns x to z, and in RAS -x to z.
    const double half = std::numbers::sqrt2 / 2.0;
    EXPECT_NEAR(igtl_pose({{}, {half, 0.0, 0.0, half}}).values[1], 1.0, 1e-6);
    EXPECT_NEAR(igtl_pose({{}, {half, 0.0, -half, 0.0}}).values[2], -1.0, 1e-6);

    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 200; ++i) {
        const ToolPose sent{{0.1 * normal(random), 0.1 * normal(random), 0.1 * normal(random)},
                            glm::normalize(Quaternion(normal(random), normal(random),
                                                      normal(random), normal(random)))};
        const auto back = tool_pose(igtl_pose(sent));
        ASSERT_TRUE(back) << i;
        // Floats of up to 500 mm are rounded by 2^-25 of them, in each coordinate.
        EXPECT_LT(glm::length(back->position - sent.position), 3e-8) << i;
        // Elements are rounded by 2^-25, so the angle is wrong by a few times that.
        EXPECT_GT(std::abs(glm::dot(back->orientation, sent.orientation)), 1.0 - 1e-12) << i;
    }
}

TEST(IgtlMessage, WhatIsNoPoseIsRefused) {
    const auto with = [](std::size_t place, float value) {
        IgtlTransform transform;
        transform.values[place] = value;
        return transform;
    };
    EXPECT_TRUE(tool_pose({}));
    EXPECT_TRUE(tool_pose(with(9, -999'000.0f)));
    EXPECT_FALSE(tool_pose(with(9, 1'001'000.0f)));
    for (std::size_t place = 0; place < 12; ++place) {
        EXPECT_FALSE(tool_pose(with(place, std::numeric_limits<float>::quiet_NaN()))) << place;
        EXPECT_FALSE(tool_pose(with(place, std::numeric_limits<float>::infinity()))) << place;
    }
    EXPECT_FALSE(tool_pose(with(0, 1.1f)));  // scaled
    EXPECT_FALSE(tool_pose(with(1, 0.1f)));  // sheared
    EXPECT_FALSE(tool_pose(with(8, -1.0f))); // mirrored
    EXPECT_TRUE(tool_pose(with(0, 1.004f))); // rounded
    EXPECT_FALSE(read_igtl_transform(IgtlBytes(47)));
    EXPECT_FALSE(read_igtl_transform(IgtlBytes(49)));
}

TEST(IgtlMessage, AForceKeepsItsNewtons) {
    EXPECT_EQ(igtl_vector({1.0, 2.0, 3.0}, 1.0).values,
              (std::array<float, 12>{1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -2, 3}));
    EXPECT_EQ(igtl_vector({0.001, 0.0, -0.5}, 1e3).values[9], -1.0f); // m/s in mm/s
    EXPECT_EQ(igtl_vector({0.001, 0.0, -0.5}, 1e3).values[11], -500.0f);
}

} // namespace
} // namespace palpate
