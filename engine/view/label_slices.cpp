// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/label_slices.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/view/internal/voxel_blocks.h>

namespace palpate {
namespace {

/// What slices call the labels of a layer, by the layer's own values.
class LayerNumbers {
public:
    LayerNumbers(const LabelVolume& volume, std::size_t layer, std::size_t most) {
        for (std::size_t i = 0; i < std::min(volume.labels.size(), most); ++i)
            if (volume.labels[i].layer == layer)
                numbers_.emplace(volume.labels[i].value, static_cast<std::uint16_t>(i + 1));
    }
    std::uint16_t of(std::int32_t value) {
        if (value == 0) return 0;
        if (value != last_) { // neighbours are mostly alike
            const auto found = numbers_.find(value);
            number_ = found == numbers_.end() ? std::uint16_t{0} : found->second;
            last_ = value;
        }
        return number_;
    }

private:
    std::map<std::int32_t, std::uint16_t> numbers_;
    std::int32_t last_ = 0;
    std::uint16_t number_ = 0;
};

/// The number that most of `numbers` are, the greatest of them where several are as many.
std::uint16_t most_frequent(std::vector<std::uint16_t>& numbers) {
    std::ranges::sort(numbers);
    std::uint16_t best = 0;
    std::ptrdiff_t most = 0;
    for (auto begin = numbers.begin(); begin != numbers.end();) {
        const auto end = std::upper_bound(begin, numbers.end(), *begin);
        if (end - begin >= most) {
            most = end - begin;
            best = *begin;
        }
        begin = end;
    }
    return best;
}

} // namespace

std::string made_up_color(std::size_t place) {
    constexpr double kGoldenAngle = 137.50776; // degrees
    const double hue = std::fmod(kGoldenAngle * static_cast<double>(place), 360.0) / 30.0;
    const auto channel = [hue](double offset) {
        constexpr double kSaturation = 0.45, kLightness = 0.6;
        const double k = std::fmod(offset + hue, 12.0);
        const double share = kLightness - kSaturation * std::min(kLightness, 1.0 - kLightness) *
                                              std::clamp(std::min(k - 3.0, 9.0 - k), -1.0, 1.0);
        return std::lround(255.0 * share);
    };
    return fmt::format("#{:02x}{:02x}{:02x}", channel(0.0), channel(8.0), channel(4.0));
}

namespace {

SliceLabel slice_label(const Label& label, std::size_t place) {
    SliceLabel made;
    made.name = label.name;
    made.color = label.color ? fmt::format("#{:02x}{:02x}{:02x}", (*label.color)[0],
                                           (*label.color)[1], (*label.color)[2])
                             : made_up_color(place);
    return made;
}

} // namespace

LabelSlices label_slices(std::string name, const LabelVolume& volume, int most_edge) {
    const internal::VoxelBlocks blocks = internal::voxel_blocks(volume.size, most_edge);
    LabelSlices slices;
    slices.name = std::move(name);
    slices.shape = blocks.count;
    slices.index_to_scene = blocks.index_to_scene(volume.index_to_scene);
    constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();
    for (std::size_t i = 0; i < std::min(volume.labels.size(), kMost); ++i)
        slices.labels.push_back(slice_label(volume.labels[i], i));

    std::vector<LayerNumbers> layers;
    layers.reserve(volume.layers.size());
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
        layers.emplace_back(volume, layer, kMost);
    const auto number_at = [&](std::size_t voxel) {
        for (std::size_t layer = layers.size(); layer-- > 0;)
            if (const std::uint16_t number = layers[layer].of(volume.layers[layer][voxel]))
                return number;
        return std::uint16_t{0};
    };
    const auto rows = static_cast<std::size_t>(volume.size[0]);
    const auto slabs = rows * static_cast<std::size_t>(volume.size[1]);
    std::vector<std::uint16_t> numbers;
    slices.values.reserve(blocks.all());
    blocks.for_each([&](const std::array<int, 3>& first, const std::array<int, 3>& end) {
        numbers.clear();
        for (int k = first[2]; k < end[2]; ++k)
            for (int j = first[1]; j < end[1]; ++j)
                for (int i = first[0]; i < end[0]; ++i)
                    numbers.push_back(number_at(static_cast<std::size_t>(i) +
                                                rows * static_cast<std::size_t>(j) +
                                                slabs * static_cast<std::size_t>(k)));
        slices.values.push_back(most_frequent(numbers));
    });
    return slices;
}

} // namespace palpate
