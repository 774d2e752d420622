# SPDX-License-Identifier: Apache-2.0
# cmake -DVALGRIND=... -DPALPATE=... -DWORK=... -P idle_effects_test.cmake
# An effect that is off costs nothing: callgrind counts the instructions of all frames of a trace, and a scene with effects of
# strength 0 must need exactly as many as the same without them. A scene with an effect that is on must need more, or what is
# counted is not the frames.
cmake_minimum_required(VERSION 3.25)
if(NOT VALGRIND)
  message("SKIPPED: valgrind is not installed; apt-get install valgrind")
  return()
endif()

file(REMOVE_RECURSE ${WORK})
set(path "t_s,x_m,y_m,z_m\n")
foreach(i RANGE 199) # into the ball and along it, 0.1 mm in a frame
  math(EXPR height "52000 - 50 * ${i}")
  string(APPEND path "${i}e-3,${i}e-4,0,${height}e-6\n")
endforeach()
file(WRITE ${WORK}/path.csv "${path}")

# The instructions of 200 frames of a ball's surface with `effects`.
function(count_instructions name effects result_variable)
  file(WRITE ${WORK}/${name}.toml "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
    "[surface.skin]\nvolume = \"ball\"\n[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n${effects}"
    "[device]\ntype = \"path\"\nfile = \"path.csv\"\n")
  execute_process(
    COMMAND ${VALGRIND} --tool=callgrind --callgrind-out-file=${WORK}/${name}.callgrind --collect-atstart=no
      "--toggle-collect=palpate::HapticLoop::frame(palpate::DeviceState const&, std::span*"
      ${PALPATE} trace ${WORK}/${name}.toml --out ${WORK}/${name}
    RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE errors)
  if(errors MATCHES "unrecognised instruction")
    message("SKIPPED: valgrind does not know the instruction set that this was built for; take PALPATE_ARCH=x86-64-v3")
    set(${result_variable} SKIPPED PARENT_SCOPE)
    return()
  endif()
  if(NOT status EQUAL 0 OR NOT errors MATCHES "Collected : ([0-9]+)")
    message(FATAL_ERROR "${name}: callgrind ended with ${status}:\n${errors}")
  endif()
  message("${name}: ${CMAKE_MATCH_1} instructions")
  set(${result_variable} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

count_instructions(without "" without)
if(without STREQUAL SKIPPED)
  return()
endif()
count_instructions(idle "[[effect]]\ntype = \"gradient_force\"\nvolume = \"ball\"\nstrength_n = 0\n\
[[effect]]\ntype = \"gradient_surface\"\nvolume = \"ball\"\nstrength_n = [[0, 0], [1, 0]]\n\
[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 0\n\
[[effect]]\ntype = \"friction\"\nsurface = \"skin\"\nstatic = 0\ndynamic = 0\n\
[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, 0]\n" idle)
count_instructions(felt "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 1\n" felt)
if(without EQUAL 0 OR NOT felt GREATER without)
  message(FATAL_ERROR "an effect that is on needs ${felt} instructions, none ${without}: not the frames are counted")
endif()
if(NOT idle EQUAL without)
  message(FATAL_ERROR "effects that are off need ${idle} instructions in 200 frames, none ${without}")
endif()
