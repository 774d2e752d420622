// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/engine/study/baselines.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate::internal {

/// How far in front of a facet the proxy stops, m: far above rounding, far below what is felt.
inline constexpr double kFacetClearance_m = 1e-9;

/// BaselineKind::finger_proxy, a point, on a mesh that is not null. A frame: the way to the probe
/// up to the first facet; from there to the point of that facet's plane nearest to the probe, up to
/// the next facet; from there along the line of both planes, up to a third facet, which stops it.
/// Its samples are rays.                                                                  [setup]
std::unique_ptr<Baseline> make_finger_proxy(std::shared_ptr<const SurfaceScene> mesh);

} // namespace palpate::internal
