# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DPYTHON=... -DDESTINATION=... -DVERSION=... -P python_test.cmake
# Installs the build tree BUILD to a prefix of its own in WORK; the Python package then has nothing but that prefix.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(prefix ${WORK}/prefix)
set(felt ${CMAKE_CURRENT_LIST_DIR}/felt.py)
set(ENV{PYTHONPATH} ${prefix}/${DESTINATION})
set(ENV{PYTHONDONTWRITEBYTECODE} 1)

# First without what is under the GPL: the package is whole without its module of that.
install_to(${prefix} run_time python)

run("a first felt force" ${PYTHON} ${felt})
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

install_to(${prefix} extraction python_extraction)
file(GLOB extraction ${prefix}/${DESTINATION}/palpate/_extraction.*.so)
if(extraction)
  run("with extraction" ${PYTHON} -c "import palpate._extraction")
  run("a first felt force, with extraction" ${PYTHON} ${felt})
endif()
