// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/vector_follow.h>

#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// Of the last two tries: above it the solution runs off with the line, and a secant says nothing.
constexpr double kMostGain = 0.5;

} // namespace

VectorFollow::VectorFollow(std::shared_ptr<const VectorField> field,
                           const TransferFunction& strength, FollowGuide guide)
    : field_(required("vector_follow: field", std::move(field))),
      strength_(strength.check("vector_follow: strength", kNotNegativeOrInfinite)), guide_(guide),
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
    // A held probe has found the end already, but for what the last frame left.
    first_end_ = frame.held && !frame.looks ? frame.start : frame.probe;
    looks_ = frame.looks;
    last_try_.reset();
    evaluations_ = 0;
    start_ = line_at(frame.start);
    if (start_) streamline_.start(start_->anchor, start_->axis);
}

/// The probe's foot at first, then that of the last solution; from the second solution on, where
/// the secant of both puts it: the foot moves by depth times curvature of an error in it, and would
/// come to no end where that exceeds 1.
StreamlinePoint VectorFollow::next_foot() noexcept {
    StreamlinePoint foot = streamline_.nearest(end_);
    if (evaluations_ == 0) return foot;
    const Try now{foot_.way_m, foot.way_m};
    const std::optional<Try> before = std::exchange(last_try_, now);
    if (!before || now.put_m == before->put_m) return foot;
    const double gain = (now.found_m - before->found_m) / (now.put_m - before->put_m);
    if (!(gain < kMostGain)) return foot;
    const double step = (now.found_m - now.put_m) / (1.0 - gain); // 1 - gain > 1 - kMostGain
    return step == 0.0 ? foot : streamline_.at(now.put_m + step);
}

void VectorFollow::gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept {
    if (guide_ == FollowGuide::tangent) {
        if (const std::optional<LinePrimitive> line = line_at(proxy)) primitives.add_line(*line);
        return;
    }
    if (!start_) return;
    if (std::exchange(looks_, false)) { // does it rest where it is?
        primitives.add_line(*start_);
        return;
    }
    if (evaluations_ == 0) end_ = first_end_;
    // Further than a cut nothing is known of the way: it goes on in the next frame.
    if (!(evaluations_ > 0 && foot_.cut)) foot_ = next_foot();
    ++evaluations_;
    primitives.add_line({foot_.position, foot_.tangent, start_->strength_n});
    if (foot_.cut) primitives.add({foot_.position, -foot_.tangent, start_->strength_n});
}

} // namespace palpate
