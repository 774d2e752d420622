// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <palpate/geometry/isosurface.h>

namespace palpate {

/// What building a scene may use besides its description.
struct SceneResources {
    std::filesystem::path cache; ///< folder for baked fields and meshes; empty: none is kept
    IsosurfaceExtractor extract; ///< extract_isosurface of palpate::extraction, or empty: then only
                                 ///< meshes from files and from the cache
    Progress progress;           ///< may be empty
};

} // namespace palpate
