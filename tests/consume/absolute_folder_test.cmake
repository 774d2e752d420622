# SPDX-License-Identifier: Apache-2.0
# A folder of the installation that is not below the prefix is refused before anything is built.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK} -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER}
  -DCMAKE_C_COMPILER=${C_COMPILER} -DCMAKE_INSTALL_INCLUDEDIR=/opt/inc RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
if(status EQUAL 0 OR NOT errors MATCHES "CMAKE_INSTALL_INCLUDEDIR=/opt/inc: give a folder below")
  message(SEND_ERROR "status ${status}:\n${output}${errors}")
endif()
