# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DPKG_CONFIG=... -DCOMPILER=... -DC_COMPILER=... -P pkg_config_test.cmake
# Programs in C++ and C that know nothing but what pkg-config says of an installed tree in a prefix of its own.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(prefix ${WORK}/prefix)
install_to(${prefix})
set(ENV{PKG_CONFIG_PATH} ${prefix}/lib/pkgconfig)

# ask(LIBRARY FLAG...): what pkg-config says of it, as the list `answer`.
macro(ask library)
  run("pkg-config ${ARGN} ${library}" ${PKG_CONFIG} ${ARGN} ${library})
  separate_arguments(answer UNIX_COMMAND "${output}")
endmacro()

# Each library that is installed, with those that it stands on, in the order of linking.
set(behind_palpate -lpalpate)
set(behind_palpate_files -lpalpate_files -lpalpate)
set(behind_palpate_report -lpalpate_report -lpalpate_files -lpalpate)
set(behind_palpate_extraction -lpalpate_extraction -lpalpate)
set(behind_palpate_c -lpalpate_c)
set(behind_palpate_c_extraction -lpalpate_c_extraction -lpalpate_c)
file(GLOB libraries RELATIVE ${prefix}/lib ${prefix}/lib/libpalpate*.so)
list(LENGTH libraries count)
if(count LESS 4)
  message(FATAL_ERROR "only ${count} installed libraries: ${libraries}")
endif()
foreach(file IN LISTS libraries)
  string(REGEX REPLACE "^lib(.*)\\.so$" "\\1" library ${file})
  ask(${library} --libs-only-l)
  if(NOT answer STREQUAL behind_${library})
    message(FATAL_ERROR "${library} links ${answer} instead of ${behind_${library}}")
  endif()
endforeach()

set(examples ${CMAKE_CURRENT_LIST_DIR}/../../examples)
ask(palpate --cflags --libs)
run("compile in C++" ${COMPILER} -std=c++20 -O1 ${examples}/custom_effect/main.cpp -o custom_effect ${answer} -Wl,-rpath,${prefix}/lib)
run("the example in C++" ${WORK}/custom_effect)
ask(palpate_c --cflags --libs)
run("compile in C" ${C_COMPILER} -std=c99 ${examples}/embed_c/main.c -o embed_c ${answer} -lm -Wl,-rpath,${prefix}/lib)
run("the example in C" ${WORK}/embed_c)
if(NOT output STREQUAL "1.000 N at 4.00 mm\n")
  message(FATAL_ERROR "the example in C says: ${output}")
endif()
