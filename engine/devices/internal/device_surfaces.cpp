// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/internal/device_surfaces.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/scene_surface.h>

#include <stdexcept>

#include <fmt/format.h>

namespace palpate::internal {
namespace {

/// Why effects of type "surface" are off that the device could go to; empty where there are none.
std::string reasons(const Scene& scene) {
    const std::string& wanted = scene.description().device.surface;
    std::string text;
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (planned.on || !makes_surface_felt(effect)) continue;
        if (!wanted.empty() && surface_of(effect) != wanted) continue;
        text += fmt::format("{}effect {}: {}", text.empty() ? "" : "; ", planned.effect + 1,
                            planned.reason);
    }
    return text;
}

} // namespace

std::vector<const SceneSurface*> surfaces_of_device(const Scene& scene) {
    const DeviceDescription& device = scene.description().device;
    std::vector<const SceneSurface*> surfaces;
    for (const SceneSurface& surface : scene.surfaces())
        if (device.surface.empty() || surface.name == device.surface) surfaces.push_back(&surface);
    if (!surfaces.empty()) return surfaces;
    const std::string what = device.surface.empty()
                                 ? "there is no surface that is felt to go to"
                                 : fmt::format("surface {} is not felt", device.surface);
    const std::string why = reasons(scene);
    const std::string words = why.empty() ? "; add an effect of type \"surface\" for it"
                                          : fmt::format(" ({}); change that, or give a path", why);
    throw std::runtime_error(
        fmt::format("{}: {}{}", place_of_device(scene.description()), what, words));
}

} // namespace palpate::internal
