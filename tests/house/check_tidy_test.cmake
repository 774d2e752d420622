# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/check_tidy.sh -DCHECKS=.clang-tidy -DWORK=... -P check_tidy_test.cmake
# The negative control of check_tidy.sh: a defect in a source or in a header is found, alone and among others, until it is
# mended; what was found clean is not looked at again before something that it includes has changed.
cmake_minimum_required(VERSION 3.25)

include(${CMAKE_CURRENT_LIST_DIR}/remembering_check.cmake)
file(COPY ${CHECKS} DESTINATION ${WORK})
set(entries "")
foreach(name one two three)
  string(APPEND entries ",\n{\"directory\": \"${WORK}/build\", \"file\": \"${WORK}/geometry/${name}.cpp\", \"command\":
    \"c++ -I${WORK}/build/include -O3 -Wno-restrict -std=c++20 -o CMakeFiles/palpate.dir/${name}.o -c ${WORK}/geometry/${name}.cpp\"}")
endforeach()
string(REPLACE "\n    " " " entries "${entries}")
string(SUBSTRING "${entries}" 1 -1 entries)
file(WRITE ${WORK}/build/compile_commands.json "[${entries}]\n")

# Two sources that may be looked at together, and one that shares a name with the first.
function(write_tree header one)
  file(WRITE ${WORK}/geometry/size.h "#pragma once\nnamespace palpate {\n${header}\n} // namespace palpate\n")
  file(WRITE ${WORK}/geometry/one.cpp "#include <palpate/geometry/size.h>\nnamespace palpate {\nnamespace {\n\n"
    "int twice(int size) { return 2 * size; }\n\n} // namespace\n\n${one}\n} // namespace palpate\n")
  file(WRITE ${WORK}/geometry/two.cpp "namespace palpate {\nint two() { return 2; }\n} // namespace palpate\n")
  file(WRITE ${WORK}/geometry/three.cpp "namespace palpate {\nnamespace {\n\nint twice(int size) { return size + size; }\n\n"
    "} // namespace\n\nint three() { return twice(1) + 1; }\n} // namespace palpate\n")
endfunction()

set(header "inline int size_of(long size) { return static_cast<int>(size); }")
set(one "int one(long size) { return twice(size_of(size)); }")
write_tree("${header}" "int one(long size) { return twice(size); }")
expect(1 "3 of 3 sources in 2 bundles.*geometry/one.cpp:9:[0-9]+: error: .*shorten-64-to-32")
write_tree("inline int size_of(long size) { return size; }" "${one}")
expect(1 "1 of 3 sources in 1 bundles.*geometry/size.h:3:[0-9]+: error: .*shorten-64-to-32")
write_tree("${header}" "${one}")
expect(0 "1 of 3 sources in 1 bundles")
expect(0 "3 sources, all found clean before")
write_tree("${header} // anew" "${one}")
expect(0 "1 of 3 sources in 1 bundles")

file(REMOVE ${WORK}/build/compile_commands.json)
expect(2 "no compile_commands.json")
