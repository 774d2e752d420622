// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/surface_magnets.h>

#include <limits>

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

SurfaceMagnets::SurfaceMagnets(std::vector<SurfaceMagnet> of_surfaces)
    : gains_(of_surfaces.size(), 1.0), found_(of_surfaces.size()) {
    for (const SurfaceMagnet& magnet : of_surfaces)
        captures_.push_back(capture_of(magnet));
}

void SurfaceMagnets::restart() noexcept {
    for (GuideCapture& capture : captures_)
        capture.restart();
}

void SurfaceMagnets::begin(const FrameContext& frame) noexcept {
    begins_ = true;
    for (GuideCapture& capture : captures_)
        capture.strength_at(frame);
}

void SurfaceMagnets::find(const Vec3& proxy, const Vec3& pull,
                          std::span<SurfaceContact* const> surfaces) noexcept {
    for (std::size_t i = 0; i < captures_.size(); ++i) {
        found_[i].reset();
        GuideCapture& capture = captures_[i];
        if (!is_on(i)) {
            capture.let_go();
            continue;
        }
        if (!begins_ && !capture.holds()) continue;
        found_[i] = surfaces[i]->nearest(proxy, pull, capture.reach_m());
        if (begins_) capture.begin(found_[i] ? 0.0 : std::numeric_limits<double>::infinity());
    }
    begins_ = false;
}

void SurfaceMagnets::gather(ContactSet& contacts) const noexcept {
    for (std::size_t i = 0; i < captures_.size(); ++i)
        if (found_[i]) contacts.add(from_behind(*found_[i], gains_[i] * captures_[i].strength_n()));
}

std::uint64_t SurfaceMagnets::samples() const noexcept {
    std::uint64_t sum = 0;
    for (const GuideCapture& capture : captures_)
        sum += capture.samples();
    return sum;
}

} // namespace palpate
