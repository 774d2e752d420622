# SPDX-License-Identifier: Apache-2.0
# How our own sources are compiled. Never -ffast-math; no contraction, so that the same source gives the same bits.
# -Wno-restrict: GCC 12 warns of its own string headers (its bug 105329).
add_library(palpate_options INTERFACE)
target_compile_options(palpate_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wno-restrict
  -ffp-contract=off -march=${PALPATE_ARCH})
if(PALPATE_SANITIZE)
  add_compile_options(-fsanitize=${PALPATE_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${PALPATE_SANITIZE})
endif()
find_program(CCACHE ccache)
if(CCACHE)
  # A source that uses a precompiled header is kept only if ccache may look away from the header's own macros.
  set(launcher ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher})
endif()
