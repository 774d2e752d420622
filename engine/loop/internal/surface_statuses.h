// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <palpate/engine/loop/surface_status.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/haptics/stepping/subdivision.h>
#include <palpate/volume/scalar_field.h>

namespace palpate::internal {

/// How the proxy of one loop stands with its surfaces. With samplers of its own: what is asked here
/// changes neither a frame's bits nor its counts. Not for two threads at once.
class SurfaceStatuses {
public:
    /// The scene must outlive it.                                                       [setup]
    explicit SurfaceStatuses(const Scene& scene);

    /// After a frame that ended with the proxy at `proxy`, m, scene frame. Lives until the next
    /// call. [loop]
    std::span<const SurfaceStatus> of(const Subdivision& subdivision, const Vec3& proxy) noexcept;

private:
    double depth_m(std::size_t i, SurfaceStatus::Standing standing, const Vec3& proxy) noexcept;

    const Scene& scene_;
    std::vector<std::unique_ptr<FieldSampler>> samplers_; // null: felt by its mesh alone
    std::vector<SurfaceStatus> statuses_;
};

} // namespace palpate::internal
