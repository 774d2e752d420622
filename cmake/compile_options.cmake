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
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()
