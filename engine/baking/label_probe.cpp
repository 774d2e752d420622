// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/label_probe.h>
#include <palpate/volume/formats/label_file.h>

#include <cmath>
#include <set>
#include <utility>

namespace palpate {
namespace {

std::shared_ptr<const LabelVolume> labels_of(const VolumeDescription& volume) {
    if (volume.label_volume) return volume.label_volume;
    return std::make_shared<const LabelVolume>(
        read_label_volume(volume.file, volume.labels, volume.selection));
}

} // namespace

LabelProbe::LabelProbe(const SceneDescription& scene) {
    std::set<std::string> names;
    for (const auto& [name, surface] : scene.surfaces)
        if (!surface.labels.empty()) names.insert(surface.volume);
    for (const std::string& name : names)
        place(labels_of(scene.volumes.at(name)));
}

LabelProbe::LabelProbe(std::vector<LabelVolume> volumes) {
    for (LabelVolume& volume : volumes)
        place(std::make_shared<const LabelVolume>(std::move(volume)));
}

void LabelProbe::place(std::shared_ptr<const LabelVolume> labels) {
    const AffineTransform inverse = labels->index_to_scene.inverse();
    volumes_.push_back({std::move(labels), inverse});
}

std::string_view LabelProbe::name_at(const Vec3& point) const noexcept {
    for (const auto& [volume, scene_to_index] : volumes_) {
        const LabelVolume& labels = *volume;
        const Vec3 index = glm::floor(scene_to_index.point(point) + 0.5);
        std::size_t at = 0, stride = 1;
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) {
            const int size = labels.size[static_cast<std::size_t>(axis)];
            inside = inside && index[axis] >= 0.0 && index[axis] < size; // false for NaN
            if (!inside) break;
            at += stride * static_cast<std::size_t>(index[axis]);
            stride *= static_cast<std::size_t>(size);
        }
        for (std::size_t layer = 0; inside && layer < labels.layers.size(); ++layer) {
            const std::int32_t value = labels.layers[layer][at];
            if (value == 0) continue;
            for (const Label& label : labels.labels)
                if (label.layer == layer && label.value == value) return label.name;
        }
    }
    return {};
}

void SteadyLabel::add(double time_s, const Vec3& probe) {
    const std::string_view here = labels_.name_at(probe);
    if (!std::exchange(has_begun_, true)) name_ = next_ = here;
    // A device's time that jumps back begins the wait again.
    if (here != next_ || time_s < next_since_s_) {
        next_ = here;
        next_since_s_ = time_s;
    }
    constexpr double kRounding_s = 1e-9; // of times that are added up
    if (time_s - next_since_s_ >= kSteady_s - kRounding_s) name_ = next_;
}

} // namespace palpate
