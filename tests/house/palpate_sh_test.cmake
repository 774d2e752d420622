# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=palpate.sh -DWORK=... -P palpate_sh_test.cmake
# What palpate.sh does before it compiles: `cmake` is a script here that fails, and so is apt-get.
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${WORK})
file(COPY ${SCRIPT} DESTINATION ${WORK})
file(WRITE ${WORK}/scripts/packages.txt "ninja-build # a comment\n")
foreach(file CMakeLists.txt CMakePresets.json cmake/a geometry/a volume/a haptics/a engine/a)
  file(WRITE ${WORK}/${file} "")
endforeach()

# tool(NAME TEXT): a program that stands before the system's.
function(tool name text)
  file(WRITE ${WORK}/tools/${name} "#!/bin/sh\n${text}\n")
  file(CHMOD ${WORK}/tools/${name} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
endfunction()
tool(cmake "echo cmake fails >&2\nexit 7")
tool(apt-get "echo apt-get is asked >&2\nexit 9")
tool(sudo "exec \"$@\"")

# expect(WHAT PACKAGES STATUS): `palpate.sh WHAT` where dpkg says that ends so.
function(expect what packages wanted)
  tool(dpkg-query "printf '${packages}'")
  execute_process(COMMAND ${CMAKE_COMMAND} -E env PATH=${WORK}/tools:$ENV{PATH} PALPATE_CHECK_CACHE=${WORK}/cache ${WORK}/palpate.sh ${what}
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  if(NOT status EQUAL wanted)
    message(SEND_ERROR "palpate.sh ${what} with ${packages}: wanted ${wanted}, status ${status}:\n${output}${errors}")
  endif()
endfunction()

# A package that is held is installed; one of which only the configuration is left is not.
expect(build "ii \\tninja-build, \\n" 7)
expect(build "hi \\tninja-build, \\n" 7)
expect(build "ii \\tother, ninja-build (= 1)\\n" 7)
expect(build "rc \\tninja-build, \\n" 9)

# Where a build fails, what a later one makes goes into no folder of these sources.
expect(test "ii \\tninja-build, \\n" 7)
if(IS_SYMLINK ${WORK}/build/release/real-data/cache)
  message(SEND_ERROR "after a build that failed, build/release/real-data/cache leads to the folder of its sources")
endif()
file(GLOB kept ${WORK}/cache/surfaces/*)
list(LENGTH kept count)
if(NOT count EQUAL 1)
  message(SEND_ERROR "kept are ${kept}, wanted one folder")
endif()
