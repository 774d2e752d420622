# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/check_definitions.sh -DWORK=... -P check_definitions_test.cmake
# The negative control of check_definitions.sh: a type that is defined twice is found, what only looks like it is not.
cmake_minimum_required(VERSION 3.25)

function(check_tree status_variable output_variable)
  execute_process(COMMAND ${SCRIPT} ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  set(${status_variable} ${status} PARENT_SCOPE)
  set(${output_variable} "${output}${errors}" PARENT_SCOPE)
endfunction()

# Two headers; `second` is the second one's text, from its line 1.
function(make_tree second)
  file(REMOVE_RECURSE ${WORK})
  file(WRITE ${WORK}/geometry/spread.h
    "namespace palpate::internal {\n\nstruct Spread {\n    double mean = 0.0;\n};\n\n} // namespace palpate::internal\n")
  file(WRITE ${WORK}/engine/summary.h "${second}")
endfunction()

function(expect_twice second)
  make_tree("${second}")
  check_tree(status output)
  if(NOT status EQUAL 1 OR NOT output MATCHES "^geometry/spread.h:3: palpate::internal::Spread is defined in engine/summary.h:")
    message(SEND_ERROR "status ${status} for\n${second}\ngot:\n${output}")
  endif()
endfunction()

function(expect_clean second)
  make_tree("${second}")
  check_tree(status output)
  if(NOT status EQUAL 0 OR NOT output STREQUAL "")
    message(SEND_ERROR "status ${status} for\n${second}\ngot:\n${output}")
  endif()
endfunction()

set(begin "namespace palpate::internal {\n")
set(end "} // namespace palpate::internal\n")
expect_twice("${begin}struct Spread {\n    int count = 0;\n};\n${end}")
expect_twice("${begin}struct Spread { int count = 0; };\n${end}")
expect_twice("${begin}class Spread final : public Base {\n};\n${end}")
expect_twice("${begin}enum class Spread : char { narrow, wide };\n${end}")
expect_twice("namespace palpate {\nnamespace internal {\nstruct Spread {\n};\n} // namespace internal\n} // namespace palpate\n")
expect_clean("${begin}struct Spread;\n${end}")
expect_clean("namespace palpate {\nstruct Spread {\n};\n} // namespace palpate\n")
expect_clean("${begin}namespace {\nstruct Spread {\n};\n} // namespace\n${end}")
expect_clean("${begin}struct Summary {\n    struct Spread {\n    };\n};\n${end}")

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
check_tree(status output)
if(NOT status EQUAL 2)
  message(SEND_ERROR "an empty folder: status ${status}, got:\n${output}")
endif()
