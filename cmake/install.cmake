# SPDX-License-Identifier: Apache-2.0
include(CMakePackageConfigHelpers)
install(TARGETS ${palpate_libraries} EXPORT palpate_targets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS palpate_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
set_target_properties(palpate_command PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
install(CODE "
  set(PALPATE_SOURCE \"${CMAKE_SOURCE_DIR}\")
  set(PALPATE_INCLUDE \"${palpate_include}\")
  set(PALPATE_DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\")")
install(SCRIPT cmake/install_headers.cmake)
install(EXPORT palpate_targets NAMESPACE palpate:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
configure_package_config_file(cmake/palpate-config.cmake.in ${CMAKE_BINARY_DIR}/palpate-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/palpate-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/palpate-config.cmake ${CMAKE_BINARY_DIR}/palpate-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/palpate)
install(FILES ${CMAKE_SOURCE_DIR}/drivers/70-palpate.rules DESTINATION ${CMAKE_INSTALL_DATADIR}/palpate)
