// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include <palpate/engine/scene_description.h>

namespace palpate::internal {

/// Which kind of volume an effect samples.
enum class FieldNeed {
    none,
    scalar,
    vector, ///< with a sense: velocities, a helix
    axial,  ///< without: fibres, also the principal direction of tensors
};

/// Where an effect samples its volume as others may, too.
enum class CommonPoint {
    none,
    frame_start, ///< the proxy of the frame's start, once a frame
    proxy,       ///< the current proxy, in each evaluation
};

/// When in a frame an effect is asked: each sees what those before it have added.
enum class EffectTurn {
    draws,  ///< forces and springs
    guides, ///< lines, points, sheets: they look where those draw
    limits, ///< and these where all the others lead
};

/// What is the same for all effects of a kind: one place for reader, plan and scene.
struct EffectTraits {
    std::string_view name; ///< in scenes
    FieldNeed need = FieldNeed::none;
    CommonPoint at = CommonPoint::none;
    double further_samples = 0.0;           ///< at points of its own, per evaluation
    bool may_be_hard = false;               ///< its strength may be infinite
    std::string_view how = "";              ///< in what way it enters a frame, in words
    std::array<std::string_view, 6> keys{}; ///< in scenes, besides `type`
    EffectTurn turn = EffectTurn::draws;
    bool of_surface = false;            ///< felt where a surface is, and only with it: no Effect
    double further_start_samples = 0.0; ///< at points of its own, in a frame's first evaluation, at
                                        ///< most
};

/// In the order of EffectKind.
inline constexpr std::array<EffectTraits, 18> kEffectTraits{{
    {"surface",
     FieldNeed::none,
     CommonPoint::none,
     0.0,
     true,
     "felt up to its strength",
     {"surface"},
     EffectTurn::draws,
     true},
    {"gradient_surface",
     FieldNeed::scalar,
     CommonPoint::proxy,
     0.0,
     true,
     "a plane through the proxy, against the gradient",
     {"volume", "strength_n"},
     EffectTurn::guides},
    {"constant_force",
     FieldNeed::none,
     CommonPoint::none,
     0.0,
     false,
     "shifts the probe's target exactly: needs no query",
     {"force_n"}},
    {"gradient_force",
     FieldNeed::scalar,
     CommonPoint::frame_start,
     0.0,
     false,
     "a force against the gradient, sampled once a frame",
     {"volume", "strength_n"}},
    {"viscosity",
     FieldNeed::scalar,
     CommonPoint::frame_start,
     0.0,
     false,
     "a spring to the frame's start: an exact shift and scale",
     {"volume", "surface", "damping_n_s_per_m"}},
    {"vector_force",
     FieldNeed::vector,
     CommonPoint::frame_start,
     0.0,
     false,
     "a force along the vector, sampled once a frame",
     {"volume", "strength_n"}},
    {"vector_follow",
     FieldNeed::vector,
     CommonPoint::frame_start,
     2.0,
     true,
     "a line along the streamline through the frame's start",
     {"volume", "strength_n", "guide"},
     EffectTurn::guides},
    {"fibre_follow",
     FieldNeed::axial,
     CommonPoint::frame_start,
     2.0,
     true,
     "a line along the fibre through the frame's start, whose sign does not matter",
     {"volume", "strength_n", "guide"},
     EffectTurn::guides},
    {"front_shape",
     FieldNeed::vector,
     CommonPoint::frame_start,
     1.0,
     true,
     "two opposed planes across the vector, through the frame's start; at start up to 2 samples "
     "more, to guess the end",
     {"volume", "strength_n"},
     EffectTurn::guides,
     false,
     2.0},
    {"vortex",
     FieldNeed::vector,
     CommonPoint::frame_start,
     1.0,
     true,
     "two opposed planes about the axis of rotation, through the frame's start; at start up to 2 "
     "samples more, to guess the end",
     {"volume", "strength_n"},
     EffectTurn::guides,
     false,
     2.0},
    {"friction",
     FieldNeed::none,
     CommonPoint::none,
     0.0,
     false,
     "a line along each contact's normal, as strong as the coefficient times what presses: "
     "needs no query",
     {"surface", "static", "dynamic"},
     EffectTurn::draws,
     true},
    {"stick_slip",
     FieldNeed::none,
     CommonPoint::none,
     0.0,
     false,
     "friction that comes to rest after each slip: needs no query",
     {"surface", "static", "dynamic"},
     EffectTurn::draws,
     true},
    {"guide",
     FieldNeed::scalar,
     CommonPoint::frame_start,
     0.0,
     true,
     "a line or point at the nearest place of the curve",
     {"points_mm", "file", "strength_n", "capture_mm", "ends", "volume"},
     EffectTurn::guides},
    {"workspace",
     FieldNeed::scalar,
     CommonPoint::frame_start,
     0.0,
     true,
     "planes where the proxy could leave it",
     {"radius_mm", "center_mm", "box_mm", "strength_n", "volume"},
     EffectTurn::limits},
    {"vibration",
     FieldNeed::none,
     CommonPoint::none,
     0.0,
     false,
     "a force on the device beside the coupling, after a contact begins: needs no query",
     {"surface", "amplitude_n_s_per_m", "frequency_hz", "decay_ms", "most_n"}},
    {"gravity_compensation",
     FieldNeed::none,
     CommonPoint::none,
     0.0,
     false,
     "a force on the device beside the coupling: needs no query",
     {"mass_kg", "down"}},
    {"magnet",
     FieldNeed::scalar,
     CommonPoint::frame_start,
     0.0,
     false,
     "a plane at the surface's own level that draws from behind: takes the surface's sample, or "
     "the "
     "closest point of its mesh",
     {"surface", "strength_n", "capture_mm", "volume"},
     EffectTurn::draws,
     true},
    {"texture",
     FieldNeed::scalar,
     CommonPoint::proxy,
     0.0,
     false,
     "heights in front of the surface's level, at its own sample",
     {"surface", "pattern", "wavelength_mm", "height_mm", "direction", "volume"},
     EffectTurn::draws,
     true},
}};

inline const EffectTraits& traits_of(EffectKind kind) {
    return kEffectTraits[static_cast<std::size_t>(kind)];
}

} // namespace palpate::internal
