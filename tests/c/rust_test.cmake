# SPDX-License-Identifier: Apache-2.0
# cmake -DRUSTC=... -DSOURCE=main.rs -DLIBRARIES=folder -DWORK=... -P rust_test.cmake
# Compiles the example in Rust, which needs no crate and no cargo, against the libraries of a folder, and runs it.
cmake_minimum_required(VERSION 3.25)
if(NOT RUSTC)
  message("SKIPPED: there is no rustc; install Debian's package rustc to run the example in Rust")
  return()
endif()
file(MAKE_DIRECTORY ${WORK})
execute_process(COMMAND ${RUSTC} --edition 2021 -D warnings -C opt-level=2 ${SOURCE} -L native=${LIBRARIES} -o ${WORK}/embed_rust
  COMMAND_ERROR_IS_FATAL ANY)
set(ENV{LD_LIBRARY_PATH} ${LIBRARIES})
execute_process(COMMAND ${WORK}/embed_rust OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
message("${output}")
# It comes to the ball's surface, 10 mm away, after 250 ms at 40 mm/s.
if(NOT output MATCHES "^25[0-9] ms: 0[.]0[0-9]+ N")
  message(FATAL_ERROR "the example in Rust says: ${output}")
endif()
