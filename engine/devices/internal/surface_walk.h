// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate::internal {

/// A place of a surface, and how it is pressed into.
struct TouchPlace {
    Vec3 point{0.0};      ///< m, scene frame; on the surface
    Vec3 normal{0.0};     ///< unit, towards free space
    double depth_m = 0.0; ///< along the normal
};

/// A certified proxy that is led along while a path is made: where a hand on that path would be
/// held. Not for the loop.
class ProxyFollower {
public:
    explicit ProxyFollower(const OrbitTarget& target); ///< that has make_contacts [setup]

    void restart(const Vec3& probe);
    /// Where the target holds it before the next frame, m: the proxy, or the front of a soft
    /// target.
    const Vec3& held_at() const noexcept { return held_at_; }
    void follow(const Vec3& probe); ///< a frame

private:
    std::vector<std::unique_ptr<SurfaceContact>> contacts_;
    double stiffness_n_per_m_;
    std::size_t surface_;
    SteadyClock clock_; // decides nothing of method adaptive
    Subdivision subdivision_;
    Vec3 proxy_{0.0}, held_at_{0.0};
};

/// One for a target; null where nobody knows what holds a proxy there.                   [setup]
std::unique_ptr<ProxyFollower> follower_of(const OrbitTarget& target);

/// Leads a probe over places of a surface, at one speed, a state per frame, so that it is never
/// deeper behind what holds it than it was told: where a proxy cannot follow, the probe waits for
/// it, and where it has lost it, it comes anew from free space, which is a new trial.
class SurfaceWalk {
public:
    struct Settings {
        double speed_m_per_s = 0.2;
        double rate_hz = 1000.0;
        std::size_t most_frames = 0;
        /// Where a probe that is to touch a place can begin, m: free space in front of it. Nothing
        /// where there is none: the place is passed over.
        std::function<std::optional<Vec3>(const TouchPlace& place)> in_front;
    };

    /// The follower may be null: then nobody can say what holds the probe.              [setup]
    SurfaceWalk(Settings settings, std::unique_ptr<ProxyFollower> follower);

    /// Goes over places that follow each other without a gap, as a trial of its own; returns how
    /// many of them it got to or passed over: all, unless there was no frame left. [setup]
    std::size_t add(const std::vector<TouchPlace>& places);

    bool is_full() const noexcept { return states_.size() >= settings_.most_frames; } ///< [any]

    /// Everything so far.
    std::vector<DeviceState> take() { return std::move(states_); }

private:
    void begin_at(const Vec3& start);
    bool step_to(const Vec3& target, double depth_m);

    Settings settings_;
    std::unique_ptr<ProxyFollower> follower_;
    std::vector<DeviceState> states_;
    double step_m_;
    double lag_m_ = 0.0; // of the probe behind where it is to be
};

/// The same places, pressed along the mean of the normals within a depth of each of them, along the
/// way: what is smaller than that does not turn the probe.                               [setup]
std::vector<TouchPlace> with_smooth_normals(std::vector<TouchPlace> places);

} // namespace palpate::internal
