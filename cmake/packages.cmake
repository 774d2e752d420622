# SPDX-License-Identifier: Apache-2.0
# Debian packages: `cpack -G DEB` in a build folder. scripts/test_packages.sh installs, uses and removes them in a bare Debian.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The authors of Palpate" CACHE STRING "Who made the packages: NAME <ADDRESS>")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})  # where ours are; what needs them says so below
set(CPACK_COMPONENTS_ALL "")
file(READ NOTICE notice)
file(READ LICENSE licence)

# palpate_package(COMPONENT NAME SECTION WHAT [NEEDS package...]): a package of one component of ours. Packages of ours that it needs
# are needed in the same version. What is GPL as a whole says so first.
macro(palpate_package component name section what)
  cmake_parse_arguments(arg "GPL" "" "NEEDS" ${ARGN})
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} key)
  list(TRANSFORM arg_NEEDS REPLACE "(.*palpate.*)" "\\1 (= ${PROJECT_VERSION})")
  list(JOIN arg_NEEDS ", " CPACK_DEBIAN_${key}_PACKAGE_DEPENDS)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${key}_DESCRIPTION "${what}")
  if(section STREQUAL "libs")
    set(CPACK_DEBIAN_${key}_PACKAGE_GENERATE_SHLIBS ON)
  endif()
  set(terms "")
  if(arg_GPL)
    set(terms "This package is linked with CGAL, and as a whole under GPL-3.0-or-later: /usr/share/common-licenses/GPL-3.
The sources of Palpate itself are under the Apache License, Version 2.0, both below.\n\n")
  endif()
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/packages/${name}/copyright CONTENT "${terms}${notice}\n${licence}" @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/packages/${name}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
    COMPONENT ${component} EXCLUDE_FROM_ALL)
endmacro()

set(so ${PROJECT_VERSION_MAJOR})
palpate_package(run_time libpalpate${so} libs "The shared libraries.")
palpate_package(development libpalpate-dev libdevel "Headers, and what CMake and pkg-config need." NEEDS libpalpate${so} libglm-dev)
set(tools_gpl "")
if(PALPATE_WITH_CGAL)
  set(tools_gpl GPL)
  palpate_package(extraction libpalpate-extraction${so} libs "Meshes of isosurfaces by CGAL, under the GPL." GPL NEEDS libpalpate${so})
  palpate_package(extraction_development libpalpate-extraction-dev libdevel "What programs with extraction are built with." GPL
    NEEDS libpalpate-extraction${so} libpalpate-dev)
endif()
palpate_package(tools palpate science "The command, its pages and examples." ${tools_gpl})
if(PALPATE_PYTHON_IS_BUILT)
  # A compiled module fits one version of Python.
  math(EXPR next_minor "${PALPATE_PYTHON_MINOR} + 1")
  palpate_package(python python3-palpate python "The Python package."
    NEEDS libpalpate${so} "python3 (>= 3.${PALPATE_PYTHON_MINOR})" "python3 (<< 3.${next_minor})" python3-numpy)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/python_package/postinst
    ${PROJECT_SOURCE_DIR}/cmake/python_package/prerm)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  if(PALPATE_WITH_CGAL)
    palpate_package(python_extraction python3-palpate-extraction python "Meshes of isosurfaces by CGAL in Python, under the GPL." GPL
      NEEDS libpalpate-extraction${so} python3-palpate)
  endif()
endif()
include(CPack)
