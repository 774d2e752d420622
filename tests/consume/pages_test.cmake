# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DSOURCE=... -DGENERATOR=... -DCOMPILER=... -DC_COMPILER=... -P pages_test.cmake
# What the pages tell a reader to write into a CMakeLists.txt: each block is configured by a project of its own, which has nothing
# but the build tree BUILD as it is installed to a prefix in WORK. Blocks that say "not run" are left out (tests/readme/code_blocks.h).
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
unset(ENV{DESTDIR})  # a packager's setting: it would move the prefix
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)

file(GLOB pages ${SOURCE}/README.md ${SOURCE}/docs/*.md)
set(count 0)
foreach(page IN LISTS pages)
  file(READ ${page} text)
  string(REPLACE ";" "\\;" text "${text}")
  string(REGEX MATCHALL "\n *```cmake\n[^`]*\n *```\n" blocks "${text}")
  foreach(block IN LISTS blocks)
    math(EXPR count "${count} + 1")
    string(REGEX REPLACE "^\n *```cmake\n(.*\n) *```\n$" "\\1" block "${block}")
    set(project ${WORK}/project_${count})
    # `simulator` is the reader's own program.
    file(WRITE ${project}/main.cpp "int main() { return 0; }\n")
    file(WRITE ${project}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)\nproject(pages LANGUAGES C CXX)
add_executable(simulator main.cpp)\n${block}")
    execute_process(COMMAND ${CMAKE_COMMAND} -S ${project} -B ${project}/build -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${WORK}/prefix
        -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_C_COMPILER=${C_COMPILER}
      RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE errors)
    if(NOT status EQUAL 0)
      message(FATAL_ERROR "${page}: this block is not configured:\n${block}\n${errors}")
    endif()
  endforeach()
endforeach()
if(count EQUAL 0)
  message(FATAL_ERROR "no page has a block of CMake")
endif()
message(STATUS "${count} blocks")
