// SPDX-License-Identifier: Apache-2.0
// What was touched, by what the frame has kept: nothing of a frame is computed anew.
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate {

/// What holds the proxy there against the coupling, forces and springs, N. Where a surface alone
/// leads it, that is the surface: its planes are those of where the way began.
Vec3 Subdivision::held_with(const Vec3& proxy) const noexcept {
    return primitives_.total_stiffness(frame_.stiffness) * (proxy - pull());
}

/// Keeps of a surface that pushes what is told when it does not any more.
void Subdivision::note_touch(LoopSurface& surface, const Vec3& proxy) const noexcept {
    Vec3 normal = surface.strongest_normal(solution_, contacts_);
    if (led_) {
        const Vec3 held = held_with(proxy);
        const double length = glm::length(held);
        if (length > 0.0) normal = held / length;
    }
    surface.note_touch(proxy, normal);
}

void Subdivision::find_touches(TouchList& touches) const noexcept {
    touches.clear();
    const Vec3& proxy = front(result_.proxy);
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (const Layer* layer = layer_of(i)) {
            if (layer->pushes || layer->pushed_before) touches.push_back(touch_of(*layer));
            continue;
        }
        const LoopSurface& surface = surfaces_[i];
        Touch touch;
        touch.surface = static_cast<std::uint32_t>(i);
        touch.point = surface.touched_at();
        touch.normal = surface.touched_normal();
        if (!surface.is_felt()) {
            touch.phase = Touch::Phase::ended;
            if (surface.pushed_before()) touches.push_back(touch);
            continue;
        }
        touch.phase = surface.pushed_before() ? Touch::Phase::goes_on : Touch::Phase::began;
        if (led_) {
            touch.force = softened_ * held_with(proxy) + aside_n_;
            touches.push_back(touch);
            continue;
        }
        for (std::size_t c = 0; c < contacts_.size(); ++c) {
            const PlaneOutcome& outcome = solution_.planes[c];
            if (contacts_[c].surface != i || outcome.state == MultiplierState::released) continue;
            const PlanePrimitive& plane = contacts_[c].plane;
            touch.normal = plane.normal;
            touch.point = proxy + glm::dot(plane.normal, plane.anchor - proxy) * plane.normal;
            touch.force = softened_ * (outcome.multiplier_n * plane.normal + friction_at(c));
            touches.push_back(touch);
        }
        if (!touches.empty()) touches[touches.size() - 1].force += aside_n_;
    }
}

/// What friction puts on the proxy at a plane of a surface, N.
Vec3 Subdivision::friction_at(std::size_t contact) const noexcept {
    const std::optional<std::size_t> line = friction_.line_at(contact);
    return line ? solution_.lines[*line].force_n : Vec3{0.0};
}

} // namespace palpate
