// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/stepping/subdivision.h>

#include "tests/support/scripted_clock.h"

namespace palpate::test {

/// A proxy on surfaces and effects, without devices or files: what haptics tests drive.
class ContactLoop {
public:
    ContactLoop(const SteppingSettings& settings,
                std::vector<std::unique_ptr<SurfaceContact>> surfaces,
                std::vector<std::unique_ptr<Effect>> effects = {}, double clock_step_us = 0.0,
                std::vector<SurfaceFinish> finish = {})
        : clock_(clock_step_us), surfaces_(std::move(surfaces)), effects_(std::move(effects)) {
        std::vector<SurfaceContact*> surface_pointers;
        for (auto& surface : surfaces_)
            surface_pointers.push_back(surface.get());
        std::vector<Effect*> effect_pointers;
        for (auto& effect : effects_)
            effect_pointers.push_back(effect.get());
        subdivision_ = std::make_unique<Subdivision>(settings, surface_pointers, effect_pointers,
                                                     clock_, std::move(finish));
    }

    void start(const Vec3& proxy) {
        proxy_ = proxy;
        flags_at_start_ = subdivision_->restart(proxy);
    }
    SubdivisionResult move(const Vec3& probe, double period_s = 1e-3) {
        const SubdivisionResult result =
            subdivision_->advance({probe, proxy_, kStiffness, period_s});
        proxy_ = result.proxy;
        return result;
    }
    const Vec3& proxy() const { return proxy_; }
    std::uint32_t flags_at_start() const { return flags_at_start_; }
    Subdivision& subdivision() { return *subdivision_; }
    ScriptedClock& clock() { return clock_; }
    SurfaceContact& surface(std::size_t i) { return *surfaces_[i]; }

    static constexpr double kStiffness = 500.0; // N/m

private:
    ScriptedClock clock_;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces_;
    std::vector<std::unique_ptr<Effect>> effects_;
    std::unique_ptr<Subdivision> subdivision_;
    Vec3 proxy_{0.0};
    std::uint32_t flags_at_start_ = 0;
};

/// One volume contact with the level 0 (or another) of a field.
inline std::vector<std::unique_ptr<SurfaceContact>>
one_surface(std::shared_ptr<const ScalarField> field, LevelSettings level = {}) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<VolumeContact>(std::move(field), level));
    return surfaces;
}

} // namespace palpate::test
