// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/geometry/formats/internal/mesh_source.h>
#include <palpate/geometry/formats/internal/vtk_data.h>

namespace palpate::internal {

/// How the arrays of an XML file are stored.
struct VtpCoding {
    ByteOrder order = ByteOrder::little;
    std::size_t header_bytes = 4; ///< of each number before an array: 4 or 8
    bool is_deflated = false;     ///< in blocks, by zlib
};

/// Where the bytes of an array stand.
struct VtpPlace {
    enum class Text { base64, raw };
    Text text = Text::base64;
    std::string_view bytes; ///< from the array's header on; more may follow
    std::size_t at = 0;     ///< byte of the file, for messages
};

/// The bytes of an array that stands behind its header. Throws as MeshSource::fail_at(): it ends
/// before they do, is no base64, does not inflate, or would inflate to more than `most`.  [setup]
std::string vtp_bytes(const MeshSource& source, const VtpPlace& place, const VtpCoding& coding,
                      std::size_t most);

} // namespace palpate::internal
