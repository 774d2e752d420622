// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/geometry/isosurface.h>

namespace palpate {

class SceneFiles;

/// What building a scene may use besides its description.
struct SceneResources {
    std::shared_ptr<const SceneFiles> files; ///< scene_files() of palpate::files, or null: then no
                                             ///< scene with a file, or surfaces of voxels in memory
    IsosurfaceExtractor extract = {}; ///< extract_isosurface of palpate::extraction, or empty: then
                                      ///< only meshes from files and from the cache
    Progress progress = {};           ///< may be empty
};

/// Whether meshes can be extracted from volumes: where SceneResources::extract is set.
enum class Extraction { possible, impossible };

} // namespace palpate
