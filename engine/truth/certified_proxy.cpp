// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/truth/certified_proxy.h>

#include <memory>
#include <utility>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/truth/felt_level.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate {

std::vector<Vec3> certified_proxies(const Scene& scene, std::span<const DeviceState> inputs) {
    if (!levels_hold_alone(scene) || has_soft_layers(scene)) return {};
    std::vector<std::unique_ptr<SurfaceContact>> contacts;
    std::vector<SurfaceContact*> surfaces;
    for (const FeltLevel& level : felt_levels(scene)) {
        if (level.surface && level.surface->contact == ContactKind::guarded)
            contacts.push_back(scene.make_contact(*level.surface));
        else
            contacts.push_back(std::make_unique<VolumeContact>(level.field, level.settings));
        surfaces.push_back(contacts.back().get());
    }
    if (surfaces.empty()) return {};

    SteadyClock clock; // decides nothing of method adaptive
    Subdivision subdivision({}, surfaces, {}, clock);
    std::vector<Vec3> proxies;
    proxies.reserve(inputs.size());
    FrameContext frame;
    frame.stiffness = scene.description().coupling.stiffness_n_per_m;
    bool begins = true; // a trial, with its first place that a loop takes for one
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        begins = begins || inputs[i].trial != inputs[i - 1].trial;
        frame.probe = inputs[i].position;
        frame.start = proxies.empty() ? Vec3{0.0} : proxies.back();
        if (!SurfaceScene::answers_at(frame.probe) || inputs[i].freshness == Freshness::stale) {
            proxies.push_back(frame.start);
            continue;
        }
        if (std::exchange(begins, false)) {
            frame.start = frame.probe;
            subdivision.restart(frame.start);
        }
        proxies.push_back(subdivision.advance(frame).proxy);
    }
    return proxies;
}

} // namespace palpate
