# SPDX-License-Identifier: Apache-2.0
# Where there is no ITK: Debian 12 has none for arm64 (scripts/same_bits_aarch64.sh). In place of the two sources that use it,
# palpate_files has without_itk.cpp, which throws: whoever needs ITK sees it.
set(ITK_INCLUDE_DIRS "")
set(ITK_LIBRARIES "")
function(palpate_without_itk)
  get_target_property(sources palpate_files SOURCES)
  list(FILTER sources EXCLUDE REGEX "/volume/(filters/volume_filters|formats/volume_file)\\.cpp$")
  set_property(TARGET palpate_files PROPERTY SOURCES ${sources} ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/without_itk.cpp)
endfunction()
cmake_language(DEFER DIRECTORY ${CMAKE_SOURCE_DIR} CALL palpate_without_itk)
