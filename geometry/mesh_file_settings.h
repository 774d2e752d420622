// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

enum class MeshFrame { as_stated, lps, ras };         ///< as_stated: what the file says, else LPS
enum class MeshUnit { as_stated, millimetre, metre }; ///< as_stated: what the file says, else mm

/// How a mesh file is to be understood where it does not say so itself, or says it wrongly.
struct MeshFileSettings {
    MeshFrame frame = MeshFrame::as_stated;
    MeshUnit unit = MeshUnit::as_stated;
};

} // namespace palpate
