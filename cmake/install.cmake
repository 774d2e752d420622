# SPDX-License-Identifier: Apache-2.0
# What is installed, by components; each is a Debian package (cmake/packages.cmake). What is under the GPL as a whole is apart.
include(CMakePackageConfigHelpers)
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
file(RELATIVE_PATH prefix_from_pc /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)

foreach(library IN LISTS palpate_libraries)
  set(gpl "")
  set(run_time run_time)
  if(library MATCHES "extraction")
    set(gpl extraction_)
    set(run_time extraction)
  endif()
  install(TARGETS ${library} EXPORT palpate_${gpl}targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${run_time} NAMELINK_COMPONENT ${gpl}development
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${gpl}development)
  # For pkg-config; not for static libraries, of which it would have to know all that they are linked with.
  if(library_type STREQUAL "SHARED")
    get_target_property(pc_requires ${library} INTERFACE_LINK_LIBRARIES)
    list(FILTER pc_requires INCLUDE REGEX "^(palpate|glm::)")
    list(TRANSFORM pc_requires REPLACE "glm::glm" "glm")
    list(TRANSFORM pc_requires REPLACE "^(palpate.*)" "\\1 = ${PROJECT_VERSION}")
    list(JOIN pc_requires ", " pc_requires)
    configure_file(cmake/library.pc.in ${PROJECT_BINARY_DIR}/pkgconfig/${library}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/pkgconfig/${library}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
      COMPONENT ${gpl}development)
  endif()
endforeach()
install(EXPORT palpate_targets NAMESPACE palpate:: DESTINATION ${config_folder} COMPONENT development)
if(PALPATE_WITH_CGAL)
  install(EXPORT palpate_extraction_targets NAMESPACE palpate:: DESTINATION ${config_folder} COMPONENT extraction_development)
endif()

install(CODE "
  set(PALPATE_SOURCE \"${PROJECT_SOURCE_DIR}\")
  set(PALPATE_INCLUDE \"${palpate_include}\")
  set(PALPATE_DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\")" COMPONENT development)
install(SCRIPT cmake/install_headers.cmake COMPONENT development)
configure_package_config_file(cmake/palpate-config.cmake.in ${PROJECT_BINARY_DIR}/palpate-config.cmake
  INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/palpate-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/palpate-config.cmake ${PROJECT_BINARY_DIR}/palpate-config-version.cmake
  DESTINATION ${config_folder} COMPONENT development)
if(library_type STREQUAL "STATIC")
  install(FILES cmake/third_party.cmake DESTINATION ${config_folder} COMPONENT development)
endif()

install(TARGETS palpate_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
set_target_properties(palpate_command PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
if(TARGET palpate_call_watch)
  install(TARGETS palpate_call_watch LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/palpate COMPONENT tools)
endif()
install(FILES drivers/70-palpate.rules DESTINATION ${CMAKE_INSTALL_DATADIR}/palpate COMPONENT tools)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md LICENSE NOTICE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/palpate COMPONENT tools)
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/palpate COMPONENT tools)
