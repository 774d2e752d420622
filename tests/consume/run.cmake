# SPDX-License-Identifier: Apache-2.0
# What the tests of this folder share. WORK is the folder of the test, and empty when this is included.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
unset(ENV{DESTDIR})  # a packager's setting: it would move the prefix
unset(ENV{LD_LIBRARY_PATH})
unset(ENV{PKG_CONFIG_PATH})
# What was compiled before, in this checkout or in another one, comes from ccache, as in our own build.
find_program(CCACHE ccache)
if(CCACHE)
  get_filename_component(checkout ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
  set(ENV{CCACHE_BASEDIR} ${checkout})
  set(ENV{CCACHE_NOHASHDIR} 1)
  set(ENV{CCACHE_SLOPPINESS} include_file_mtime,include_file_ctime,time_macros)
  set(ENV{CMAKE_C_COMPILER_LAUNCHER} ${CCACHE})
  set(ENV{CMAKE_CXX_COMPILER_LAUNCHER} ${CCACHE})
endif()

# Runs a command in WORK, stops with its output when it fails, else leaves its output in `output`.
macro(run what)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  string(APPEND output "${errors}")
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${what} failed (${status}):\n${output}")
  endif()
  message(STATUS "${what}: done")
endmacro()

# The same for a command that has to fail, with this in its output; line breaks and blanks in a row count as one blank.
macro(run_refused what reason)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  string(REGEX REPLACE "[ \n]+" " " output "${output}${errors}")
  string(FIND "${output}" "${reason}" place)
  if(status EQUAL 0 OR place EQUAL -1)
    message(FATAL_ERROR "${what} was not refused with \"${reason}\" (${status}):\n${output}")
  endif()
  message(STATUS "${what}: refused")
endmacro()

# install_to(PREFIX [COMPONENT...]): the build tree BUILD, or these components of it.
macro(install_to prefix)
  if(${ARGC} EQUAL 1)
    run("install" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
  endif()
  foreach(component ${ARGN})
    run("install ${component}" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component ${component})
  endforeach()
endmacro()
