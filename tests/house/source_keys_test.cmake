# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/source_keys.sh -DWORK=... -P source_keys_test.cmake
# A source has another key where it, or a header that it includes, is another one: also a source in C, and one with a header of c/.
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/build)
file(WRITE ${WORK}/flags "engine/watch.c\t-O2\ndrivers/plugin.cpp\t-O2\n")

function(keys_of watch header result)
  file(WRITE ${WORK}/engine/watch.c "${watch}\n")
  file(WRITE ${WORK}/c/device_plugin.h "${header}\n")
  file(WRITE ${WORK}/drivers/plugin.cpp "#include <palpate/device_plugin.h>\n")
  execute_process(COMMAND ${SCRIPT} ${WORK}/build ${WORK} general ${WORK}/flags OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[0-9a-f]+\n" keys "${output}")
  set(${result} ${keys} PARENT_SCOPE)
endfunction()

# expect(WHICH BEFORE AFTER): of both keys, those in the list WHICH differ.
function(expect which before after)
  foreach(i RANGE 1)
    list(GET before ${i} a)
    list(GET after ${i} b)
    if(a STREQUAL b AND i IN_LIST which OR NOT a STREQUAL b AND NOT i IN_LIST which)
      message(SEND_ERROR "key ${i}, where those of \"${which}\" are to be others: ${a}${b}")
    endif()
  endforeach()
endfunction()

keys_of("int a;" "// one" first)
keys_of("int a;" "// one" again)
keys_of("int b;" "// one" source)
keys_of("int a;" "// two" header)
expect("" "${first}" "${again}")
expect("0" "${first}" "${source}")
expect("1" "${first}" "${header}")

file(WRITE ${WORK}/flags "engine/gone.c\t-O2\n")
execute_process(COMMAND ${SCRIPT} ${WORK}/build ${WORK} general ${WORK}/flags RESULT_VARIABLE status OUTPUT_VARIABLE output
  ERROR_VARIABLE errors)
if(status EQUAL 0 OR NOT errors MATCHES "engine/gone.c: no source of ")
  message(SEND_ERROR "a source that is not there: status ${status}, got:\n${output}${errors}")
endif()
