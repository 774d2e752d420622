# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=... -DWORK=... -DCOMPILER=... -DGLM=... -P glm_configuration_test.cmake
# GLM's macros in a host: those that give GLM's types another layout, or another way to be passed, are refused with a remedy while
# the host is compiled (with aligned types it crashed); the others leave every public header as it is.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
file(WRITE ${WORK}/host.cpp "#include <palpate/geometry/vec.h>\n")
set(compile ${COMPILER} -std=c++20 -Wall -Wextra -Werror -fsyntax-only -mavx2 -I${BUILD}/include -idirafter ${GLM})
run("a plain host" ${compile} host.cpp)
run_refused("aligned types" "define GLM_FORCE_DEFAULT_ALIGNED_GENTYPES nowhere"
  ${compile} -DGLM_FORCE_DEFAULT_ALIGNED_GENTYPES -DGLM_FORCE_INTRINSICS host.cpp)
run_refused("types that are not trivial" "define GLM_FORCE_CTOR_INIT nowhere" ${compile} -DGLM_FORCE_CTOR_INIT host.cpp)
run_refused("quaternions that begin with w" "define GLM_FORCE_QUAT_DATA_WXYZ nowhere" ${compile} -DGLM_FORCE_QUAT_DATA_WXYZ host.cpp)
run_refused("quaternions from x, y, z, w" "do not define GLM_FORCE_QUAT_CTOR_XYZW" ${compile} -DGLM_FORCE_QUAT_CTOR_XYZW host.cpp)

file(WRITE ${WORK}/host.cpp "#include <palpate/palpate.h>\n")
run("intrinsics" ${compile} -DGLM_FORCE_INTRINSICS host.cpp)
run("what changes no layout" ${compile} -DGLM_FORCE_SWIZZLE -DGLM_FORCE_EXPLICIT_CTOR -DGLM_FORCE_SIZE_T_LENGTH -DGLM_FORCE_XYZW_ONLY
  -DGLM_FORCE_RADIANS -DGLM_FORCE_LEFT_HANDED -DGLM_FORCE_DEPTH_ZERO_TO_ONE host.cpp)
