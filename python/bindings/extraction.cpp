// SPDX-License-Identifier: Apache-2.0
// Linked with palpate::extraction, and so with CGAL: this module is GPL-3+ as a whole.
#include <pybind11/pybind11.h>

#include <palpate/geometry/isosurface.h>

PYBIND11_MODULE(_extraction, module) {
    static const palpate::IsosurfaceExtractor extractor = palpate::extract_isosurface;
    module.doc() = "Meshes of isosurfaces by CGAL, for the scenes of palpate. GPL-3+ as a whole.";
    module.attr("extractor") = pybind11::capsule(&extractor, "palpate.IsosurfaceExtractor");
}
