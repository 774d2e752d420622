// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/isosurface.h>

/// What palpate_scene_options.extractor points to.
struct palpate_extractor {
    palpate::IsosurfaceExtractor extract;
};
