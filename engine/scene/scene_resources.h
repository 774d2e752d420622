// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/files/result_cache.h>
#include <palpate/geometry/isosurface.h>

namespace palpate {

/// What building a scene may use besides its description.
struct SceneResources {
    ResultCache cache;           ///< of baked fields and meshes; as it begins: none is kept
    IsosurfaceExtractor extract; ///< extract_isosurface of palpate::extraction, or empty: then only
                                 ///< meshes from files and from the cache
    Progress progress;           ///< may be empty
};

} // namespace palpate
