// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/volume_filters.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include <itkConnectedComponentImageFilter.h>
#include <itkDiscreteGaussianImageFilter.h>
#include <itkImage.h>

namespace palpate {
namespace {

// Share of the Gaussian's weight that its truncated kernel may lack; the kernel is normalised.
constexpr double kKernelError = 1e-4;

// The discrete Gaussian's tails hold less than kKernelError beyond 4 sigma (erfc(4/sqrt 2) = 6e-5);
// its Bessel weights fall more slowly where sigma is below a voxel, hence the constant.
int largest_kernel_width(double sigma) { return 2 * static_cast<int>(std::ceil(6.0 * sigma)) + 33; }

// Labels and voxel counts of a volume, far beyond what memory holds.
using Label = std::uint32_t;

void require_filled(const VoxelVolume& volume, const char* who) {
    const auto [i, j, k] = volume.size;
    if (std::min({i, j, k}) < 1 || volume.values.size() != volume.voxels())
        throw std::invalid_argument(std::string(who) +
                                    ": the volume is empty or its values do not fill its size");
}

template <class Pixel>
typename itk::Image<Pixel, 3>::RegionType region_of(const VoxelVolume& v) {
    typename itk::Image<Pixel, 3>::SizeType size;
    for (unsigned axis = 0; axis < 3; ++axis)
        size[axis] = static_cast<itk::SizeValueType>(v.size[axis]);
    return {size};
}

/// An ITK image on somebody else's memory, which it does not free.
template <class Pixel>
typename itk::Image<Pixel, 3>::Pointer image_on(const VoxelVolume& volume,
                                                std::vector<Pixel>& memory) {
    auto image = itk::Image<Pixel, 3>::New();
    image->SetRegions(region_of<Pixel>(volume));
    image->GetPixelContainer()->SetImportPointer(memory.data(), memory.size(), false);
    return image;
}

/// 0 outside the material, else the number of its component, from 1 in no particular order.
std::vector<Label> label_components(const VoxelVolume& volume, double level) {
    std::vector<unsigned char> material(volume.voxels());
    std::transform(volume.values.begin(), volume.values.end(), material.begin(),
                   [level](float value) -> unsigned char { return value >= level ? 1 : 0; });
    using Filter =
        itk::ConnectedComponentImageFilter<itk::Image<unsigned char, 3>, itk::Image<Label, 3>>;
    const auto filter = Filter::New();
    filter->SetInput(image_on(volume, material));
    filter->FullyConnectedOn();
    filter->Update();
    const Label* const labels = filter->GetOutput()->GetBufferPointer();
    return {labels, labels + volume.voxels()};
}

struct Component {
    std::size_t voxels = 0;
    std::size_t first = 0; ///< index of its first voxel, i fastest
    Label label = 0;
};

/// Largest first; of equals the one that comes first in the volume, so that the order is unique.
std::vector<Component> sorted_components(const std::vector<Label>& labels) {
    std::vector<Component> components;
    for (std::size_t voxel = 0; voxel < labels.size(); ++voxel) {
        if (labels[voxel] == 0) continue;
        if (labels[voxel] > components.size()) components.resize(labels[voxel]);
        Component& component = components[labels[voxel] - 1];
        if (component.voxels++ == 0) component.first = voxel;
        component.label = labels[voxel];
    }
    std::erase_if(components, [](const Component& c) { return c.voxels == 0; });
    std::sort(components.begin(), components.end(), [](const Component& a, const Component& b) {
        return a.voxels != b.voxels ? a.voxels > b.voxels : a.first < b.first;
    });
    return components;
}

bool is_kept(const ComponentPolicy& policy, std::size_t rank, double volume_mm3) {
    switch (policy.kind) {
    case ComponentPolicy::Kind::all:
        return true;
    case ComponentPolicy::Kind::largest:
        return rank == 0;
    case ComponentPolicy::Kind::count:
        return rank < policy.count;
    case ComponentPolicy::Kind::volume:
        return volume_mm3 > policy.volume_mm3;
    }
    return true;
}

Vec3 scene_position(const VoxelVolume& volume, std::size_t voxel) {
    const auto width = static_cast<std::size_t>(volume.size[0]);
    const auto height = static_cast<std::size_t>(volume.size[1]);
    return volume.index_to_scene.point({static_cast<double>(voxel % width),
                                        static_cast<double>(voxel / width % height),
                                        static_cast<double>(voxel / (width * height))});
}

float value_of_removed(double level, double margin) {
    const float removed = static_cast<float>(level - margin);
    if (!(std::isfinite(level) && margin > 0.0 && std::isfinite(removed)))
        throw std::invalid_argument("remove_components: level must be finite and margin > 0");
    if (!(removed < level))
        throw std::invalid_argument("remove_components: margin " + std::to_string(margin) +
                                    " vanishes in float beside level " + std::to_string(level));
    return removed;
}

} // namespace

VoxelVolume padded(const VoxelVolume& volume, int margin, float background) {
    require_filled(volume, "padded");
    if (margin < 0) throw std::invalid_argument("padded: margin must be >= 0");
    VoxelVolume result;
    for (std::size_t axis = 0; axis < 3; ++axis)
        result.size[axis] = volume.size[axis] + 2 * margin;
    result.values.assign(result.voxels(), background);
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j) {
            const auto row =
                volume.values.begin() + static_cast<std::ptrdiff_t>(volume.index(0, j, k));
            std::copy(row, row + volume.size[0],
                      result.values.begin() + static_cast<std::ptrdiff_t>(
                                                  result.index(margin, j + margin, k + margin)));
        }
    result.index_to_scene = volume.index_to_scene;
    result.index_to_scene.offset = volume.index_to_scene.point(Vec3(-margin));
    result.source_type = volume.source_type;
    result.warnings = volume.warnings;
    return result;
}

void smooth(VoxelVolume& volume, double sigma_voxels) {
    require_filled(volume, "smooth");
    if (!(sigma_voxels >= 0.0) || !std::isfinite(sigma_voxels))
        throw std::invalid_argument("smooth: sigma_voxels must be finite and >= 0");
    if (sigma_voxels == 0.0) return;
    using Image = itk::Image<float, 3>;
    const auto filter = itk::DiscreteGaussianImageFilter<Image, Image>::New();
    filter->SetInput(image_on(volume, volume.values));
    filter->SetUseImageSpacing(false);
    filter->SetVariance(sigma_voxels * sigma_voxels);
    filter->SetMaximumError(kKernelError);
    filter->SetMaximumKernelWidth(largest_kernel_width(sigma_voxels));
    filter->Update(); // outside, the border's value goes on: ITK's zero-flux Neumann default
    const float* const smoothed = filter->GetOutput()->GetBufferPointer();
    std::copy(smoothed, smoothed + volume.voxels(), volume.values.begin());
}

std::vector<VolumeComponent> remove_components(VoxelVolume& volume, double level,
                                               const ComponentPolicy& policy, double margin) {
    require_filled(volume, "remove_components");
    if (policy.count < 1 || !(policy.volume_mm3 >= 0.0))
        throw std::invalid_argument("remove_components: count must be >= 1, volume_mm3 >= 0");
    const float removed = value_of_removed(level, margin);

    const std::vector<Label> labels = label_components(volume, level);
    const std::vector<Component> components = sorted_components(labels);
    const double voxel_mm3 = 1e9 * std::abs(glm::determinant(volume.index_to_scene.linear));

    std::vector<VolumeComponent> result;
    std::vector<bool> unwanted(components.size() + 1, false); // by label
    for (const Component& component : components) {
        VolumeComponent described;
        described.voxels = component.voxels;
        described.volume_mm3 = voxel_mm3 * static_cast<double>(component.voxels);
        described.kept = is_kept(policy, result.size(), described.volume_mm3);
        described.sample = scene_position(volume, component.first);
        if (component.label >= unwanted.size()) unwanted.resize(component.label + 1, false);
        unwanted[component.label] = !described.kept;
        result.push_back(described);
    }
    for (std::size_t voxel = 0; voxel < labels.size(); ++voxel)
        if (unwanted[labels[voxel]]) volume.values[voxel] = removed;
    return result;
}

} // namespace palpate
