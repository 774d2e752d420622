// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <palpate/haptics/effects/effect.h>
#include <palpate/volume/transfer_function.h>
#include <palpate/volume/vector_field.h>

namespace palpate {

/// Which sheets a vector field is felt as.
enum class SheetKind {
    front,  ///< across the vectors: the fronts of a wave that runs along them (front_shape)
    vortex, ///< across v x curl v, which points at the axis about which the vectors turn: the tubes
            ///< around it (vortex). Nothing where they are parallel, or do not turn
};

/// Movement on a sheet is free; off it, to either side, the proxy is held and slips above a
/// strength: two opposed planes, s |n.(x' - x0)|.                   numerics 1.1, composition.md 1
/// s in N is a transfer function of the vector's length at the frame's start x0; the planes go
/// through x0, and n is the normal halfway between it and the end of the frame. That is the
/// implicit midpoint rule: on spheres and cylinders it keeps the radius exactly, elsewhere an error
/// of the third order is left in each frame. Signs of the vectors do not matter.
class VectorSheet final : public Effect {
public:
    /// Strength in N over the vector's length; may be infinite. Throws std::invalid_argument
    /// where it is below 0, and where there is no field.                               [setup]
    VectorSheet(std::shared_ptr<const VectorField> field, const TransferFunction& strength,
                SheetKind kind);

    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    void solved(const Vec3& end) noexcept override { end_ = end; }
    std::size_t most_primitives() const noexcept override { return 2; } // opposed planes
    QueryCount queries() const noexcept override { return {sampler_->samples(), 0, 0}; }

private:
    std::optional<Vec3> normal_of(const VectorSample& sample) const noexcept;
    Vec3 normal_halfway() noexcept;
    void guess_end(double give_m) noexcept;

    std::shared_ptr<const VectorField> field_;
    TransferFunction strength_;
    SheetKind kind_;
    std::unique_ptr<VectorSampler> sampler_;
    std::optional<PlanePrimitive> start_; // through the frame's start; nothing where it is not felt
    Vec3 probe_{0.0};
    double stiffness_ = 0.0; // of the coupling, N/m
    Vec3 end_{0.0};          // where the frame is likely to end
    bool guessed_ = false;
    bool looks_ = false;
};

} // namespace palpate
