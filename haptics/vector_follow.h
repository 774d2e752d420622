// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <palpate/haptics/effect.h>
#include <palpate/haptics/streamline.h>
#include <palpate/haptics/transfer_function.h>
#include <palpate/volume/vector_field.h>

namespace palpate {

/// What guides the proxy within a frame.
enum class FollowGuide {
    tangent,    ///< the vector at the current proxy, through it: the paper's line, which drifts off
                ///< by a share of each step's square; subdivision divides the drift
    midpoint,   ///< the streamline through the frame's start, by midpoint steps
    streamline, ///< the same by Runge-Kutta steps
};

/// Movement along the vectors is free, across them the proxy is drawn back and slips above a
/// strength: a line primitive, s |Pi (x' - q)|.                    numerics 3.4, composition.md 1
/// s in N is a transfer function of the vector's length at the frame's start; q and the line's
/// direction are the point and tangent of the streamline through the frame's start at which the
/// pull along it vanishes: at first the probe's, then that of the last solution. A proxy that has
/// slipped follows the streamline that it has come to. There is no level to return to, so what a
/// step misses is lost; a high order is the only cure. Signs of the vectors do not matter: on
/// GridVectorField with axial vectors this is the following of fibres.
class VectorFollow final : public Effect {
public:
    /// Strength in N over the vector's length; may be infinite.                        [setup]
    VectorFollow(std::shared_ptr<const VectorField> field, const TransferFunction& strength,
                 FollowGuide guide = FollowGuide::streamline);

    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    void solved(const Vec3& end) noexcept override {
        if (!cut_) end_ = end;
    }
    void commit(const Vec3&) noexcept override {}
    QueryCount queries() const noexcept override { return {sampler_->samples(), 0, 0}; }

private:
    std::optional<LinePrimitive> line_at(const Vec3& point) noexcept;

    std::shared_ptr<const VectorField> field_;
    TransferFunction strength_;
    FollowGuide guide_;
    std::unique_ptr<VectorSampler> sampler_;
    Streamline streamline_;
    std::optional<LinePrimitive> start_; // through the frame's start; nothing where it is not felt
    Vec3 end_{0.0};                      // where the frame is likely to end
    bool cut_ = false;                   // beyond what is known of the streamline
};

} // namespace palpate
