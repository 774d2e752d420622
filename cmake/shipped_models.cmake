# SPDX-License-Identifier: Apache-2.0
# Device models are data files, drivers/models/*.json; they are compiled in, so that a program finds them wherever it was moved to.
file(GLOB model_files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/drivers/models/*.json)
set(SHIPPED_MODELS "")
foreach(file IN LISTS model_files)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  string(APPEND SHIPPED_MODELS "    {\"${name}\", R\"model(${text})model\"},\n")
endforeach()
set(palpate_shipped_models ${PROJECT_BINARY_DIR}/shipped_models.cpp)
file(CONFIGURE OUTPUT ${palpate_shipped_models} CONTENT "#include <palpate/engine/devices/internal/shipped_models.h>
namespace palpate::internal {
namespace {
constexpr ShippedModel kModels[] = {
@SHIPPED_MODELS@};
}
std::span<const ShippedModel> shipped_models() noexcept { return kModels; }
}
" @ONLY)
