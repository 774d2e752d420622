# SPDX-License-Identifier: Apache-2.0
include(CMakePackageConfigHelpers)
set(palpate_targets palpate)
if(PALPATE_WITH_CGAL)
  list(APPEND palpate_targets palpate_extraction)
endif()
install(TARGETS ${palpate_targets} EXPORT palpate_targets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS palpate_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
set_target_properties(palpate_command PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
foreach(folder IN LISTS palpate_folders)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/palpate
    FILES_MATCHING PATTERN "*.h" PATTERN internal EXCLUDE PATTERN command EXCLUDE PATTERN palpate.h EXCLUDE)
endforeach()
install(FILES ${palpate_include}/palpate/version.h ${CMAKE_SOURCE_DIR}/engine/loop/palpate.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/palpate)
install(EXPORT palpate_targets NAMESPACE palpate:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
configure_package_config_file(cmake/palpate-config.cmake.in ${CMAKE_BINARY_DIR}/palpate-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/palpate-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/palpate-config.cmake ${CMAKE_BINARY_DIR}/palpate-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/palpate)
install(FILES ${CMAKE_SOURCE_DIR}/drivers/70-palpate.rules DESTINATION ${CMAKE_INSTALL_DATADIR}/palpate)
