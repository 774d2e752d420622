# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DGENERATOR=... -DCOMPILER=... -DVERSION=... -P consume_test.cmake
# Installs the build tree BUILD to a prefix of its own in WORK; the project beside this script then has nothing but that prefix.
cmake_minimum_required(VERSION 3.25)
set(prefix ${WORK}/prefix)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
unset(ENV{DESTDIR})  # a packager's setting: it would move the prefix

# Runs a command, stops with its output when it fails, else leaves its output in `output`.
macro(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  string(APPEND output "${errors}")
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${what} failed (${status}):\n${output}")
  endif()
  message(STATUS "${what}: done")
endmacro()

run("install" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})

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

# A component that there is not.
file(WRITE ${WORK}/missing/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(missing LANGUAGES CXX)
find_package(palpate REQUIRED COMPONENTS wood)\n")
execute_process(COMMAND ${CMAKE_COMMAND} -S ${WORK}/missing -B ${WORK}/missing/build ${settings}
  RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE errors)
if(status EQUAL 0 OR NOT errors MATCHES "wood")
  message(FATAL_ERROR "a component that there is not was accepted:\n${errors}")
endif()

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
