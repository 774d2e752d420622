# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DGENERATOR=... -DCOMPILER=... -DVERSION=... -P consume_test.cmake
# Installs the build tree BUILD to a prefix of its own in WORK; the project beside this script then has nothing but that prefix.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(prefix ${WORK}/prefix)
install_to(${prefix})

# Were one of these packages asked for by the package's configuration, it could not be found.
set(disabled "")
foreach(package CGAL embree OpenVDB TBB ITK HDF5 OpenSSL PNG fmt nlohmann_json tomlplusplus CLI11 hidapi)
  list(APPEND disabled -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
set(settings -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=${prefix}
  -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF ${disabled})
run("configure" ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build ${settings})
run("build" ${CMAKE_COMMAND} --build ${WORK}/build --verbose)

# The headers that the compiler opened: ours from the prefix (else the list below would prove nothing), and no library's.
string(REPLACE "${prefix}" "PREFIX" opened "${output}")
foreach(header volume/transfer_function.h volume/fields/analytic_fields.h geometry/surface_scene.h)
  if(NOT opened MATCHES "\n\\.+ PREFIX/include/palpate/${header}")
    message(FATAL_ERROR "the consumer did not open the installed ${header}:\n${opened}")
  endif()
endforeach()
set(libraries "CGAL|embree[0-9]*|openvdb|tbb|oneapi|ITK-[0-9.]+|hdf5|openssl|toml\\+\\+|nlohmann|fmt|CLI|hidapi|png\\.h|zlib\\.h")
if(opened MATCHES "\n\\.+ [^\n]*/(${libraries})[/\n][^\n]*")
  message(FATAL_ERROR "a public header needs a third-party header: ${CMAKE_MATCH_0}")
endif()

foreach(consumer consumer consumer_files consumer_report)
  run("${consumer}" ${WORK}/build/${consumer})
  message(STATUS "${output}")
endforeach()

# The run time alone: what reads files and draws pages is not behind it.
run("ldd" ldd ${WORK}/build/consumer)
if(output MATCHES "lib(palpate_|ITK|itk|gdcm|hdf5|crypto|png)[^ ]*")
  message(FATAL_ERROR "the run time links ${CMAKE_MATCH_0}:\n${output}")
endif()

# What is asked for and is not there is refused by its name: what there never was, and what is not installed, beside what is.
file(WRITE ${WORK}/asking/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(asking LANGUAGES CXX)
string(REPLACE , \";\" COMPONENTS \${COMPONENTS})
find_package(palpate REQUIRED COMPONENTS \${COMPONENTS})
foreach(component IN LISTS COMPONENTS)
  if(NOT TARGET palpate::\${component} OR NOT palpate_\${component}_FOUND)
    message(FATAL_ERROR \"\${component} is found and not there\")
  endif()
endforeach()\n")
set(ask ${CMAKE_COMMAND} -S ${WORK}/asking -B ${WORK}/asking/build ${settings})
run_refused("an unknown component" "palpate has no component wood; it has palpate, files, report, view, c, extraction, c_extraction"
  ${ask} -DCOMPONENTS=files,wood)
set(components palpate,files,report,view,c)
if(EXISTS ${prefix}/lib/cmake/palpate/palpate_extraction_targets.cmake)
  string(APPEND components ,extraction,c_extraction)
endif()
run("all components" ${ask} -DCOMPONENTS=${components})
install_to(${WORK}/apache run_time development)
set(ask ${ask} -DCMAKE_PREFIX_PATH=${WORK}/apache -Dpalpate_DIR=)
run("components without what is under the GPL" ${ask} -DCOMPONENTS=palpate,files,report,view,c)
run_refused("a component that is not installed"
  "the component extraction is not installed in ${WORK}/apache, which has: palpate files report view c."
  ${ask} -DCOMPONENTS=files,extraction)

set(example ${CMAKE_CURRENT_LIST_DIR}/../../examples/custom_effect)
run("configure the example" ${CMAKE_COMMAND} -S ${example} -B ${WORK}/example ${settings})
run("build the example" ${CMAKE_COMMAND} --build ${WORK}/example)
run("example" ${WORK}/example/custom_effect)
message(STATUS "${output}")

set(said_embed_c "^1.000 N at 4.00 mm\n$")
set(said_memory_c "tumour touched at z = 28.0 mm\n.*frames again, 0 differ\n$")
foreach(program embed_c memory_c)
  set(example ${CMAKE_CURRENT_LIST_DIR}/../../examples/${program})
  run("configure ${program}" ${CMAKE_COMMAND} -S ${example} -B ${WORK}/${program} ${settings})
  run("build ${program}" ${CMAKE_COMMAND} --build ${WORK}/${program})
  run("${program}" ${CMAKE_COMMAND} -E chdir ${WORK} ${WORK}/${program}/${program})
  if(NOT output MATCHES "${said_${program}}")
    message(FATAL_ERROR "${program} says: ${output}")
  endif()
endforeach()

set(example ${CMAKE_CURRENT_LIST_DIR}/../../examples/device_plugin_udp)
run("configure the device plug-in" ${CMAKE_COMMAND} -S ${example} -B ${WORK}/device_plugin_udp ${settings})
run("build the device plug-in" ${CMAKE_COMMAND} --build ${WORK}/device_plugin_udp)

find_program(rustc rustc)
file(GLOB_RECURSE library ${prefix}/libpalpate_c.so)
get_filename_component(libraries ${library} DIRECTORY)
if(rustc)
  run("example in Rust" ${CMAKE_COMMAND} -DRUSTC=${rustc} -DSOURCE=${CMAKE_CURRENT_LIST_DIR}/../../examples/embed_rust/main.rs
    -DLIBRARIES=${libraries} -DWORK=${WORK}/embed_rust -P ${CMAKE_CURRENT_LIST_DIR}/../c/rust_test.cmake)
endif()

run("installed command" ${prefix}/bin/palpate --version)
if(NOT output MATCHES "${VERSION}")
  message(FATAL_ERROR "the installed command does not say version ${VERSION}: ${output}")
endif()
run("what the installed command says of the example's effect" ${prefix}/bin/palpate validate effect ${WORK}/example/wave.so)
if(NOT output MATCHES "PASS  allocation")
  message(FATAL_ERROR "the installed command does not count allocations:\n${output}")
endif()
