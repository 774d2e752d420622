// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <palpate/engine/truth/felt_level.h>
#include <palpate/engine/truth/place_on.h>

namespace palpate {

/// How far a frame's proxy is from where it should be.
struct FrameError {
    double level_m = 0.0; ///< from the surface, m; > 0: inside
    std::optional<double>
        position_m; ///< from the surface's point nearest to the probe, m; spheres only
};

/// What is true of a frame.
struct FrameFinding {
    std::optional<FrameError> error; ///< nothing where the truth is not known or nothing is touched
    std::optional<double> depth_m;   ///< of the proxy behind its level, m; 0 in front of it and in
                                     ///< its certificate's tolerance; nothing where none is known
};

/// What frames are compared with. Of surfaces that are felt: the level or, where the mesh alone is
/// felt, the mesh, as SurfaceAudit measures them, in frames in contact. Of gradient_surface over a
/// formula: the zero of the formula, in every frame whose probe is behind it, so that a proxy which
/// has fallen through counts as the error that it is. Of gradient_surface over a file nothing is
/// known. Not for the loop.
class FrameTruth {
public:
    enum class Measure {
        what_is_felt, ///< the mesh, of a surface that is felt by it
        levels,       ///< the level, of every surface that has one
    };
    /// The scene must outlive it.                                                       [setup]
    explicit FrameTruth(const Scene& scene, Measure measure = Measure::what_is_felt);

    /// Of several surfaces the one that the proxy is farthest from.                     [setup]
    FrameFinding of(const FrameReport& frame);

    /// The sphere that is felt, where it is all that is felt.                            [any]
    std::optional<FeltSphere> sphere() const noexcept;

private:
    struct Level {
        FeltLevel felt;
        std::unique_ptr<FieldSampler> sampler;
        LevelScale scale;
        std::optional<PlaceOn> place; // of a surface

        std::optional<Vec3> place_of(const FrameReport& frame) const noexcept {
            return place ? place->of(frame) : frame.proxy;
        }
    };
    static std::optional<FrameError> of_mesh(SurfaceAudit& audit, const FrameReport& frame);
    static std::optional<FrameError> of_level(Level& level, const FrameReport& frame);
    double depth(Level& level, const Vec3& proxy);

    std::vector<SurfaceAudit> meshes_;
    std::vector<Level> levels_;
    double deepest_m_ = 0.0; // so far: what is not as deep need not be measured twice
};

} // namespace palpate
