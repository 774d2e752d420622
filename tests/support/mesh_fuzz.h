// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_loop.h"

namespace palpate::test {

inline std::shared_ptr<const CertifiedMesh>
certified(TriangleMesh mesh,
          CertifiedMesh::Certificates certificates = CertifiedMesh::Certificates::computed) {
    return std::make_shared<const CertifiedMesh>(
        std::make_shared<const TriangleMesh>(std::move(mesh)), certificates);
}

inline std::vector<std::unique_ptr<SurfaceContact>>
one_mesh(std::shared_ptr<const CertifiedMesh> mesh, const MeshContactSettings& settings = {}) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<MeshContact>(std::move(mesh), settings));
    return surfaces;
}

/// How often the mesh winds round a point: 1 inside, 0 outside of a closed one, oriented outwards;
/// by the solid angles of all triangles (Van Oosterom, Strackee 1983). Nothing in common with
/// contact.
inline double winding_number(const TriangleMesh& mesh, const Vec3& point) {
    double sum = 0.0;
    for (const auto& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - point, b = mesh.vertices[t[1]] - point,
                   c = mesh.vertices[t[2]] - point;
        const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
        sum += std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                             glm::dot(b, c) * la +
                                                             glm::dot(c, a) * lb);
    }
    return sum / (2.0 * 3.14159265358979323846);
}

struct FuzzPlan {
    long frames = 10000;
    double reach = 0.08; ///< the probe stays within this of the origin, m
    Vec3 start{0.0};     ///< in free space or inside, m
    unsigned seed = 1;
    int check_every = 1; ///< the side is checked every so many frames
};

struct FuzzResult {
    long frames = 0, in_contact = 0, checks = 0;
    long through = 0; ///< checks that found the proxy on the other side
    long capped = 0;  ///< frames that ended before the proxy was at its end
    long stalled = 0;
    long held_moves = 0;   ///< held frames, after one that was neither, in which bits changed
    double worst_rise = 0; ///< of the distance to the probe within a frame, m
};

/// The frames of a fuzz: PALPATE_FUZZ times as many when that is set.
inline long fuzz_frames(long frames) {
    const char* factor = std::getenv("PALPATE_FUZZ");
    return factor ? frames * std::max(1L, std::strtol(factor, nullptr, 10)) : frames;
}

/// Moves a probe at random: steps of 0.02 to 5 mm, jumps of 100 mm, every seventh frame held.
/// `other_side` says whether a point is where the proxy must never be. A proxy in contact is looked
/// at a hair off the surface, where it is the spring that says on which side: on a facet, that is;
/// on the edges and vertices of folds the spring may point anywhere.
inline FuzzResult fuzz(ContactLoop& loop, const TriangleMesh& mesh, const FuzzPlan& plan,
                       const std::function<bool(const Vec3&)>& other_side) {
    constexpr double kHair = 1e-8; // m: between rounding and anything a mesh has
    const auto on_one_facet = [&](const Vec3& x) {
        int near = 0;
        for (const auto& t : mesh.triangles) {
            const Vec3 q = closest_point_on_triangle(x, mesh.vertices[t[0]], mesh.vertices[t[1]],
                                                     mesh.vertices[t[2]]);
            if (squared_length(q - x) < 1e2 * kHair * kHair) ++near;
        }
        return near <= 1;
    };
    FuzzResult result;
    std::mt19937_64 random(plan.seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
        const double x = normal(random), y = normal(random), z = normal(random);
        return glm::normalize(Vec3{x, y, z});
    };
    Vec3 probe = plan.start;
    loop.start(probe);
    bool exact = true; // the frame before was neither capped nor stalled
    for (long i = 0; i < plan.frames; ++i) {
        const bool held = i % 7 == 6;
        if (!held) {
            const bool jump = unit(random) < 0.02;
            const double step = jump ? 0.1 : 20e-6 * std::pow(250.0, unit(random));
            probe += step * direction();
            const double length = glm::length(probe);
            if (length > plan.reach) probe *= plan.reach * unit(random) / length;
        }
        const Vec3 before = loop.proxy();
        const SubdivisionResult frame = loop.move(probe);
        const Vec3 x = loop.proxy();
        ++result.frames;
        if (frame.contacts > 0) ++result.in_contact;
        if (frame.flags & kEvaluationCap) ++result.capped;
        if (frame.flags & kStalled) ++result.stalled;
        if (held && exact && x != before) ++result.held_moves;
        exact = (frame.flags & (kEvaluationCap | kStalled)) == 0;
        result.worst_rise =
            std::max(result.worst_rise, glm::length(x - probe) - glm::length(before - probe));
        if (i % plan.check_every) continue;
        const Vec3 back = x - probe;
        const double distance = glm::length(back);
        const bool pressed = distance > kHair;
        if (pressed && (!exact || !on_one_facet(x))) continue;
        ++result.checks;
        if (other_side(pressed ? x + kHair / distance * back : x)) ++result.through;
    }
    return result;
}

} // namespace palpate::test
