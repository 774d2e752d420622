// SPDX-License-Identifier: Apache-2.0
#pragma once

// Embree 3 or 4, whichever the build found (PALPATE_EMBREE, CMakeLists.txt): what differs between
// them is here, and what they share is used by its own name.
#if PALPATE_EMBREE == 4
#include <embree4/rtcore.h>
#elif PALPATE_EMBREE == 3
#include <embree3/rtcore.h>
#else
#error "PALPATE_EMBREE has to be 3 or 4, the version of Embree that is linked"
#endif

namespace palpate::internal {

#if PALPATE_EMBREE == 4
/// What Embree hands to a callback along with a ray. Whoever derives a query from it, or begins one
/// with it, gets the whole query back.
using RayContext = RTCRayQueryContext;
#else
using RayContext = RTCIntersectContext;
#endif

/// Sends a ray through the scene; the callbacks of its geometries get `context`.       [any]
inline void intersect(RTCScene scene, RayContext& context, RTCRayHit& ray) noexcept {
#if PALPATE_EMBREE == 4
    rtcInitRayQueryContext(&context);
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    rtcIntersect1(scene, &ray, &arguments);
#else
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &ray);
#endif
}

} // namespace palpate::internal
