// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/vector_follow.h>

#include <limits>

namespace palpate {

VectorFollow::VectorFollow(std::shared_ptr<const VectorField> field,
                           const TransferFunction& strength, FollowGuide guide)
    : field_(std::move(field)), strength_(strength), guide_(guide),
      sampler_(field_->make_sampler()),
      streamline_(*sampler_, 0.5 * field_->feature_size_m(),
                  guide == FollowGuide::midpoint ? Streamline::Order::midpoint
                                                 : Streamline::Order::runge_kutta) {}

std::optional<LinePrimitive> VectorFollow::line_at(const Vec3& point) noexcept {
    const VectorSample here = sampler_->sample(point);
    const double length = glm::length(here.value);
    const double strength_n = strength_(length);
    if (!here.valid || !(length > 0.0) || !(strength_n > 0.0)) return std::nullopt;
    return LinePrimitive{point, here.value / length, strength_n};
}

void VectorFollow::begin(const FrameContext& frame) noexcept {
    if (guide_ == FollowGuide::tangent) return;
    end_ = frame.probe;
    cut_ = false;
    start_ = line_at(frame.start);
    if (start_) streamline_.start(start_->anchor, start_->axis);
}

void VectorFollow::gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept {
    if (guide_ == FollowGuide::tangent) {
        if (const std::optional<LinePrimitive> line = line_at(proxy)) primitives.add_line(*line);
        return;
    }
    if (!start_) return;
    const StreamlinePoint foot = streamline_.nearest(end_);
    primitives.add_line({foot.position, foot.tangent, start_->strength_n});
    // Further than this nothing is known of the way: it goes on in the next frame.
    cut_ = foot.cut;
    if (cut_)
        primitives.add({foot.position, -foot.tangent, std::numeric_limits<double>::infinity()});
}

} // namespace palpate
