// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/internal/surface_walk.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate::internal {
namespace {

constexpr double kLost = 2e-3;   // m that a probe waits for its proxy at most, before a new trial
constexpr double kNoMean = 1e-3; // of normals, below which they cancel each other

/// The point of a ball that is nearest to another.
Vec3 nearest_in_ball(const Vec3& point, const Vec3& center, double radius) {
    const Vec3 away = point - center;
    const double distance = glm::length(away);
    return distance <= radius ? point : center + (radius / distance) * away;
}

std::vector<SurfaceContact*>
pointers_to(const std::vector<std::unique_ptr<SurfaceContact>>& contacts) {
    std::vector<SurfaceContact*> pointers;
    pointers.reserve(contacts.size());
    for (const auto& contact : contacts)
        pointers.push_back(contact.get());
    return pointers;
}

/// What is soft of them. A damper would only bring the tip nearer to the front.
std::vector<SurfaceFinish> finish_of(const OrbitTarget& target) {
    std::vector<SurfaceFinish> finish(target.softness.size());
    for (std::size_t i = 0; i < finish.size(); ++i) {
        finish[i].softness = target.softness[i];
        finish[i].softness.damping = 0.0;
    }
    return finish;
}

} // namespace

ProxyFollower::ProxyFollower(const OrbitTarget& target)
    : contacts_(target.make_contacts()), stiffness_n_per_m_(target.stiffness_n_per_m),
      surface_(target.surface),
      subdivision_({}, pointers_to(contacts_), {}, clock_, finish_of(target)) {}

void ProxyFollower::restart(const Vec3& probe) {
    proxy_ = held_at_ = probe;
    subdivision_.restart(proxy_);
}

void ProxyFollower::follow(const Vec3& probe) {
    FrameContext frame;
    frame.probe = probe;
    frame.start = proxy_;
    frame.stiffness = stiffness_n_per_m_;
    proxy_ = held_at_ = subdivision_.advance(frame).proxy;
    const Subdivision::Pressed& pressed = subdivision_.pressed();
    if (pressed.indentation_m > 0.0 && pressed.surface == surface_) held_at_ = pressed.front;
}

std::unique_ptr<ProxyFollower> follower_of(const OrbitTarget& target) {
    if (!target.make_contacts) return nullptr;
    return std::make_unique<ProxyFollower>(target);
}

SurfaceWalk::SurfaceWalk(Settings settings, std::unique_ptr<ProxyFollower> follower)
    : settings_(std::move(settings)), follower_(std::move(follower)),
      step_m_(settings_.speed_m_per_s / settings_.rate_hz) {}

/// A new trial.
void SurfaceWalk::begin_at(const Vec3& start) {
    DeviceState state;
    state.time_s = static_cast<double>(states_.size()) / settings_.rate_hz;
    state.position = start;
    state.trial = states_.empty() ? 0 : states_.back().trial + 1;
    states_.push_back(state);
    if (follower_) follower_->restart(state.position);
    lag_m_ = 0.0;
}

/// One frame towards a target, as far as the proxy lets it.
bool SurfaceWalk::step_to(const Vec3& target, double depth_m) {
    if (is_full()) return false;
    const Vec3 last = states_.back().position;
    Vec3 probe = target;
    if (follower_) {
        // A proxy only comes nearer to a probe: who is within this now will be then. On an even
        // surface it is a step behind.
        const double reach = std::hypot(depth_m, step_m_);
        probe = nearest_in_ball(target, follower_->held_at(), reach);
    }
    const Vec3 way = probe - last;
    const double length = glm::length(way);
    if (length > step_m_) probe = last + (step_m_ / length) * way;
    lag_m_ = glm::distance(probe, target);
    if (follower_) follower_->follow(probe);

    DeviceState state;
    state.time_s = static_cast<double>(states_.size()) / settings_.rate_hz;
    state.position = probe;
    state.velocity = (probe - last) * settings_.rate_hz;
    state.trial = states_.back().trial;
    states_.push_back(state);
    return true;
}

std::size_t SurfaceWalk::add(const std::vector<TouchPlace>& places) {
    constexpr double kLagging = 1e-6; // m: less is rounding
    const auto target_of = [](const TouchPlace& place) {
        return place.point - place.depth_m * place.normal;
    };
    for (std::size_t next = 0; next < places.size();) {
        if (is_full()) return next;
        const std::optional<Vec3> start = settings_.in_front(places[next]);
        if (!start) {
            ++next;
            continue;
        }
        begin_at(*start);
        // From free space through the first place, and on over the others.
        std::vector<std::pair<Vec3, double>> corners{
            {states_.back().position, places[next].depth_m}};
        for (std::size_t i = next; i < places.size(); ++i)
            corners.push_back({target_of(places[i]), places[i].depth_m});
        std::size_t corner = 0;
        double along = 0.0; // m from the corner
        while (corner + 1 < corners.size()) {
            const auto& [from, depth_from] = corners[corner];
            const auto& [to, depth_to] = corners[corner + 1];
            const double length = glm::distance(from, to);
            if (along >= length) {
                along -= length;
                ++corner;
                continue;
            }
            const double share = along / length;
            if (!step_to(from + share * (to - from), std::max(depth_from, depth_to)))
                return next + corner;
            if (lag_m_ > kLost && corner > 0) break;
            // Who waits is waited for.
            along += lag_m_ > kLagging ? 0.5 * step_m_ : step_m_;
        }
        // A piece of way is left behind where the proxy was lost: at least one place, so that this
        // ends.
        next += std::max<std::size_t>(corner, 1);
        if (corner + 1 >= corners.size()) break;
    }
    return places.size();
}

std::vector<TouchPlace> with_smooth_normals(std::vector<TouchPlace> places) {
    std::vector<double> along{0.0};    // m from the first place
    std::vector<Vec3> sums{Vec3{0.0}}; // of the normals before each place
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (i > 0)
            along.push_back(along[i - 1] + glm::distance(places[i - 1].point, places[i].point));
        sums.push_back(sums.back() + places[i].normal);
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
        // As far to either side, so that a round way is pressed into radially; less at its ends.
        const double half =
            std::min({places[i].depth_m, along[i] - along.front(), along.back() - along[i]});
        const auto first = std::lower_bound(along.begin(), along.end(), along[i] - half);
        const auto end = std::upper_bound(along.begin(), along.end(), along[i] + half);
        const Vec3 sum = sums[static_cast<std::size_t>(end - along.begin())] -
                         sums[static_cast<std::size_t>(first - along.begin())];
        if (glm::length(sum) > kNoMean) places[i].normal = glm::normalize(sum);
    }
    return places;
}

} // namespace palpate::internal
