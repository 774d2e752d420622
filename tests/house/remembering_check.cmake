# SPDX-License-Identifier: Apache-2.0
# For the tests of checks that remember what they found clean: SCRIPT of WORK/build and the tree in WORK, with a memory of its own.

# expect(STATUS, REGEX): the check ends with this status, and says this.
function(expect wanted_status wanted)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env PALPATE_CHECK_CACHE=${WORK}/cache ${SCRIPT} ${WORK}/build ${WORK}
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  if(NOT status EQUAL wanted_status OR NOT "${output}${errors}" MATCHES "${wanted}")
    message(SEND_ERROR "wanted status ${wanted_status} and \"${wanted}\"; status ${status}:\n${output}${errors}")
  endif()
endfunction()

# A tree whose headers are seen as <palpate/geometry/...>.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/build/include/palpate)
file(CREATE_LINK ${WORK}/geometry ${WORK}/build/include/palpate/geometry SYMBOLIC)
