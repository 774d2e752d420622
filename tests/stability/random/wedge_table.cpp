// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/wedge_table.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <span>

#include <fmt/format.h>

#include "tests/stability/random/random_meshes.h"

#include "tests/support/stepping_methods.h"

namespace palpate::stability {
namespace {

using test::ContactLoop;
using test::Kind;

constexpr double kMesh_m = 20e-3; // length of a mesh's faces
constexpr double kHard_n = std::numeric_limits<double>::infinity();
constexpr double kGrid_m = 8e-3; // half of the voxels' cube

double half_angle(double angle_deg) { return 0.5 * angle_deg * std::numbers::pi / 180.0; }

/// Distance into the body's faces, m; > 0 inside. The edge is the y axis, the body lies below.
double inside(WedgeShape shape, double angle_deg, const Vec3& p) {
    // A groove's body fills what is left round a groove that opens upwards.
    const bool groove = shape == WedgeShape::groove;
    const double half = half_angle(groove ? 360.0 - angle_deg : angle_deg);
    const double right = -(std::cos(half) * p.x + std::sin(half) * p.z);
    const double left = std::cos(half) * p.x - std::sin(half) * p.z;
    return groove ? std::max(left, right) : std::min(left, right);
}

/// A block with a groove along y.
TriangleMesh groove_mesh(double angle_deg) {
    const double half = half_angle(angle_deg), length = 3.0 * kMesh_m;
    const double x = length * std::sin(half), z = length * std::cos(half);
    TriangleMesh mesh; // of each end: corner, right rim, right foot, left foot, left rim
    for (const double y : {-kMesh_m, kMesh_m})
        for (const Vec3& p : {Vec3{0, y, 0}, Vec3{x, y, z}, Vec3{x + kMesh_m, y, -kMesh_m},
                              Vec3{-x - kMesh_m, y, -kMesh_m}, Vec3{-x, y, z}})
            mesh.vertices.push_back(p);
    for (std::uint32_t k = 1; k < 4; ++k) {
        mesh.triangles.push_back({0, k + 1, k});
        mesh.triangles.push_back({5, 5 + k, 6 + k});
    }
    for (std::uint32_t k = 0; k < 5; ++k) {
        const std::uint32_t next = (k + 1) % 5;
        mesh.triangles.push_back({k, next, 5 + next});
        mesh.triangles.push_back({k, 5 + next, 5 + k});
    }
    return mesh;
}

std::shared_ptr<const CertifiedMesh> mesh_of(WedgeShape shape, double angle_deg) {
    return test::certified(shape == WedgeShape::wedge ? prism(angle_deg, kMesh_m)
                                                      : groove_mesh(angle_deg));
}

/// Voxels that lie askew to the faces, as those of a scan do.
std::shared_ptr<const ScalarField> voxels_of(WedgeShape shape, double angle_deg) {
    constexpr int kVoxels = 2 * static_cast<int>(kGrid_m / kWedgeVoxel_m) + 1;
    const Quaternion turn = glm::angleAxis(0.5, glm::normalize(Vec3{0.3, -1.1, 0.7}));
    AffineTransform frame;
    frame.linear = kWedgeVoxel_m * glm::mat3_cast(turn);
    frame.offset = -(frame.linear * Vec3(0.5 * (kVoxels - 1) + 0.2));
    return std::make_shared<GridField>(
        test::sampled({kVoxels, kVoxels, kVoxels}, frame,
                      [&](const Vec3& p) { return inside(shape, angle_deg, p); }),
        -1.0F);
}

} // namespace

test::Surfaces wedge_surfaces(WedgeShape shape, double angle_deg, Kind kind, double strength_n) {
    LevelSettings level;
    level.strength_n = strength_n;
    const double opening = shape == WedgeShape::wedge ? angle_deg : 360.0 - angle_deg;
    switch (kind) {
    case Kind::formula:
        return test::one_surface(make_wedge(opening), level);
    case Kind::volume:
        return test::one_surface(voxels_of(shape, angle_deg), level);
    case Kind::mesh:
        return test::one_mesh(mesh_of(shape, angle_deg), MeshContactSettings{strength_n});
    case Kind::guarded:
        break;
    }
    test::Surfaces surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(voxels_of(shape, angle_deg), level,
                                                        mesh_of(shape, angle_deg), kWedgeLeash_m));
    return surfaces;
}

namespace {

/// A hand that follows places, and what it measures.
class Hand {
public:
    Hand(WedgeShape shape, double angle_deg, Kind kind, SteppingMethod method)
        : shape_(shape), loop_(test::loop_of(test::stepping_of(method),
                                             wedge_surfaces(shape, angle_deg, kind, kHard_n))),
          free_m_(kind == Kind::volume || kind == Kind::guarded ? kWedgeVoxel_m : 1e-6) {
        result_.angle_deg = angle_deg;
    }

    void start(const Vec3& probe) { loop_->start(probe_ = probe); }
    void go(const Vec3& to) {
        constexpr int kFrames = 120;
        const Vec3 from = probe_;
        for (int i = 1; i <= kFrames; ++i)
            frame(from + (static_cast<double>(i) / kFrames) * (to - from));
    }
    void hold() {
        constexpr int kFrames = 600, kRest = 500;
        for (int i = 0; i < kFrames; ++i) {
            const Vec3 before = loop_->proxy();
            frame(probe_);
            if (i >= kRest)
                result_.rest_m = std::max(result_.rest_m, glm::length(loop_->proxy() - before));
        }
    }
    const WedgeResult& result() const { return result_; }

private:
    void frame(const Vec3& probe) {
        probe_ = probe;
        loop_->move(probe);
        const auto depth = [&](const Vec3& p) { return inside(shape_, result_.angle_deg, p); };
        // Of a chord its ends, and where it goes through the middle.
        const std::span<const Vec3> path = loop_->subdivision().path();
        for (std::size_t i = 0; i < path.size(); ++i) {
            const Vec3& from = path[i > 0 ? i - 1 : 0];
            const Vec3 middle = from + share_at_middle(from, path[i]) * (path[i] - from);
            result_.penetration_m =
                std::max({result_.penetration_m, depth(path[i]), depth(middle)});
        }
        bool in_sight = depth(probe) < -free_m_; // nothing of the body is between proxy and probe
        constexpr int kLooks =
            60; // on the way, ever nearer to the proxy: the body may be thin there
        for (int k = 0; k < kLooks; ++k)
            in_sight = in_sight &&
                       depth(loop_->proxy() + std::pow(0.8, k) * (probe - loop_->proxy())) <= 1e-12;
        if (in_sight)
            result_.ghost_n = std::max(result_.ghost_n, ContactLoop::kStiffness *
                                                            glm::length(loop_->proxy() - probe));
    }

    WedgeShape shape_;
    std::unique_ptr<ContactLoop> loop_;
    double free_m_;
    Vec3 probe_{0.0};
    WedgeResult result_;
};

/// On a face, pressed, and up beyond the edge, where nothing is; then onto the edge from
/// above.
void feel_edge(Hand& hand, double angle_deg) {
    const double half = half_angle(angle_deg);
    const Vec3 up{-std::sin(half), 0.0, std::cos(half)}; // along the right face, to the edge
    const Vec3 out{std::cos(half), 0.0, std::sin(half)};
    const Vec3 side{0.0, 0.11e-3, 0.0};
    hand.start(side - 5e-3 * up + 2e-3 * out);
    hand.go(side - 5e-3 * up - kWedgePressed_m * out);
    hand.hold();
    hand.go(side + 6e-3 * up - kWedgePressed_m * out);
    hand.go(side + Vec3{0.05e-3, 0.0, 4e-3});
    hand.go(side + Vec3{0.05e-3, 0.0, -0.5e-3});
    hand.hold();
}

/// Down the middle into the groove and 0.5 mm beyond its corner, and back.
void feel_corner(Hand& hand) {
    const Vec3 side{0.0, 0.11e-3, 0.0};
    hand.start(side + Vec3{0.0, 0.0, 6.5e-3});
    hand.go(side + Vec3{0.01e-3, 0.0, -0.5e-3});
    hand.hold();
    hand.go(side + Vec3{0.0, 0.0, 6.5e-3});
}

} // namespace

WedgeResult feel_wedge(WedgeShape shape, double angle_deg, Kind kind, SteppingMethod method) {
    Hand hand(shape, angle_deg, kind, method);
    if (shape == WedgeShape::wedge)
        feel_edge(hand, angle_deg);
    else
        feel_corner(hand);
    return hand.result();
}

namespace {

constexpr int kFirst_deg = 5, kLast_deg = 175, kStep_deg = 5;

void write_result(std::ostream& out, const WedgeResult& of) {
    out << fmt::format(" {:.3g} | {:.3g} | {:.3g} |", 1e6 * of.penetration_m, 1e3 * of.ghost_n,
                       1e6 * of.rest_m);
}

constexpr const char* kColumns = " wedge: into it, um | ghost, mN | at rest, um | groove: into it, "
                                 "um | ghost, mN | at rest, um |\n";

} // namespace

WedgeResult worst_wedge(WedgeShape shape, Kind kind, SteppingMethod method) {
    WedgeResult worst;
    for (int angle_deg = kFirst_deg; angle_deg <= kLast_deg; angle_deg += kStep_deg) {
        const WedgeResult one = feel_wedge(shape, angle_deg, kind, method);
        worst.penetration_m = std::max(worst.penetration_m, one.penetration_m);
        worst.ghost_n = std::max(worst.ghost_n, one.ghost_n);
        worst.rest_m = std::max(worst.rest_m, one.rest_m);
    }
    return worst;
}

void write_wedge_table(std::ostream& out) {
    out << "| felt by | method |" << kColumns << "|---|---|---|---|---|---|---|---|\n";
    for (const Kind kind : {Kind::formula, Kind::volume, Kind::mesh, Kind::guarded})
        for (const SteppingMethod method : test::kEveryMethod) {
            out << fmt::format("| {} | `{}` |", test::name_of(kind), test::name_of(method));
            for (const WedgeShape shape : {WedgeShape::wedge, WedgeShape::groove})
                write_result(out, worst_wedge(shape, kind, method));
            out << "\n" << std::flush;
        }
}

void write_wedges_by_angle(std::ostream& out) {
    out << "| felt by | method | degrees |" << kColumns
        << "|---|---|---|---|---|---|---|---|---|\n";
    for (const Kind kind : {Kind::formula, Kind::volume, Kind::mesh, Kind::guarded})
        for (const SteppingMethod method : test::kEveryMethod)
            for (int angle_deg = kFirst_deg; angle_deg <= kLast_deg; angle_deg += kStep_deg) {
                out << fmt::format("| {} | `{}` | {} |", test::name_of(kind), test::name_of(method),
                                   angle_deg);
                for (const WedgeShape shape : {WedgeShape::wedge, WedgeShape::groove})
                    write_result(out, feel_wedge(shape, angle_deg, kind, method));
                out << "\n" << std::flush;
            }
}

} // namespace palpate::stability
