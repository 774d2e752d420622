/* SPDX-License-Identifier: Apache-2.0 */
/* Meshes of volumes for the C interface, by CGAL. The library behind it, palpate::c_extraction,
   links CGAL and is GPL-3+ as a whole. */
#ifndef PALPATE_C_EXTRACTION_H
#define PALPATE_C_EXTRACTION_H

#include <palpate/palpate_c.h>

#ifdef __cplusplus
extern "C" {
#endif

/* For palpate_scene_options.extractor. It is there as long as the program. [any] */
const palpate_extractor *palpate_cgal_extractor(void);

#ifdef __cplusplus
}
#endif

#endif
