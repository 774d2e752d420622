// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

/// The axes of a mesh file; as_stated: what the file says, else LPS.
enum class MeshFrame { as_stated, lps, ras };
/// The unit of length of a mesh file; as_stated: what the file says, else millimetres.
enum class MeshUnit { as_stated, millimetre, metre };

/// How a mesh file is to be understood where it does not say so itself, or says it wrongly.
struct MeshFileSettings {
    MeshFrame frame = MeshFrame::as_stated; ///< of its positions
    MeshUnit unit = MeshUnit::as_stated;    ///< of its positions
};

} // namespace palpate
