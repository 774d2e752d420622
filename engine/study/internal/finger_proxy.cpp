// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/finger_proxy.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <palpate/engine/study/internal/held_planes.h>

namespace palpate::internal {
namespace {

class FingerProxy final : public Baseline {
public:
    explicit FingerProxy(std::shared_ptr<const SurfaceScene> mesh) : mesh_(std::move(mesh)) {}
    void restart(const Vec3& probe) noexcept override { proxy_ = probe; }
    Step move(const Vec3& probe) noexcept override {
        HeldPlanes held;
        bool touches = false;
        while (!held.is_full()) {
            const Vec3 goal = held.goal(proxy_, probe);
            const std::optional<SurfaceHit> hit = met(goal);
            if (!hit) {
                proxy_ = goal;
                break;
            }
            touches = true;
            held.add(stop_at(*hit, goal));
        }
        return {proxy_, touches};
    }
    std::uint64_t samples() const noexcept override { return rays_; }

private:
    std::optional<SurfaceHit> met(const Vec3& goal) noexcept {
        ++rays_;
        return mesh_->first_hit(proxy_, goal);
    }
    /// Goes as far as the clearance lets it: back along the way, which is known to be free. The
    /// facet's normal, towards where the proxy is.
    Vec3 stop_at(const SurfaceHit& hit, const Vec3& goal) noexcept {
        const Vec3 way = goal - proxy_; // not 0: nothing is met on no way
        const double length_m = glm::length(way);
        const double slope = glm::dot(way, hit.normal) / length_m;
        const double back_m = kFacetClearance_m / std::max(std::abs(slope), kLeastSlope);
        const double free_m = std::max(0.0, glm::dot(hit.position - proxy_, way) / length_m);
        proxy_ += std::max(0.0, free_m - back_m) / length_m * way;
        return slope > 0.0 ? -hit.normal : hit.normal;
    }

    static constexpr double kLeastSlope = 1e-6; // then 1 mm back: more than a frame's way

    std::shared_ptr<const SurfaceScene> mesh_;
    std::uint64_t rays_ = 0;
    Vec3 proxy_{0.0};
};

} // namespace

std::unique_ptr<Baseline> make_finger_proxy(std::shared_ptr<const SurfaceScene> mesh) {
    return std::make_unique<FingerProxy>(std::move(mesh));
}

} // namespace palpate::internal
