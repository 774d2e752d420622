// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/scene/scene_surface.h>

#include <algorithm>

#include <fmt/format.h>

namespace palpate {

std::vector<std::string> felt_names(const Scene& scene) {
    std::vector<std::string> names;
    for (const SceneSurface& surface : scene.surfaces())
        if (names.size() < kFeltBits) names.push_back(surface.name);
    return names;
}

std::string felt_in_words(std::uint64_t felt, std::span<const std::string> names) {
    std::string text;
    for (std::size_t i = 0; i < names.size() && i < kFeltBits; ++i) {
        if ((felt >> i & 1) == 0) continue;
        if (!text.empty()) text += '+';
        text += names[i];
    }
    return text;
}

std::vector<FeltSurface> felt_surfaces(std::span<const std::string> names,
                                       std::span<const FrameReport> frames, double period_s) {
    std::vector<FeltSurface> surfaces(std::min(names.size(), kFeltBits));
    for (std::size_t i = 0; i < surfaces.size(); ++i)
        surfaces[i].name = names[i];
    double stood_s = 0.0; // counted while the device's time stood still
    for (std::size_t at = 0; at < frames.size(); ++at) {
        const FrameReport& frame = frames[at];
        const FrameReport* before =
            at > 0 && frames[at - 1].trial == frame.trial ? &frames[at - 1] : nullptr;
        // A period after silence or frames that are missing, and where a device's own time stands
        // still, jumps back or is no number; what stood still is not counted again.
        const bool follows =
            before != nullptr && is_computed(before->flags) && frame.frame <= before->frame + 1;
        const double since_s = follows ? frame.time_s - before->time_s : 0.0;
        const double lasts_s = since_s > 0.0 ? std::max(since_s - stood_s, 0.0) : period_s;
        stood_s = follows && since_s == 0.0 ? stood_s + period_s : 0.0;
        const double force_n = glm::length(frame.force);
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            if ((frame.surfaces_felt >> i & 1) == 0) continue;
            FeltSurface& surface = surfaces[i];
            ++surface.frames;
            surface.contact_s += lasts_s;
            surface.force_mean_n += force_n; // the sum, until it is divided
            surface.force_max_n = std::max(surface.force_max_n, force_n);
            if (before != nullptr && (before->surfaces_felt >> i & 1) != 0)
                surface.path_m += glm::distance(before->proxy, frame.proxy);
        }
    }
    for (FeltSurface& surface : surfaces)
        if (surface.frames > 0) surface.force_mean_n /= static_cast<double>(surface.frames);
    return surfaces;
}

std::string felt_warning(const Scene& scene) {
    const std::size_t count = scene.surfaces().size();
    if (count <= kFeltBits) return {};
    return fmt::format("the scene has {} surfaces, and only of the first {} it is recorded which "
                       "one is felt, and a vibration answers these alone; trace fewer at a time "
                       "where that matters",
                       count, kFeltBits);
}

} // namespace palpate
