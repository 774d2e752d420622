# SPDX-License-Identifier: Apache-2.0
# cmake -DDOXYGEN=... -DSOURCE=... -DINCLUDE=... -DWORK=... -P doxygen_test.cmake
# Every public declaration is documented: docs/Doxyfile over the headers as they are installed gives no warning. INCLUDE is where
# version.h is.
cmake_minimum_required(VERSION 3.25)
if(NOT DOXYGEN)
  message("SKIPPED: doxygen is not installed (Debian: doxygen)")
  return()
endif()
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
unset(ENV{DESTDIR})  # a packager's setting: it would move the headers

# Leaves doxygen's exit code in `status` and its warnings in `warnings`.
function(run_doxygen headers output)
  file(READ ${SOURCE}/docs/Doxyfile settings)
  file(WRITE ${output}/Doxyfile
    "${settings}\nINPUT = ${headers}\nSTRIP_FROM_PATH = ${headers}\nSTRIP_FROM_INC_PATH = ${headers}\nOUTPUT_DIRECTORY = ${output}\n")
  execute_process(COMMAND ${DOXYGEN} ${output}/Doxyfile RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE warnings)
  set(status ${status} PARENT_SCOPE)
  set(warnings "${warnings}" PARENT_SCOPE)
endfunction()

execute_process(COMMAND ${CMAKE_COMMAND} -DPALPATE_SOURCE=${SOURCE} -DPALPATE_INCLUDE=${INCLUDE}
    -DPALPATE_DESTINATION=${WORK}/include -P ${SOURCE}/cmake/install_headers.cmake
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
run_doxygen(${WORK}/include ${WORK}/documented)
if(NOT status EQUAL 0 OR NOT warnings STREQUAL "")
  message(FATAL_ERROR "public declarations that are not documented, or not as they are:\n${warnings}")
endif()

# That it read the classes and the functions in C, and nothing internal.
file(READ ${WORK}/documented/xml/index.xml index)
foreach(name palpate::HapticLoop palpate::effects::Surface palpate_loop_frame kVersion)
  if(NOT index MATCHES "<name>${name}</name>")
    message(FATAL_ERROR "doxygen did not read ${name}")
  endif()
endforeach()
if(index MATCHES "<name>palpate::internal[^<]*</name>")
  message(FATAL_ERROR "doxygen took this for public: ${CMAKE_MATCH_0}")
endif()

# That it finds what it is for.
set(wrong ${WORK}/wrong_include)
file(WRITE ${wrong}/wrong.h "/// Things.
namespace palpate {
/// A thing.
struct Thing {
    double length_m = 0.0;
    double told_m = 0.0; ///< m
};
/// Where the thing begins, with a \\param nobody.
double begin(const Thing& thing);
double end(const Thing& thing);
}\n")
file(WRITE ${wrong}/palpate_c.h "/* SPDX-License-Identifier: Apache-2.0 */\nint palpate_undocumented(void);\n")
run_doxygen(${wrong} ${WORK}/wrong)
foreach(word length_m "nobody" " end\\(" palpate_undocumented)
  if(status EQUAL 0 OR NOT warnings MATCHES "${word}")
    message(FATAL_ERROR "doxygen did not warn of ${word}:\n${warnings}")
  endif()
endforeach()
if(warnings MATCHES "told_m")
  message(FATAL_ERROR "doxygen warned of what is documented:\n${warnings}")
endif()
