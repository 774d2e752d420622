// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/moving_effect.h>

#include <algorithm>
#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {

MovingEffect::MovingEffect(std::unique_ptr<Effect> effect, const MovingSurface& body)
    : effect_(required("moving effect: effect", std::move(effect))), body_(&body),
      map_(body.pose()) {}

void MovingEffect::restart(const Vec3& proxy) noexcept {
    map_ = RigidMap(body_->pose());
    proxy_ = map_.point_back(proxy);
    effect_->restart(proxy_);
}

void MovingEffect::begin(const FrameContext& frame) noexcept {
    map_ = RigidMap(body_->pose());
    FrameContext seen = frame;
    seen.probe = map_.point_back(frame.probe);
    // Nobody was carried where the body has gone in silence, nor farther than the longest force
    // stretches the coupling: else what never yields would lead the proxy away from the hand.
    most_n_ = frame.force_limit_n;
    const double reach_m = most_n_ / frame.stiffness;
    const double carried_m = glm::length(map_.point(proxy_) - frame.probe);
    if (frame.after_silence || !(carried_m <= reach_m)) proxy_ = map_.point_back(frame.start);
    at_ = end_ = map_.point_back(frame.start);
    behind_ = proxy_ - at_;
    seen.start = proxy_;
    effect_->begin(seen);
}

void MovingEffect::gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept {
    // What an effect puts through the proxy goes along, too. A step makes up for its share of that.
    const Vec3 at = map_.point_back(proxy), step = end_ - at_;
    if (const double length2 = squared_length(step); length2 > 0.0)
        behind_ *= 1.0 - std::clamp(glm::dot(at - at_, step) / length2, 0.0, 1.0);
    at_ = at;
    const PrimitiveSet::Before before = primitives.enter(map_);
    effect_->gather(at + behind_, primitives);
    primitives.leave(map_, before, most_n_);
}

void MovingEffect::solved(const Vec3& end) noexcept {
    end_ = map_.point_back(end);
    effect_->solved(end_);
}

void MovingEffect::commit(const FrameOutcome& outcome) noexcept {
    proxy_ = map_.point_back(outcome.proxy);
    effect_->commit({proxy_, outcome.felt});
}

std::any MovingEffect::save_state() const { return State{effect_->save_state(), proxy_}; }

void MovingEffect::restore_state(const std::any& state) {
    const auto& from = std::any_cast<const State&>(state);
    effect_->restore_state(from.effect);
    proxy_ = from.proxy;
}

} // namespace palpate
