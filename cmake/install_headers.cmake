# SPDX-License-Identifier: Apache-2.0
# Installs the headers that a program of somebody else needs: those named here, and what they include. Contacts, solver and
# stepping are not named, but for sub_step.h: of the others only what a named header includes is installed. Run while installing, with PALPATE_SOURCE,
# PALPATE_INCLUDE (where version.h is) and PALPATE_DESTINATION set.
cmake_policy(VERSION 3.25)
set(wanted
  engine/loop/palpate.h engine/loop/effect_library.h engine/loop/device_safety.h engine/scene/validation.h engine/scene/scene_overrides.h engine/scene/hands.h
  engine/scene/contact_choice.h haptics/stepping/sub_step.h
  volume/volume_check.h geometry/mesh_check.h
  volume/fields/analytic_fields.h volume/fields/function_field.h volume/fields/grid_field.h volume/fields/grid_vector_field.h
  volume/filters/*.h volume/formats/*.h geometry/formats/*.h geometry/isosurface.h geometry/mesh_intersections.h
  geometry/mesh_report.h geometry/surface_seeds.h drivers/*.h engine/devices/*.h engine/run/*.h
  engine/truth/surface_distance.h engine/files/*.h engine/record/*.h engine/baking/*.h
  engine/picture/*.h engine/info/*.h engine/report/*.h engine/study/*.h engine/view/*.h engine/serve/*.h)
list(TRANSFORM wanted PREPEND ${PALPATE_SOURCE}/)
file(GLOB pending RELATIVE ${PALPATE_SOURCE} ${wanted})
set(installed "")
while(pending)
  list(POP_FRONT pending header)
  list(APPEND installed ${header})
  file(STRINGS ${PALPATE_SOURCE}/${header} includes REGEX "^#include <palpate/")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include <palpate/(.*)>.*" "\\1" included "${include}")
    if(NOT included STREQUAL "version.h" AND NOT included IN_LIST installed AND NOT included IN_LIST pending)
      list(APPEND pending ${included})
    endif()
  endforeach()
endwhile()
foreach(header IN LISTS installed)
  get_filename_component(folder ${header} DIRECTORY)
  if(header STREQUAL "engine/loop/palpate.h")
    set(folder "")
  endif()
  file(INSTALL ${PALPATE_SOURCE}/${header} DESTINATION ${PALPATE_DESTINATION}/palpate/${folder})
endforeach()
file(INSTALL ${PALPATE_SOURCE}/c/palpate_c.h ${PALPATE_SOURCE}/c/palpate_c_extraction.h ${PALPATE_SOURCE}/c/device_plugin.h
  DESTINATION ${PALPATE_DESTINATION}/palpate)
file(INSTALL ${PALPATE_INCLUDE}/palpate/version.h DESTINATION ${PALPATE_DESTINATION}/palpate)
