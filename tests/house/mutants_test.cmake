# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/mutants.sh -DWORK=... -P mutants_test.cmake
# The copy in which mutants.sh breaks safeguards has the files of the sources, and no other: not those that are gone since the last run.
# And a test program that does not even begin is not sound. Nothing is compiled: `cmake` is a script here.
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${WORK})
file(COPY ${SCRIPT} DESTINATION ${WORK}/scripts)
file(WRITE ${WORK}/.gitignore "build/\ntools/\n")
file(WRITE ${WORK}/scripts/mutants.txt "a safeguard\ngeometry/a.cpp\nint a;\nint b;\ntest_geometry A.*\n")
file(WRITE ${WORK}/geometry/a.cpp "int a;\n")
file(WRITE ${WORK}/tests/gone_test.cpp "int test;\n")
file(WRITE ${WORK}/tools/cmake "#!/bin/sh\nexit 1\n")
file(CHMOD ${WORK}/tools/cmake PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
execute_process(COMMAND git init -q ${WORK} COMMAND_ERROR_IS_FATAL ANY)

function(run)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env "PATH=${WORK}/tools:$ENV{PATH}" ${WORK}/scripts/mutants.sh
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  set(status "${status}" PARENT_SCOPE)
  set(said "${output}${errors}" PARENT_SCOPE)
endfunction()

function(expect_copy wanted)
  run()
  file(GLOB_RECURSE copied RELATIVE ${WORK}/build/mutants/source ${WORK}/build/mutants/source/*.cpp)
  list(SORT copied)
  if(NOT status EQUAL 2 OR NOT said MATCHES "cannot be configured" OR NOT copied STREQUAL wanted)
    message(SEND_ERROR "status ${status}, the copy has ${copied}, wanted ${wanted}:\n${said}")
  endif()
endfunction()

expect_copy("geometry/a.cpp;tests/gone_test.cpp")
file(REMOVE ${WORK}/tests/gone_test.cpp)
expect_copy("geometry/a.cpp")

# A program that ends before its first test, as one whose libraries are not found.
file(WRITE ${WORK}/tools/cmake "#!/bin/sh\n[ \"$1\" = --build ] || exit 0\nmkdir -p \"$2\"\n"
  "printf '#!/bin/sh\\nexit 127\\n' >\"$2/test_geometry\"\nchmod +x \"$2/test_geometry\"\n")
file(MAKE_DIRECTORY ${WORK}/build/mutants/source/build/release)
run()
if(NOT status EQUAL 2 OR NOT said MATCHES "fails before anything is broken: ends with 127")
  message(SEND_ERROR "a program that does not begin: status ${status}\n${said}")
endif()
