// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/surface_magnets.h>

#include <limits>
#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

GuideCapture capture_of(const SurfaceMagnet& magnet) {
    require("magnet: strength_n", magnet.strength_n, kNotNegative);
    require("magnet: capture_m", magnet.capture_m, kPositive);
    return GuideCapture({magnet.strength_n, magnet.capture_m, magnet.over});
}

/// The same plane of the same level, of the field with the opposite sign.
ContactPlane from_behind(const ContactPlane& front, double strength_n) noexcept {
    ContactPlane back;
    back.plane = {front.plane.anchor, -front.plane.normal, strength_n};
    back.level_gap = -front.level_gap;
    back.slope = -front.slope;
    back.gradient_length = front.gradient_length;
    back.depth_hessian = -front.depth_hessian;
    return back;
}

} // namespace

LoopMagnet::LoopMagnet(const SurfaceMagnet& magnet) : capture_(capture_of(magnet)) {}

void LoopMagnet::begin(const FrameContext& frame) noexcept {
    begins_ = true;
    if (gain_.off())
        capture_.restart(); // it asks for nothing, and begins anew
    else
        capture_.strength_at(frame);
}

void LoopMagnet::offer(const Vec3& proxy, const Vec3& pull, SurfaceContact& surface,
                       ContactSet& contacts) noexcept {
    const bool begins = std::exchange(begins_, false);
    found_.reset();
    if (!is_on()) capture_.let_go();
    if (!is_on() || (!begins && !capture_.holds())) return surface.offer(proxy, contacts);
    NearestPlane nearest{pull, capture_.reach_m()};
    surface.offer(proxy, contacts, &nearest);
    found_ = nearest.found;
    if (begins) capture_.begin(found_ ? 0.0 : std::numeric_limits<double>::infinity());
}

void LoopMagnet::gather(ContactSet& contacts) const noexcept {
    if (found_) contacts.add(from_behind(*found_, gain_.strength_n(capture_.strength_n())));
}

} // namespace palpate
