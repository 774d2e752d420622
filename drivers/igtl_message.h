// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>
#include <palpate/geometry/vec.h>

/// The wire format of OpenIGTLink, after its specification (protocol versions 1 to 3:
/// openigtlink/OpenIGTLink, Documents/Protocol). Pure functions of bytes: no socket, no clock.
/// Every number is big endian. Frames are RAS in mm, as 3D Slicer's are.
namespace palpate {

/// Bytes of a message, or of a part of one.
using IgtlBytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kIgtlHeader = 58;         ///< bytes of a header
inline constexpr std::size_t kIgtlLongestType = 12;    ///< bytes of a type's name
inline constexpr std::size_t kIgtlLongestName = 20;    ///< bytes of a device's name
inline constexpr std::uint16_t kIgtlUsualPort = 18944; ///< that servers of OpenIGTLink have

/// Of a message's header. The protocol's version 3 has headers of version 2.
enum class IgtlVersion : std::uint16_t {
    one = 1, ///< the body is the content
    two = 2  ///< the body is an extended header, the content, and pairs of key and value
};

/// A message as it is meant.
struct IgtlMessage {
    IgtlVersion version = IgtlVersion::two; ///< of its header
    std::string type;                       ///< as "TRANSFORM"; of a query "GET_STATUS"
    std::string device;                     ///< whose data these are; may be empty
    std::uint64_t time = 0; ///< seconds since 1970 in the upper 32 bits, 2^-32 s in the lower; 0:
                            ///< none
    std::uint32_t id = 0;   ///< of version two: the sender's own number
    std::vector<std::pair<std::string, std::string>> metadata; ///< of version two: key and value
    IgtlBytes content;                                         ///< what the type says
};

/// What a header says, before the body has come.
struct IgtlHeader {
    IgtlVersion version = IgtlVersion::one; ///< 1 or 2
    std::string type;                       ///< printable ASCII, not empty
    std::string device;                     ///< printable ASCII or UTF-8, as sent; may be empty
    std::uint64_t time = 0;                 ///< as IgtlMessage::time
    std::uint64_t body_bytes = 0;           ///< that follow
    std::uint64_t crc = 0;                  ///< of these
};

/// CRC-64 of ECMA-182, not reflected, from 0: of "123456789" 0x6C40DF5F0B497347. `crc`: of the
/// bytes before. [any]
std::uint64_t igtl_crc64(std::span<const std::uint8_t> bytes, std::uint64_t crc = 0) noexcept;

/// A time of the clock in s since 1970 as messages have it; 0 of one that is no such time. [any]
std::uint64_t igtl_time(double seconds) noexcept;

/// The bytes of a message. Names that are too long are cut, at the end of a character of UTF-8;
/// metadata that version one cannot have are left out. Their values are UTF-8, said to be ASCII
/// where they are (IANA's numbers 106 and 3). [setup]
IgtlBytes igtl_bytes(const IgtlMessage& message);

/// A header's fields; nothing where these bytes begin no message: another version, a type that is
/// no name.                                                                             [setup]
std::optional<IgtlHeader> read_igtl_header(std::span<const std::uint8_t, kIgtlHeader> bytes);

/// A message of its header and its whole body. Nothing where the checksum is another one, or the
/// sizes in the extended header and the metadata do not fit the body.                   [setup]
std::optional<IgtlMessage> read_igtl_body(const IgtlHeader& header,
                                          std::span<const std::uint8_t> body);

/// The content of a TRANSFORM: the columns of a 3 x 4 matrix, RAS, mm in the last one.
struct IgtlTransform {
    std::array<float, 12> values{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}; ///< R11 R21 R31 R12 .. TZ
    bool operator==(const IgtlTransform&) const = default;            ///< the same numbers
};

/// Where a tool is, and how it is turned.
struct ToolPose {
    Vec3 position{0.0};                         ///< m, scene frame (LPS)
    Quaternion orientation{1.0, 0.0, 0.0, 0.0}; ///< tool to scene frame
};

/// A pose as a TRANSFORM: D R D and 1e3 D p with D = diag(-1, -1, 1), which turns LPS to RAS and
/// back. The tool's own axes turn along, as in the transforms that 3D Slicer reads from files, so
/// that no rotation stays none.                                                           [any]
IgtlTransform igtl_pose(const ToolPose& pose) noexcept;

/// A vector of the scene frame (LPS) in the last column, in RAS, times `factor`, beside no
/// rotation: how PLUS sends velocities (factor 1e3: mm/s) and forces (factor 1: N). [any]
IgtlTransform igtl_vector(const Vec3& vector, double factor) noexcept;

/// The pose of a TRANSFORM. Nothing where a number is none, the place is more than 1 km away, or
/// the columns are no rotation, to 1 %: such a tool is nowhere.                            [any]
std::optional<ToolPose> tool_pose(const IgtlTransform& transform) noexcept;

/// Content of a TRANSFORM, 48 bytes.                                                     [setup]
IgtlBytes igtl_transform_content(const IgtlTransform& transform);
/// The same back; nothing of another number of bytes.                                    [setup]
std::optional<IgtlTransform> read_igtl_transform(std::span<const std::uint8_t> content);

/// The content of a STATUS.
struct IgtlStatus {
    static constexpr std::uint16_t kOk = 1; ///< the code of a device that works
    std::uint16_t code = kOk;               ///< as the specification numbers them
    std::int64_t subcode = 0;               ///< the sender's own
    std::string name;                       ///< of the error; at most 20 bytes
    std::string words;                      ///< for people
};

/// Content of a STATUS: 30 bytes, the words and a zero.                                  [setup]
IgtlBytes igtl_status_content(const IgtlStatus& status);
/// The same back; nothing where there are less than 30 bytes.                            [setup]
std::optional<IgtlStatus> read_igtl_status(std::span<const std::uint8_t> content);

/// Content of a POLYDATA: points (RAS, mm), triangles, and a colour for each point, by the name
/// "RGBA", of four numbers from 0 to 1. Triangles keep their order of vertices: RAS is LPS turned
/// by half a turn, which mirrors nothing.                                                [setup]
IgtlBytes igtl_poly_data_content(const TriangleMesh& mesh, const std::array<float, 4>& rgba);

} // namespace palpate
