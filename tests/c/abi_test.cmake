# SPDX-License-Identifier: Apache-2.0
# cmake -DPROGRAM=... -DLIBRARY=... -DKEPT=... -P abi_test.cmake
# Compares the layouts that PROGRAM prints, and the functions that LIBRARY exports, with the list KEPT. Where a change is meant,
# raise PALPATE_C_ABI (nothing but new functions, and members at a struct's end, may come without), and write the list anew:
#   cmake -DWRITE=1 -DPROGRAM=... -DLIBRARY=... -DKEPT=... -P abi_test.cmake
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE layouts COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND nm --dynamic --defined-only ${LIBRARY} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE "(^|\n)[0-9a-f]* *[A-Za-z] " "\\1" functions "${symbols}")
set(found "${layouts}${functions}")
if(WRITE)
  file(WRITE ${KEPT} "${found}")
endif()
file(READ ${KEPT} kept)
if(NOT found STREQUAL kept)
  message(FATAL_ERROR "the binary interface is not that of ${KEPT}:\n${found}")
endif()
