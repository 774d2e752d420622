# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/check_headers.sh -DCOMPILER=... -DWORK=... -P check_headers_test.cmake
# The negative control of check_headers.sh: a header that lacks an include is found until it is mended; what was found to compile is
# not looked at again before something that it includes has changed.
cmake_minimum_required(VERSION 3.25)

include(${CMAKE_CURRENT_LIST_DIR}/remembering_check.cmake)
file(WRITE ${WORK}/build/CMakeCache.txt "CMAKE_CXX_COMPILER:FILEPATH=${COMPILER}\n")
set(user "#pragma once\n@include@namespace palpate {\ninline Size twice(Size size) { return {2 * size.count}; }\n} // namespace palpate\n")

file(WRITE ${WORK}/geometry/size.h "#pragma once\nnamespace palpate {\nstruct Size { int count; };\n} // namespace palpate\n")
string(REPLACE "@include@" "" alone "${user}")
file(WRITE ${WORK}/geometry/twice.h "${alone}")
expect(1 "2 of 2 headers.*geometry/twice.h: does not compile alone.*Size")
string(REPLACE "@include@" "#include <palpate/geometry/size.h>\n" mended "${user}")
file(WRITE ${WORK}/geometry/twice.h "${mended}")
expect(0 "1 of 2 headers")
expect(0 "2 headers, all found to compile before")
file(WRITE ${WORK}/geometry/size.h "#pragma once\nnamespace palpate {\nstruct Size { long count; };\n} // namespace palpate\n")
expect(0 "2 of 2 headers")

file(REMOVE ${WORK}/build/CMakeCache.txt)
expect(2 "no CMakeCache.txt")
