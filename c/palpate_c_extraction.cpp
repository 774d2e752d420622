// SPDX-License-Identifier: Apache-2.0
#include <palpate/palpate_c_extraction.h>

#include <palpate/c/internal/extractor.h>

const palpate_extractor* palpate_cgal_extractor() {
    static const palpate_extractor cgal{palpate::extract_isosurface};
    return &cgal;
}
