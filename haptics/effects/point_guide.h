// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/guide_capture.h>

namespace palpate {

/// A magnet at a point q: s |x' - q| while it has the proxy (GuideCapture).      composition.md 1
/// The proxy is on q until the pull reaches s, then slips: in free space x' = a - r min(1, s / (k
/// |r|)), r = a - q. It is let go when it has slipped out of reach.
class PointGuide final : public Effect {
public:
    /// `point`: m, scene frame. Throws std::invalid_argument where it is not finite and on settings
    /// out of range.                                                                   [setup]
    PointGuide(const Vec3& point, const GuideSettings& settings)
        : point_(point), capture_(settings) {
        require_finite("guide: point", point);
    }

    void restart(const Vec3&) noexcept override { capture_.restart(); }
    void begin(const FrameContext& frame) noexcept override {
        if (!(capture_.strength_at(frame) > 0.0)) return capture_.let_go(); // it has nobody
        capture_.begin(glm::length(frame.start - point_));
    }
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        if (capture_.holds() && capture_.strength_n() > 0.0)
            primitives.add_point({point_, capture_.strength_n()});
    }
    bool is_active() const noexcept override { return true; }
    QueryCount queries() const noexcept override { return {capture_.samples(), 0, 0}; }
    std::any save_state() const override { return capture_.save_state(); }
    void restore_state(const std::any& state) override {
        capture_.restore_state(std::any_cast<const GuideCapture::State&>(state));
    }

private:
    Vec3 point_;
    GuideCapture capture_;
};

} // namespace palpate
