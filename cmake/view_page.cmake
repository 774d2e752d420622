# SPDX-License-Identifier: Apache-2.0
# The page of `palpate view` (web/): one HTML file, ${palpate_view_html}, made by a custom command. npm gets what package-lock.json
# pins, once, and again when that changes. Empty without Node.js, within somebody else's project, and with -DPALPATE_NPM=OFF, which
# a machine without the npm registry needs.
set(palpate_view_html "")
find_program(PALPATE_NODE NAMES node nodejs)
find_program(PALPATE_NPM npm)
if(PROJECT_IS_TOP_LEVEL AND PALPATE_NODE AND PALPATE_NPM)
  set(palpate_web ${PROJECT_BINARY_DIR}/web)
  set(palpate_view_html ${palpate_web}/palpate_view.html)
  add_custom_command(OUTPUT ${palpate_web}/node_modules/.package-lock.json
    COMMAND ${CMAKE_COMMAND} -E make_directory ${palpate_web}
    COMMAND ${CMAKE_COMMAND} -E copy package.json package-lock.json ${palpate_web}
    COMMAND ${CMAKE_COMMAND} -E chdir ${palpate_web} ${PALPATE_NPM} ci --ignore-scripts --no-fund --no-audit --prefer-offline
      --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch ${palpate_web}/node_modules/.package-lock.json
    DEPENDS ${PROJECT_SOURCE_DIR}/web/package.json ${PROJECT_SOURCE_DIR}/web/package-lock.json
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}/web COMMENT "npm: what the page is built with" VERBATIM)
  file(GLOB_RECURSE palpate_web_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/web/src/*.js ${PROJECT_SOURCE_DIR}/web/*.css
    ${PROJECT_SOURCE_DIR}/web/*.html ${PROJECT_SOURCE_DIR}/web/*.mjs)
  add_custom_command(OUTPUT ${palpate_view_html} COMMAND ${PALPATE_NODE} ${PROJECT_SOURCE_DIR}/web/build.mjs ${palpate_web}
    DEPENDS ${palpate_web_sources} ${palpate_web}/node_modules/.package-lock.json
      ${PROJECT_SOURCE_DIR}/engine/report/internal/series_look.h
      ${PROJECT_SOURCE_DIR}/engine/picture/internal/force_colors.cpp
    COMMENT "the page of palpate view" VERBATIM)
  add_custom_target(palpate_view_page ALL DEPENDS ${palpate_view_html})
endif()
