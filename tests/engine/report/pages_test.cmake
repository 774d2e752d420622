# SPDX-License-Identifier: Apache-2.0
# cmake -DPYTHON=... -DPALPATE=... -DTEST_ENGINE=... -DWORK=... -P pages_test.cmake
# What people look at is looked at in Chromium: the pages of palpate report and palpate study, charts that are hard to lay out,
# and pictures of the docs, by scripts/check_pages.py. A page with each defect must have each of them named, or the script sees nothing.
cmake_minimum_required(VERSION 3.25)
get_filename_component(top ${CMAKE_CURRENT_LIST_DIR}/../../.. ABSOLUTE)
set(check ${PYTHON} ${top}/scripts/check_pages.py)

execute_process(COMMAND ${check} ${CMAKE_CURRENT_LIST_DIR}/broken_page.html RESULT_VARIABLE status OUTPUT_VARIABLE found
  ERROR_VARIABLE found)
if(status EQUAL 77)
  message("${found}")
  return()
endif()
if(NOT status EQUAL 1)
  message(FATAL_ERROR "check_pages.py ended with ${status} for a broken page:\n${found}")
endif()
foreach(defect "text of 9.0 px: \"tiny words\"" "390 px, dark: text of 6.7 px: \"no mark\"" "contrast 2.3 : 1: \"pale words\""
    "text over text: \"lower words\" and \"upper words\"" "beyond the page: \"far words\"" "the page is 1400 px wide on 1280 px"
    "cut off below: \"low box\"" "beyond its chart: \"cut words\"" "no marker in the legend: \"no mark\""
    "marker of another shape in the legend: \"other shape\"" "line looks otherwise in the legend: \"other line\""
    "only colour tells \"twin\" from \"other line\"" "no legend for series 4 of \"bad chart\"" "heading is not repeated: \"wide table"
    "a page may end within a row: \"wide table" "wider than the paper: \"wide table")
  string(FIND "${found}" "${defect}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "check_pages.py does not name this defect of the broken page: ${defect}\nIt says:\n${found}")
  endif()
endforeach()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/demo-output/data ${WORK}/examples)
file(COPY ${top}/examples/phantom.toml DESTINATION ${WORK}/examples)
set(ENV{PALPATE_CACHE} ${WORK}/cache)
set(ENV{PALPATE_CHART_PAGE} ${WORK}/charts.html)
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN} ended with ${status}:\n${said}")
  endif()
endfunction()
run(${PALPATE} phantom ${WORK}/demo-output/data/phantom.nrrd)
run(${PALPATE} trace ${WORK}/examples/phantom.toml --frames 1000 --out ${WORK}/phantom)
run(${PALPATE} trace ${top}/examples/cavity.toml --frames 1000 --out ${WORK}/cavity)
run(${PALPATE} trace ${top}/examples/cavity.toml --frames 1000 --method fixed --out ${WORK}/cavity-fixed)
run(${PALPATE} report ${WORK}/phantom ${WORK}/cavity ${WORK}/cavity-fixed -o ${WORK}/report.html)
run(${PALPATE} study ${top}/examples/bumpy_cavity.toml --frames 500 --out ${WORK}/study)
run(${PYTHON} ${top}/scripts/draw_pictures.py ${WORK})
run(${PYTHON} -B ${top}/scripts/draw_palpation.py ${WORK})
run(${TEST_ENGINE} --gtest_filter=SeriesChart.HardOnesFillAPage)
file(GLOB pictures ${WORK}/*.svg)
execute_process(COMMAND ${check} ${WORK}/report.html ${WORK}/study/index.html ${WORK}/charts.html ${pictures} RESULT_VARIABLE status
  OUTPUT_VARIABLE found ERROR_VARIABLE found)
message("${found}")
if(NOT status EQUAL 0)
  message(FATAL_ERROR "see above; scripts/check_pages.py --shots FOLDER PAGE draws what it saw")
endif()
