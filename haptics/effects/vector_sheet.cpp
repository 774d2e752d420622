// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/vector_sheet.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// Below this sine between vector and rotation axis their common normal is rounding.
constexpr double kParallel = 1e-6;
// Each guess leaves depth / (2 radius) of the error of the one before.
constexpr int kGuesses = 3;

} // namespace

VectorSheet::VectorSheet(std::shared_ptr<const VectorField> field, const TransferFunction& strength,
                         SheetKind kind)
    : field_(required("vector_sheet: field", std::move(field))),
      strength_(strength.check("vector_sheet: strength", kNotNegativeOrInfinite)), kind_(kind),
      sampler_(field_->make_sampler()) {}

std::optional<Vec3> VectorSheet::normal_of(const VectorSample& sample) const noexcept {
    if (!sample.valid) return std::nullopt;
    const double length = glm::length(sample.value);
    if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
    if (kind_ == SheetKind::front) return sample.value / length;

    const Vec3 rotation = curl(sample.derivative);
    const Vec3 towards_axis = glm::cross(sample.value, rotation);
    const double product = glm::length(towards_axis);
    if (!(product > kParallel * length * glm::length(rotation))) return std::nullopt;
    return towards_axis / product;
}

void VectorSheet::begin(const FrameContext& frame) noexcept {
    start_.reset();
    const VectorSample here = sampler_->sample(frame.start);
    const double strength_n = strength_(glm::length(here.value));
    if (!(strength_n > 0.0)) return;
    const std::optional<Vec3> normal = normal_of(here);
    if (!normal) return;
    start_ = PlanePrimitive{frame.start, *normal, strength_n};
    probe_ = frame.probe;
    stiffness_ = frame.stiffness;
    guessed_ = false;
    looks_ = frame.looks;
}

/// The likely end before there is a solution: where this sheet alone lets the probe draw the proxy.
/// Its strength alone stretches the coupling by `give_m`.
void VectorSheet::guess_end(double give_m) noexcept {
    end_ = start_->anchor;
    for (int round = 0; round < kGuesses; ++round) {
        const Vec3 n = normal_halfway();
        const double off = glm::dot(n, probe_ - start_->anchor);
        end_ = probe_ - std::clamp(off, -give_m, give_m) * n;
    }
}

/// The normal halfway between the frame's start and its likely end; that of the start where there
/// is none.
Vec3 VectorSheet::normal_halfway() noexcept {
    if (end_ == start_->anchor) return start_->normal;
    const Vec3 halfway = 0.5 * (start_->anchor + end_);
    return normal_of(sampler_->sample(halfway)).value_or(start_->normal);
}

void VectorSheet::gather(const Vec3&, PrimitiveSet& primitives) noexcept {
    if (!start_) return;
    Vec3 n = start_->normal;
    if (!std::exchange(looks_, false)) { // else: does it rest where it is?
        // Not in begin(), whose one sample is for all effects to share.
        if (!guessed_) guess_end(primitives.scaled_n(start_->strength_n) / stiffness_);
        guessed_ = true;
        n = normal_halfway();
    }
    primitives.add({start_->anchor, n, start_->strength_n});
    primitives.add({start_->anchor, -n, start_->strength_n});
}

} // namespace palpate
