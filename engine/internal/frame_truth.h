// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <palpate/engine/surface_audit.h>

namespace palpate::internal {

/// How far a frame's proxy is from where it should be.
struct FrameError {
    double level_m = 0.0; ///< from the surface, m; > 0: inside
    std::optional<double>
        position_m; ///< from the surface's point nearest to the probe, m; spheres only
};

/// What frames are compared with. Of surfaces that are felt: the level, as SurfaceAudit measures
/// it, in frames in contact. Of gradient_surface over a formula: the zero of the formula, in
/// every frame whose probe is behind it, so that a proxy which has fallen through counts as the
/// error that it is. Of gradient_surface over a file nothing is known. Not for the loop.
class FrameTruth {
public:
    /// The scene must outlive it.                                                       [setup]
    explicit FrameTruth(const Scene& scene);

    /// The farthest from its surface where there are several; nothing where the truth is not known
    /// or the frame touches nothing.                                                    [setup]
    std::optional<FrameError> of(const FrameReport& frame);

    /// The sphere that is felt, where it is all that is felt.                            [any]
    std::optional<FeltSphere> sphere() const noexcept;

private:
    struct Wall { // of a gradient_surface over a formula
        std::unique_ptr<FieldSampler> sampler;
        double trust_m = 0.0;
        std::optional<FeltSphere> sphere;
    };
    static std::optional<FrameError> of_surface(SurfaceAudit& audit, const FrameReport& frame);
    static std::optional<FrameError> of_wall(Wall& wall, const FrameReport& frame);

    std::vector<SurfaceAudit> audits_;
    std::vector<Wall> walls_;
};

} // namespace palpate::internal
