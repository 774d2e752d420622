# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DPYTHON=... -DDESTINATION=... -DVERSION=... -P python_test.cmake
# Installs the build tree BUILD to a prefix of its own in WORK; the Python package then has nothing but that prefix.
cmake_minimum_required(VERSION 3.25)
set(prefix ${WORK}/prefix)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
unset(ENV{DESTDIR})  # a packager's setting: it would move the prefix
unset(ENV{LD_LIBRARY_PATH})
set(ENV{PYTHONPATH} ${prefix}/${DESTINATION})
set(ENV{PYTHONDONTWRITEBYTECODE} 1)

# Runs a command, stops with its output when it fails, else leaves its output in `output`.
macro(run what)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  string(APPEND output "${errors}")
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${what} failed (${status}):\n${output}")
  endif()
  message(STATUS "${what}: done")
endmacro()

run("install" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})

file(WRITE ${WORK}/felt.py "
import palpate
scene = palpate.Scene({
    'volume': {'ball': {'analytic': 'solid_sphere', 'radius_mm': 30}},
    'surface': {'skin': {'volume': 'ball'}},
    'effect': [{'type': 'surface', 'surface': 'skin'}],
})
trace = palpate.trace(scene, [[0, 0, 1e-3 * (35 - 0.1 * i)] for i in range(71)])
assert trace['felt'][-1] == 'skin' and trace.force_n[-1, 2] > 0.5, trace.force_n[-1]
trace.save('recording.h5', force=True)
assert len(palpate.replay('recording.h5')) == 71
print(palpate.__version__, palpate.__file__)
")
run("a first felt force" ${PYTHON} felt.py)
if(NOT output MATCHES "${VERSION} ${prefix}/${DESTINATION}/palpate/")
  message(FATAL_ERROR "another package than the installed one was imported: ${output}")
endif()

# Our libraries come from the prefix alone, and CGAL is behind none of what is not under the GPL.
file(GLOB module ${prefix}/${DESTINATION}/palpate/_palpate.*.so)
run("ldd" ldd ${module})
string(REGEX MATCHALL "libpalpate[^ ]* => [^ ]*" ours "${output}")
if(NOT ours)
  message(FATAL_ERROR "the module links nothing of ours:\n${output}")
endif()
foreach(library IN LISTS ours)
  if(NOT library MATCHES "=> ${prefix}/")
    message(FATAL_ERROR "a library of ours is not the installed one: ${library}")
  endif()
endforeach()
if(output MATCHES "libpalpate_extraction|libmpfr")
  message(FATAL_ERROR "the module links what is under the GPL:\n${output}")
endif()

# Without the module that is under the GPL the package is whole.
file(GLOB extraction ${prefix}/${DESTINATION}/palpate/_extraction.*.so)
if(extraction)
  file(REMOVE ${extraction})
  run("without extraction" ${PYTHON} felt.py)
endif()
