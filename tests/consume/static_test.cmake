# SPDX-License-Identifier: Apache-2.0
# cmake -DSOURCE=... -DOBJECTS=... -DWITH_CGAL=... -DWORK=... -DGENERATOR=... -DCOMPILER=... -P static_test.cmake
# Programs in C++ and C against an installed tree of static libraries. These are made of the objects that the shared ones were made
# of, OBJECTS/LIBRARY.txt: they are compiled in the same way, but for a macro (palpate_EXPORTS) that no source asks for.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(prefix ${WORK}/prefix)
set(BUILD ${WORK}/palpate)
set(settings -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Release -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run("configure Palpate" ${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} ${settings} -DBUILD_SHARED_LIBS=OFF -DPALPATE_TESTS=OFF
  -DPALPATE_BENCH=OFF -DPALPATE_WITH_CGAL=${WITH_CGAL})
file(GLOB lists RELATIVE ${OBJECTS} ${OBJECTS}/*.txt)
foreach(list IN LISTS lists)
  string(REPLACE .txt .a archive lib${list})
  run("${archive}" ar qcs ${BUILD}/${archive} @${OBJECTS}/${list})
endforeach()
set(components development)
if(WITH_CGAL)
  list(APPEND components extraction_development)
endif()
install_to(${prefix} ${components})

run("configure" ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build ${settings} -DCMAKE_PREFIX_PATH=${prefix})
run("build" ${CMAKE_COMMAND} --build ${WORK}/build --target consumer_files)
run("consumer_files" ${WORK}/build/consumer_files)
message(STATUS "${output}")
run("ldd" ldd ${WORK}/build/consumer_files)
if(output MATCHES "libpalpate")
  message(FATAL_ERROR "a shared library of ours is behind it:\n${output}")
endif()

set(example ${CMAKE_CURRENT_LIST_DIR}/../../examples/embed_c)
run("configure the example in C" ${CMAKE_COMMAND} -S ${example} -B ${WORK}/example_c ${settings} -DCMAKE_PREFIX_PATH=${prefix})
run("build the example in C" ${CMAKE_COMMAND} --build ${WORK}/example_c)
run("example in C" ${WORK}/example_c/embed_c)
if(NOT output STREQUAL "1.000 N at 4.00 mm\n")
  message(FATAL_ERROR "the example in C says: ${output}")
endif()
