# SPDX-License-Identifier: Apache-2.0
# How our own sources are compiled. Never -ffast-math; no contraction, so that the same source gives the same bits.
# -fno-math-errno: nobody reads errno after a square root, and without it a root is one instruction with the same bits.
# -Wno-restrict: GCC 12 warns of its own string headers (its bug 105329).
add_library(palpate_options INTERFACE)
target_compile_options(palpate_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  -ffp-contract=off -fno-math-errno $<$<BOOL:${PALPATE_ARCH}>:-march=${PALPATE_ARCH}>)
# What is ours and no test: no number changes its type unseen. What changes its sign does: indices are int here and there. A host's
# compiler may warn of more than ours does: there it is no error. Clang's -Wconversion is of signs, too.
add_library(palpate_strict INTERFACE)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(palpate_strict INTERFACE -Wconversion)
  if(PROJECT_IS_TOP_LEVEL)
    target_compile_options(palpate_strict INTERFACE -Werror=conversion -Werror=float-conversion)
  endif()
endif()
# Sanitizers watch the library and the command. The tests' own objects stay as in a release build, so that ccache has them
# already: they call what is watched, and -Bsymbolic-functions keeps the library's own copies of inline functions in use. Threads
# are watched everywhere: what one does unseen looks like a race.
add_library(palpate_watched INTERFACE)
if(PALPATE_SANITIZE)
  set(watch -fsanitize=${PALPATE_SANITIZE} -fno-omit-frame-pointer -g1 -O1)
  if(PALPATE_FUZZ)  # libFuzzer keeps an input where the process ends, and looks at no message
    list(APPEND watch -fno-sanitize-recover=undefined -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/tests/fuzz/libraries.txt)
  elseif(PALPATE_SANITIZE MATCHES "undefined")  # a third of the time to compile: fuzzing looks at these, and null is a crash
    list(APPEND watch -fno-sanitize=null,alignment)
  endif()
  if(PALPATE_SANITIZE MATCHES "thread")
    add_compile_options(${watch})
  else()
    target_compile_options(palpate_watched INTERFACE ${watch})
  endif()
  add_link_options(-fsanitize=${PALPATE_SANITIZE} -Wl,-Bsymbolic-functions)
endif()
# g++ looks for memory that it may use again from 128 MB on, and most of our sources take more: a twentieth of its time.
if(PROJECT_IS_TOP_LEVEL AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:SHELL:--param ggc-min-heapsize=400000>")
endif()
if(PROJECT_IS_TOP_LEVEL)
  find_program(CCACHE ccache)
endif()
if(CCACHE)
  # A source that uses a precompiled header is kept only if ccache may look away from the header's own macros; and paths are
  # taken as from the build folder, so that one build has the objects of another.
  set(launcher ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher})
endif()
