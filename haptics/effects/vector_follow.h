// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <palpate/haptics/choices.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/streamline.h>
#include <palpate/volume/transfer_function.h>
#include <palpate/volume/vector_field.h>

namespace palpate {

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
    /// Strength in N over the vector's length; may be infinite. Throws std::invalid_argument
    /// where it is below 0, and where there is no field.                               [setup]
    VectorFollow(std::shared_ptr<const VectorField> field, const TransferFunction& strength,
                 FollowGuide guide = FollowGuide::streamline);

    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    void solved(const Vec3& end) noexcept override { end_ = end; }
    /// The line, and a plane where the way is cut.
    std::size_t most_primitives() const noexcept override { return 2; }
    QueryCount queries() const noexcept override { return {sampler_->samples(), 0, 0}; }

private:
    /// Where on the streamline a line was put, and where the solution with it came to lie.
    struct Try {
        double put_m = 0.0;
        double found_m = 0.0;
    };

    std::optional<LinePrimitive> line_at(const Vec3& point) noexcept;
    StreamlinePoint next_foot() noexcept;

    std::shared_ptr<const VectorField> field_;
    TransferFunction strength_;
    FollowGuide guide_;
    std::unique_ptr<VectorSampler> sampler_;
    Streamline streamline_;
    std::optional<LinePrimitive> start_; // through the frame's start; nothing where it is not felt
    // Of one frame: where it is likely to end, and what the tries so far came to.
    Vec3 first_end_{0.0};
    Vec3 end_{0.0};
    bool looks_ = false;
    StreamlinePoint foot_;
    std::optional<Try> last_try_;
    int evaluations_ = 0;
};

} // namespace palpate
