// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/volume_filters.h>

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

// Voxels. ITK weights by exp(-sigma^2) I_n(sigma^2), whose second factor overflows beyond 26.6.
constexpr double kMostSigma = 25.0;

// The discrete Gaussian's tails hold less than kKernelError beyond 4 sigma (erfc(4/sqrt 2) = 6e-5);
// its Bessel weights fall more slowly where sigma is below a voxel, hence the constant.
int largest_kernel_width(double sigma) { return 2 * static_cast<int>(std::ceil(6.0 * sigma)) + 33; }

// Labels and voxel counts of a volume, far beyond what memory holds.
using ComponentLabel = std::uint32_t;

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
typename itk::Image<Pixel, 3>::Pointer image_on(const VoxelVolume& volume, Pixel* memory) {
    auto image = itk::Image<Pixel, 3>::New();
    image->SetRegions(region_of<Pixel>(volume));
    image->GetPixelContainer()->SetImportPointer(memory, volume.voxels(), false);
    return image;
}

/// 0 outside the material, else the number of its component, from 1 in no particular order.
std::vector<ComponentLabel> label_components(const VoxelVolume& volume, double level) {
    std::vector<unsigned char> material(volume.voxels());
    std::transform(volume.values.begin(), volume.values.end(), material.begin(),
                   [level](float value) -> unsigned char { return value >= level ? 1 : 0; });
    using Filter = itk::ConnectedComponentImageFilter<itk::Image<unsigned char, 3>,
                                                      itk::Image<ComponentLabel, 3>>;
    const auto filter = Filter::New();
    filter->SetInput(image_on(volume, material.data()));
    filter->FullyConnectedOn();
    filter->Update();
    const ComponentLabel* const labels = filter->GetOutput()->GetBufferPointer();
    return {labels, labels + volume.voxels()};
}

struct Component {
    std::size_t voxels = 0;
    std::size_t first = 0; ///< index of its first voxel, i fastest
    ComponentLabel label = 0;
};

/// Largest first; of equals the one that comes first in the volume, so that the order is unique.
std::vector<Component> sorted_components(const std::vector<ComponentLabel>& labels) {
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
    const std::size_t i = voxel % width, j = voxel / width % height, k = voxel / (width * height);
    return volume.index_to_scene.point(
        {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
}

/// "x to x, y to y, z to z mm (LPS)" of the voxel centres.
std::string scene_box_text(const VoxelVolume& volume) {
    Box box;
    for (int corner = 0; corner < 8; ++corner)
        box.add(volume.index_to_scene.point({corner & 1 ? volume.size[0] - 1 : 0,
                                             corner & 2 ? volume.size[1] - 1 : 0,
                                             corner & 4 ? volume.size[2] - 1 : 0}));
    const auto mm = [](double metres) {
        return std::to_string(static_cast<long long>(std::lround(1e3 * metres)));
    };
    std::string text;
    for (int axis = 0; axis < 3; ++axis)
        text += (axis == 0 ? "" : ", ") + mm(box.lower[axis]) + " to " + mm(box.upper[axis]);
    return text + " mm (LPS)";
}

float value_of_removed(double level, double margin) {
    if (!(std::isfinite(level) && margin > 0.0))
        throw std::invalid_argument("remove_components: level must be finite and margin > 0");
    // Of a level far above its margin the next float below it is the nearest that there is.
    float removed = static_cast<float>(level - margin);
    constexpr float kLeast = -std::numeric_limits<float>::infinity();
    while (!(removed < level) && std::isfinite(removed))
        removed = std::nextafter(removed, kLeast);
    if (!std::isfinite(removed))
        throw std::invalid_argument("remove_components: the level is out of a float's range");
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

VoxelVolume cropped(const VoxelVolume& volume, const Box& region_m) {
    require_filled(volume, "cropped");
    if (!is_finite(region_m.lower) || !is_finite(region_m.upper))
        throw std::invalid_argument("a corner of it is not finite; the volume is from " +
                                    scene_box_text(volume));
    const AffineTransform scene_to_index = volume.index_to_scene.inverse();
    Box region;
    for (int corner = 0; corner < 8; ++corner)
        region.add(scene_to_index.point({(corner & 1 ? region_m.upper : region_m.lower).x,
                                         (corner & 2 ? region_m.upper : region_m.lower).y,
                                         (corner & 4 ? region_m.upper : region_m.lower).z}));
    std::array<int, 3> first{};
    VoxelVolume result;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const double last = volume.size[a] - 1;
        // Written so that NaN is no overlap either.
        if (!(region.lower[axis] <= last && region.upper[axis] >= 0.0))
            throw std::invalid_argument("no voxel of the volume lies in it; the volume is from " +
                                        scene_box_text(volume));
        first[a] = static_cast<int>(std::floor(std::max(region.lower[axis], 0.0)));
        const int end = static_cast<int>(std::ceil(std::min(region.upper[axis], last)));
        result.size[a] = end - first[a] + 1;
    }
    result.values.reserve(result.voxels());
    for (int k = 0; k < result.size[2]; ++k)
        for (int j = 0; j < result.size[1]; ++j) {
            const auto row =
                volume.values.begin() +
                static_cast<std::ptrdiff_t>(volume.index(first[0], first[1] + j, first[2] + k));
            result.values.insert(result.values.end(), row, row + result.size[0]);
        }
    result.index_to_scene = volume.index_to_scene;
    result.index_to_scene.offset = volume.index_to_scene.point({first[0], first[1], first[2]});
    result.source_type = volume.source_type;
    result.warnings = volume.warnings;
    return result;
}

void clear_far_from_level(VoxelVolume& volume, double level, float background) {
    require_filled(volume, "clear_far_from_level");
    constexpr int kBlock = 8, kStencil = 3;
    std::array<int, 3> blocks{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        blocks[axis] = (volume.size[axis] + kBlock - 1) / kBlock;
    const auto block_index = [&](int i, int j, int k) {
        return static_cast<std::size_t>(i) +
               static_cast<std::size_t>(blocks[0]) *
                   (static_cast<std::size_t>(j) +
                    static_cast<std::size_t>(blocks[1]) * static_cast<std::size_t>(k));
    };
    // Every voxel at the level marks the blocks that its stencil reaches.
    std::vector<char> near(block_index(0, 0, blocks[2]), 0);
    const auto reached = [](int at, int count) {
        return std::array<int, 2>{std::max(at - kStencil, 0) / kBlock,
                                  std::min((at + kStencil) / kBlock, count - 1)};
    };
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                if (volume.at(i, j, k) < level) continue; // NaN counts as near: nothing is known
                const auto bi = reached(i, blocks[0]), bj = reached(j, blocks[1]),
                           bk = reached(k, blocks[2]);
                for (const int c : bk)
                    for (const int b : bj)
                        for (const int a : bi)
                            near[block_index(a, b, c)] = 1;
            }
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i)
                if (!near[block_index(i / kBlock, j / kBlock, k / kBlock)])
                    volume.values[volume.index(i, j, k)] = background;
}

void smooth(VoxelVolume& volume, double sigma_voxels) {
    require_filled(volume, "smooth");
    if (!(sigma_voxels >= 0.0 && sigma_voxels <= kMostSigma))
        throw std::invalid_argument("smooth: sigma_voxels must be in [0, 25]");
    if (sigma_voxels == 0.0) return;
    using Image = itk::Image<float, 3>;
    const auto filter = itk::DiscreteGaussianImageFilter<Image, Image>::New();
    filter->SetInput(image_on(volume, volume.values.data()));
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

    const std::vector<ComponentLabel> labels = label_components(volume, level);
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
