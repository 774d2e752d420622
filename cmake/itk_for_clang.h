// SPDX-License-Identifier: Apache-2.0
// Included before anything else where clang compiles a source that uses ITK: Debian's ITK knows the
// compiler that it was built with, and refuses any other.
#undef __clang__
#undef __GNUC__
#define __GNUC__ 12
#include <itk_compiler_detection.h>
#undef __GNUC__
#define __GNUC__ 4
#define __clang__ 1
