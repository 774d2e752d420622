# SPDX-License-Identifier: Apache-2.0
# cmake -DSOURCE=... -DWORK=... -DGENERATOR=... -DCOMPILER=... [-DCOMPLETE=ON] -P embedded_test.cmake
# Palpate's sources within a project of somebody else: by add_subdirectory with shared libraries, by FetchContent with static ones.
# All is configured and generated, and of the build one source of each side; with COMPLETE all of it, which takes minutes.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

# What FetchContent clones: the checkout as it is, and no more of it than a host needs.
foreach(part CMakeLists.txt LICENSE NOTICE cmake geometry volume haptics drivers engine c)
  file(COPY ${SOURCE}/${part} DESTINATION ${WORK}/repository)
endforeach()
set(git git -C ${WORK}/repository -c user.name=host -c user.email=host@localhost -c init.defaultBranch=main)
run("a repository" ${git} init -q)
run("its files" ${git} add -A)
run("its commit" ${git} commit -q -m palpate)

# try(WAY SUFFIX SETTING...): a host that has Palpate by WAY; its library ends with SUFFIX.
function(try way suffix)
  set(build ${WORK}/${way})
  run("${way}: configure" ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/embedded -B ${build} -G ${GENERATOR}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Release -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF ${ARGN})

  # What a build consists of, in Ninja's words: nothing that the host did not ask for.
  run("${way}: what is to be built" ${CMAKE_COMMAND} --build ${build} -- -t commands all)
  if(NOT output MATCHES "libpalpate${suffix}" OR NOT output MATCHES "host")
    message(FATAL_ERROR "${way}: neither the host nor its library is built:\n${output}")
  endif()
  if(output MATCHES "[^\n]*(palpate_(files|report|extraction|c|command|whole|python)\\.dir|/tests/[a-z]+/[^ ]*_test|/bench/)[^\n]*")
    message(FATAL_ERROR "${way}: the host builds what it did not ask for: ${CMAKE_MATCH_0}")
  endif()
  run("${way}: tests" ${CMAKE_CTEST_COMMAND} --test-dir ${build} -N)
  if(NOT output MATCHES "Total Tests: 1\n")
    message(FATAL_ERROR "${way}: the host has other tests than its own:\n${output}")
  endif()
  file(GLOB_RECURSE scripts ${build}/cmake_install.cmake)
  foreach(script IN LISTS scripts)
    file(STRINGS ${script} clutter REGEX "palpate.*(\\.so|\\.a|\\.h|\\.pc)\"|share/doc")
    if(clutter)
      message(FATAL_ERROR "${way}: the host installs ${clutter}")
    endif()
  endforeach()

  run("${way}: the host's part" ${CMAKE_COMMAND} --build ${build} --target host_part)
  if(COMPLETE)
    run("${way}: build" ${CMAKE_COMMAND} --build ${build})
    run("${way}: the host's tests" ${CMAKE_CTEST_COMMAND} --test-dir ${build})
    message(STATUS "${output}")
  endif()
endfunction()

try(add_subdirectory .so -DSOURCE=${SOURCE})
try(fetch_content .a -DREPOSITORY=file://${WORK}/repository -DBUILD_SHARED_LIBS=OFF)
