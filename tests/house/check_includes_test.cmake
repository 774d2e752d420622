# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/check_includes.sh -DWORK=... -P check_includes_test.cmake
# The negative control of check_includes.sh: small trees with one violation each must be refused, with its place.
cmake_minimum_required(VERSION 3.25)
get_filename_component(checkout ${SCRIPT}/../.. ABSOLUTE)
set(licence "// SPDX-License-Identifier: Apache-2.0\n")

# A tree in which all is well.
function(make_clean_tree)
  file(REMOVE_RECURSE ${WORK})
  file(COPY ${checkout}/CMakeLists.txt DESTINATION ${WORK})  # which rooms are which library
  file(WRITE ${WORK}/geometry/vec.h "${licence}#pragma once\n#include <cmath>\n#include <glm/vec3.hpp>\n")
  file(WRITE ${WORK}/geometry/internal/embree.h "${licence}#pragma once\n#include <embree3/rtcore.h>\n#include <embree4/rtcore.h>\n")
  file(WRITE ${WORK}/volume/fields/grid_field.cpp "${licence}#include <openvdb/openvdb.h>\n#include <palpate/geometry/vec.h>\n")
  file(WRITE ${WORK}/haptics/solver/proxy_solver.h "${licence}#pragma once\n#include <array>\n#include <palpate/volume/scalar_field.h>\n")
  file(WRITE ${WORK}/drivers/device.h "${licence}#pragma once\n#include <palpate/geometry/vec.h>\n")
  file(WRITE ${WORK}/engine/loop.cpp "${licence}#include <thread>\n#include <palpate/drivers/device.h>\n#include <sys/mman.h>\n")
  file(WRITE ${WORK}/scripts/run.sh "#!/bin/sh\n# SPDX-License-Identifier: Apache-2.0\n")
endfunction()

function(check status_variable output_variable)
  execute_process(COMMAND ${SCRIPT} ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  set(${status_variable} ${status} PARENT_SCOPE)
  set(${output_variable} "${output}${errors}" PARENT_SCOPE)
endfunction()

# The clean tree with `line` as line 2 of `file` must give exactly one message, "file:2: ...what...".
function(expect_violation file line what)
  make_clean_tree()
  file(WRITE ${WORK}/${file} "${licence}${line}\n#pragma once\n")
  check(status output)
  string(REGEX MATCHALL "\n" messages "${output}")
  list(LENGTH messages message_count)
  string(FIND "${output}" "${file}:2: " place)
  string(FIND "${output}" "${what}" text)
  if(NOT status EQUAL 1 OR NOT message_count EQUAL 1 OR NOT place EQUAL 0 OR text EQUAL -1)
    message(SEND_ERROR "'${line}' in ${file}: status ${status}, wanted one message with '${what}', got:\n${output}")
  endif()
endfunction()

make_clean_tree()
check(status output)
if(NOT status EQUAL 0 OR NOT output STREQUAL "")
  message(SEND_ERROR "the clean tree is refused (${status}):\n${output}")
endif()

# Arrows.
expect_violation(geometry/a.cpp "#include <palpate/volume/scalar_field.h>" "geometry must not include volume")
expect_violation(volume/a.cpp "#include <palpate/haptics/effects/effect.h>" "volume must not include haptics")
expect_violation(haptics/a.cpp "#include <palpate/engine/loop/frame_report.h>" "haptics must not include engine")
expect_violation(haptics/a.cpp "#include <palpate/drivers/device.h>" "haptics must not include drivers")
expect_violation(drivers/a.h "#include <palpate/haptics/effects/effect.h>" "drivers must not include haptics")
expect_violation(engine/run/a.cpp "#include <palpate/command/a.h>" "engine must not include command")
expect_violation(engine/scene/a.cpp "#include <palpate/engine/loop/frame_report.h>" "engine/scene must not include")
expect_violation(engine/text/internal/a.h "#include <palpate/engine/scene/scene.h>" "engine/text must not include")
expect_violation(haptics/contact/a.h "#include <palpate/haptics/effects/effect.h>" "haptics/contact must not include")
expect_violation(volume/a.h "#include <palpate/volume/formats/volume_file.h>" "volume/a.h must not include")
expect_violation(geometry/a.cpp "#include <palpate/geometry/formats/mesh_file.h>" "geometry/a.cpp must not include")
expect_violation(engine/a.cpp "#include \"frame_report.h\"" "not quotes")
expect_violation(engine/scene/a.h "#include <palpate/engine/scene/internal/toml_reader.h>" "private")
expect_violation(python/bindings/a.cpp "#include <palpate/engine/scene/internal/toml_reader.h>" "private")
expect_violation(c/a.cpp "#include <palpate/engine/scene/internal/toml_reader.h>" "private")
expect_violation(engine/a.cpp "#include <palpate/c/a.h>" "engine must not include c")
expect_violation(engine/run/a.cpp "#include <pybind11/numpy.h>" "belongs to ^python/bindings/ alone")
expect_violation(engine/scene/effects/a.h "#include <palpate/engine/scene/internal/effect_room.h>" "private")

# Libraries of ours.
expect_violation(engine/scene/a.cpp "#include <palpate/volume/formats/volume_file.h>" "palpate::palpate must not include palpate::files")
expect_violation(engine/scene/a.h "#include <palpate/geometry/formats/mesh_file.h>" "palpate::palpate must not include palpate::files")
expect_violation(engine/report/a.cpp "#include <palpate/engine/view/view_page.h>" "engine/report must not include")

make_clean_tree()
file(WRITE ${WORK}/CMakeLists.txt "# SPDX-License-Identifier: Apache-2.0\nset(files_rooms engine/files)\n")
check(status output)
if(NOT status EQUAL 2 OR NOT output MATCHES "no line set.report_rooms")
  message(SEND_ERROR "a checkout that does not say which rooms are palpate::report: status ${status}, got:\n${output}")
endif()

# Libraries outside their home.
expect_violation(geometry/a.cpp "#include <embree3/rtcore.h>" "belongs to")
expect_violation(geometry/surface_scene.h "#include <embree3/rtcore.h>" "belongs to")
expect_violation(haptics/a.cpp "  #  include  <embree3/rtcore.h>" "belongs to")
expect_violation(haptics/a.cpp "#include <immintrin.h>" "belongs to")
expect_violation(volume/a.cpp "#include <CGAL/refine_mesh_3.h>" "belongs to")
expect_violation(volume/a.h "#include <openvdb/openvdb.h>" "belongs to")
expect_violation(engine/a.cpp "#include <openvdb/openvdb.h>" "belongs to")
expect_violation(engine/a.cpp "#include <itkImage.h>" "belongs to")
expect_violation(engine/a.cpp "#include <hidapi/hidapi.h>" "belongs to")
expect_violation(engine/a.cpp "#include <toml++/toml.h>" "belongs to")
expect_violation(engine/a.cpp "#include <hdf5.h>" "belongs to")
expect_violation(engine/a.cpp "#include <CLI/CLI.hpp>" "belongs to")
expect_violation(engine/a.h "#include <nlohmann/json.hpp>" "belongs to")
expect_violation(haptics/a.cpp "#include <fmt/format.h>" "belongs to")
expect_violation(engine/a.h "#include <unistd.h>" "neither ours")
expect_violation(volume/a.cpp "#include <boost/beast.hpp>" "belongs to")
expect_violation(volume/a.cpp "#include <eigen/dense.hpp>" "neither ours")

# The loop neither waits nor prints, and the library does not print.
expect_violation(haptics/a.cpp "#include <thread>" "haptics must not include <thread>")
expect_violation(haptics/a.h "#include <mutex>" "haptics must not include <mutex>")
expect_violation(volume/a.cpp "#include <iostream>" "prints nothing")

# What a public header names of the standard library and of GLM, it includes, itself or by a header of ours.
expect_violation(engine/a.h "std::optional<int> a()" "std::optional, and nothing includes <optional>")
expect_violation(engine/a.h "inline void a(int b) { assert(b) }" "assert(, and nothing includes <cassert>")
expect_violation(engine/a.h "glm::dvec3 a()" "nothing includes <glm/...hpp>")
expect_violation(engine/a.h "std::nonsense a()" "std::nonsense: of which header?")
make_clean_tree()
file(WRITE ${WORK}/drivers/device.h
  "${licence}#pragma once\n#include <palpate/geometry/vec.h>\nglm::dvec3 at() // and no std::optional\ninline double a() { return std::sqrt(2.0)\; }\n")
file(WRITE ${WORK}/engine/internal/a.h "${licence}#pragma once\nstd::optional<int> a()\n")
check(status output)
if(NOT status EQUAL 0)
  message(SEND_ERROR "what comes by a header of ours, or is in none that is public, is refused (${status}):\n${output}")
endif()

# Guards.
make_clean_tree()
file(WRITE ${WORK}/geometry/vec.h "${licence}#include <cmath>\n")
check(status output)
if(NOT status EQUAL 1 OR NOT output MATCHES "^geometry/vec.h:1: no line #pragma once\n$")
  message(SEND_ERROR "a header without a guard: status ${status}, got:\n${output}")
endif()

# Licences.
make_clean_tree()
file(WRITE ${WORK}/scripts/run.sh "#!/bin/sh\n")
check(status output)
if(NOT status EQUAL 1 OR NOT output MATCHES "^scripts/run.sh:1: no line SPDX")
  message(SEND_ERROR "a script without a licence: status ${status}, got:\n${output}")
endif()

# A folder that is no checkout is no success.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
check(status output)
if(NOT status EQUAL 2)
  message(SEND_ERROR "an empty folder: status ${status}, got:\n${output}")
endif()
