# SPDX-License-Identifier: Apache-2.0
# What CHAI3D's own build leaves, as far as bench/open/CMakeLists.txt reads it.
set(CHAI3D_INCLUDE_DIRS ${CMAKE_CURRENT_LIST_DIR})
set(CHAI3D_LIBRARIES "")
set(CHAI3D_LIBRARY_DIRS "")
