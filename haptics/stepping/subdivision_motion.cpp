// SPDX-License-Identifier: Apache-2.0
// Bodies that move between two frames, and where the proxy is then. Only afterwards the frame
// begins, in which every body stands still (composition.md 2.7).
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <limits>

#include <palpate/geometry/surface_scene.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

// In a longer turn the straight way that is certified in the body's frame would be too far from the
// curve: by r angle^2 / 8 + d angle / 4, with r the distance from the body's origin, whose way is
// d.
constexpr double kLongestTurn = 0.1; // rad
// Pieces of the way to the poses that were set: a turn of pi takes 32 of them.
constexpr int kMostPieces = 64;
// Poses that are tried for one piece.
constexpr int kTriesOfOnePiece = 8;
// The second of them is at least this share of the first: nearer, the proxy is in contact already.
constexpr double kShortestShare = 1.0 / 64.0;
// Ways that surfaces are asked to certify in one frame. Each costs what a chord does.
constexpr int kMostLooks = 1024;
// Of the projection onto the planes of several bodies: any stiffness gives the same point (N/m).
constexpr double kAnyStiffness = 1.0;

} // namespace

/// Moves all bodies to where they were set to be, and with them the proxy: along with the body that
/// it touches, out of the way of one that comes onto it. Where the proxy has no place left, the
/// bodies stop. Nothing passes it: each surface certifies the proxy's way as its body sees it.
Vec3 Subdivision::follow_bodies(Vec3 proxy) noexcept {
    bool moves = false;
    for (LoopSurface& surface : surfaces_) {
        if (!surface.moving()) continue;
        if (surface.moving()->begin_motion())
            moves = true;
        else if (surface.moving()->pose() != RigidPose{})
            result_.flags |= kBodyMoved;
    }
    if (!moves) return proxy;
    result_.flags |= kBodyMoved;
    calming_.restart(); // the probe may be held, but what it presses on is not

    int looks = kMostLooks;
    for (int piece = 0; piece < kMostPieces; ++piece) {
        contacts_.clear();
        double turn = 0.0;
        for (LoopSurface& surface : surfaces_) {
            surface.look_anew();
            if (surface.moving()) turn = std::max(turn, surface.moving()->turn_left());
        }
        double share = turn > kLongestTurn ? kLongestTurn / turn : 1.0;
        Passage passage;
        for (int tries = 0; tries < kTriesOfOnePiece && passage.share < 1.0; ++tries) {
            // Up to where something was met; then half as far, as arcs are no chords.
            if (tries > 0) share *= tries == 1 ? std::max(passage.share, kShortestShare) : 0.5;
            for (LoopSurface& surface : surfaces_)
                if (surface.moving()) surface.moving()->try_pose(share);
            passage = place_beside_bodies(proxy, looks);
        }
        if (passage.share < 1.0) break;
        for (LoopSurface& surface : surfaces_)
            if (surface.moving()) surface.moving()->take_pose(passage.to);
        proxy = passage.to;
        if (share >= 1.0) return proxy;
    }
    result_.flags |= kBodyHeldBack;
    return proxy;
}

/// Where the proxy can be with all bodies at the poses that are tried: along with what it touches,
/// where it is, along with what comes onto it, or between several. If it can be nowhere, how far
/// the best of these ways is free.
Subdivision::Passage Subdivision::place_beside_bodies(const Vec3& proxy, int& looks) noexcept {
    Passage best;
    const auto is_free = [&](const Vec3& to, const LoopSurface* along_with = nullptr) {
        const Passage passage = relative_way(proxy, to, along_with, looks);
        if (passage.share > best.share) best = passage;
        return best.share >= 1.0;
    };
    for (const bool touched : {true, false}) {
        for (const LoopSurface& surface : surfaces_)
            if (surface.moving() && surface.pushes_back() == touched &&
                is_free(surface.moving()->along(proxy), &surface))
                return best;
        if (touched && is_free(proxy)) return best;
    }
    const Passage between = between_bodies(proxy, looks);
    return between.share > best.share ? between : best;
}

/// The nearest place in front of all planes that hold the proxy now, each gone along with its body.
Subdivision::Passage Subdivision::between_bodies(const Vec3& proxy, int& looks) noexcept {
    Vec3 drawn_to = proxy;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        look(i, proxy);
        MovingSurface* body = surfaces_[i].moving();
        if (body && surfaces_[i].pushes_back()) drawn_to = body->along(proxy);
    }
    PrimitiveSet planes;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        PlanePrimitive plane = contacts_[c].plane;
        plane.strength_n = std::numeric_limits<double>::infinity();
        const MovingSurface* body = surfaces_[contacts_[c].surface].moving();
        planes.add(body ? body->along(plane) : plane);
    }
    return relative_way(proxy, solve_proxy(planes, drawn_to, kAnyStiffness).proxy, nullptr, looks);
}

/// How much of the proxy's way to `to` all surfaces certify, each as its own body sees it. Nothing
/// is to be certified of the one with whose body it goes along, if any.
Subdivision::Passage Subdivision::relative_way(const Vec3& from, const Vec3& to,
                                               const LoopSurface* along_with, int& looks) noexcept {
    Passage passage{to, SurfaceScene::answers_at(to) ? 1.0 : 0.0};
    for (std::size_t i = 0; i < surfaces_.size() && passage.share > 0.0; ++i) {
        if (&surfaces_[i] == along_with) continue;
        MovingSurface* body = surfaces_[i].moving();
        if (body ? body->goes_along(from, to) : to == from) continue;
        if (--looks < 0) return {to, 0.0};
        look(i, from);
        const Chord way =
            body ? body->carry_relative(from, to) : surfaces_[i].contact().carry(from, to);
        passage.share = std::min(passage.share, way.fraction);
    }
    return passage;
}

/// A surface certifies ways from where it has looked last: at the beginning of each piece of way,
/// but only where it is asked.
void Subdivision::look(std::size_t surface, const Vec3& proxy) noexcept {
    if (!surfaces_[surface].looks_first()) return;
    contacts_.begin(surface);
    surfaces_[surface].contact().offer(proxy, contacts_);
}

} // namespace palpate
