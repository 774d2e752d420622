# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/check_rooms.sh -DWORK=... -P check_rooms_test.cmake
# The negative control of check_rooms.sh: a kind of effect that is named outside of its room is found, and one that the
# reference leaves out.
cmake_minimum_required(VERSION 3.25)

# A room, its row in the reference, and another source of the engine: its line 1.
function(make_tree line)
  file(REMOVE_RECURSE ${WORK})
  file(WRITE ${WORK}/engine/scene/effects/guide.cpp "const EffectRoom<Guide> Guide::room{\n    .traits = {.name = \"guide\"},\n};\n")
  file(WRITE ${WORK}/docs/effects.md "| `type` | law |\n|---|---|\n| `guide` | s dist(x, C) |\n")
  file(WRITE ${WORK}/engine/scene/plan.cpp "${line}\n")
endfunction()

function(check_tree status_variable output_variable)
  execute_process(COMMAND ${SCRIPT} ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  set(${status_variable} ${status} PARENT_SCOPE)
  set(${output_variable} "${output}${errors}" PARENT_SCOPE)
endfunction()

function(expect_found line what)
  make_tree("${line}")
  check_tree(status output)
  string(FIND "${output}" "engine/scene/plan.cpp:1: ${what}" place)
  if(NOT status EQUAL 1 OR NOT place EQUAL 0)
    message(SEND_ERROR "status ${status} for\n${line}\ngot:\n${output}")
  endif()
endfunction()

function(expect_clean line)
  make_tree("${line}")
  check_tree(status output)
  if(NOT status EQUAL 0 OR NOT output STREQUAL "")
    message(SEND_ERROR "status ${status} for\n${line}\ngot:\n${output}")
  endif()
endfunction()

expect_found("if (std::holds_alternative<effects::Guide>(effect.settings)) return" "names a kind")
expect_found("#include <palpate/engine/scene/effects/guide.h>" "includes a kind")
expect_found("if (name(effect) == \"guide\") return" "asks for a kind")
expect_found("if (name(scene.effects[i]) != \"guide\") return" "asks for a kind")
expect_clean("#include <palpate/engine/scene/effects/list.h>")
expect_clean("// as of effects::Guide")
expect_clean("entry[\"type\"] = name(effect)")

make_tree("")
file(WRITE ${WORK}/docs/effects.md "| `type` | law |\n|---|---|\n| `guides` | `guide` |\n\n| `guide` |\n")
check_tree(status output)
if(NOT status EQUAL 1 OR NOT output MATCHES "^engine/scene/effects/guide.cpp:2: docs/effects.md does not say what `guide` does")
  message(SEND_ERROR "a kind without a row: status ${status}, got:\n${output}")
endif()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
check_tree(status output)
if(NOT status EQUAL 2)
  message(SEND_ERROR "an empty folder: status ${status}, got:\n${output}")
endif()
