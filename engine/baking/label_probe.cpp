// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/label_probe.h>

#include <algorithm>
#include <map>
#include <utility>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/volume/formats/label_file.h>

namespace palpate {
namespace {

std::shared_ptr<const LabelVolume> labels_of(const VolumeDescription& volume) {
    if (volume.label_volume) return volume.label_volume;
    return std::make_shared<const LabelVolume>(
        read_label_volume(volume.file, volume.labels, volume.selection));
}

} // namespace

LabelProbe::LabelProbe(const Scene& scene) {
    const SceneDescription& description = scene.description();
    std::map<std::string, std::size_t> places;
    for (const auto& [name, surface] : description.surfaces)
        if (!surface.labels.empty()) places.emplace(surface.volume, 0);
    for (auto& [name, at] : places) {
        at = volumes_.size();
        place(labels_of(description.volumes.at(name)));
    }
    for (const SceneSurface& felt : scene.surfaces()) {
        const SurfaceDescription& surface = description.surfaces.at(felt.name);
        of_surfaces_.emplace_back();
        if (surface.labels.empty()) continue;
        OfSurface& of = of_surfaces_.back();
        of.volume = places.at(surface.volume);
        std::vector<std::string> names = surface.labels;
        if (felt.baked.joined) { // it reaches over its neighbours
            const std::vector<std::string> alike = labels_felt_alike(description, felt.name);
            names.insert(names.end(), alike.begin(), alike.end());
        }
        of.labels = find_labels(*volumes_[of.volume].labels, names);
    }
}

LabelProbe::LabelProbe(std::vector<LabelVolume> volumes) {
    for (LabelVolume& volume : volumes)
        place(std::make_shared<const LabelVolume>(std::move(volume)));
}

void LabelProbe::place(std::shared_ptr<const LabelVolume> labels) {
    const AffineTransform inverse = labels->index_to_scene.inverse();
    for (int axis = 0; axis < 3; ++axis) {
        const double spacing_m = glm::length(labels->index_to_scene.linear[axis]);
        finest_m_ = std::min(finest_m_, spacing_m);
        coarsest_m_ = std::max(coarsest_m_, spacing_m);
    }
    volumes_.push_back({std::move(labels), inverse});
}

std::optional<std::size_t> LabelProbe::Placed::voxel_at(const Vec3& point) const noexcept {
    const Vec3 index = glm::floor(scene_to_index.point(point) + 0.5);
    std::size_t at = 0, stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const int size = labels->size[static_cast<std::size_t>(axis)];
        if (!(index[axis] >= 0.0 && index[axis] < size)) return {}; // also for NaN
        at += stride * static_cast<std::size_t>(index[axis]);
        stride *= static_cast<std::size_t>(size);
    }
    return at;
}

std::string_view LabelProbe::name_at(std::size_t surface, const Vec3& point) const noexcept {
    if (surface >= of_surfaces_.size() || of_surfaces_[surface].labels.empty())
        return name_at(point);
    const OfSurface& of = of_surfaces_[surface];
    const Placed& volume = volumes_[of.volume];
    const std::optional<std::size_t> at = volume.voxel_at(point);
    if (!at) return {};
    for (const std::size_t chosen : of.labels) {
        const Label& label = volume.labels->labels[chosen];
        if (volume.labels->layers[label.layer][*at] == label.value) return label.name;
    }
    return {};
}

std::string_view LabelProbe::name_at(const Vec3& point) const noexcept {
    for (const Placed& placed : volumes_) {
        const LabelVolume& labels = *placed.labels;
        const std::optional<std::size_t> at = placed.voxel_at(point);
        for (std::size_t layer = 0; at && layer < labels.layers.size(); ++layer) {
            const std::int32_t value = labels.layers[layer][*at];
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
