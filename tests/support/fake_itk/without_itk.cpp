// SPDX-License-Identifier: Apache-2.0
// In place of volume/filters/volume_filters.cpp and volume/formats/volume_file.cpp, where there is
// no ITK (ITKConfig.cmake beside this). Formulas and meshes need nothing of it; what does, throws.
#include <stdexcept>

#include <palpate/volume/filters/volume_filters.h>
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate {
namespace {

[[noreturn]] void without_itk() { throw std::logic_error("built without ITK"); }

} // namespace

VoxelVolume padded(const VoxelVolume&, int, float) { without_itk(); }
VoxelVolume cropped(const VoxelVolume&, const Box&) { without_itk(); }
void clear_far_from_level(VoxelVolume&, double, float) { without_itk(); }
void smooth(VoxelVolume&, double) { without_itk(); }
std::vector<VolumeComponent> remove_components(VoxelVolume&, double, const ComponentPolicy&,
                                               double) {
    without_itk();
}

void internal::require_choices(const std::filesystem::path&, const VolumeSelection&) {
    without_itk();
}
VoxelVolume read_volume(const std::filesystem::path&, const VolumeSelection&) { without_itk(); }
std::vector<VolumeEntry> list_volumes(const std::filesystem::path&) { without_itk(); }
bool is_written_volume(const std::filesystem::path&) { without_itk(); }
void write_volume(const VoxelVolume&, const std::filesystem::path&) { without_itk(); }

} // namespace palpate
