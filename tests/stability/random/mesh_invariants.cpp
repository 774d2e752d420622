// SPDX-License-Identifier: Apache-2.0
// A hard mesh is not crossed: the proxy's chords against every triangle, in double; and on closed
// meshes, how often they wind round the proxy. Nothing of it is in common with walking.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "tests/stability/random/invariants.h"

#include "tests/support/mesh_fuzz.h"

namespace palpate::stability {
namespace {

/// A facet's plane and edges, for many chords.
struct Facet {
    std::array<Vec3, 3> corner;
    Vec3 normal;
    std::array<Vec3, 3> inwards; // across each edge, unit, in the plane
    Vec3 low, high;

    double height(const Vec3& p) const { return glm::dot(normal, p - corner[0]); }
    /// How far the foot of a point is within the edges, m; < 0 outside.
    double margin(const Vec3& p) const {
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < 3; ++k)
            least = std::min(least, glm::dot(inwards[k], p - corner[k]));
        return least;
    }
};

std::vector<Facet> facets_of(const TriangleMesh& mesh) {
    std::vector<Facet> facets;
    facets.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        Facet facet;
        for (std::size_t k = 0; k < 3; ++k)
            facet.corner[k] = mesh.vertices[t[k]];
        const Vec3 across =
            glm::cross(facet.corner[1] - facet.corner[0], facet.corner[2] - facet.corner[0]);
        if (!(glm::length(across) > 0.0)) continue;
        facet.normal = glm::normalize(across);
        for (std::size_t k = 0; k < 3; ++k)
            facet.inwards[k] = glm::normalize(
                glm::cross(facet.normal, facet.corner[(k + 1) % 3] - facet.corner[k]));
        facet.low = glm::min(glm::min(facet.corner[0], facet.corner[1]), facet.corner[2]);
        facet.high = glm::max(glm::max(facet.corner[0], facet.corner[1]), facet.corner[2]);
        facets.push_back(facet);
    }
    return facets;
}

double half_extent(const TriangleMesh& mesh) {
    Vec3 low(1e300), high(-1e300);
    for (const Vec3& p : mesh.vertices) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const Vec3 extent = high - low;
    return 0.5 * std::max({extent.x, extent.y, extent.z});
}

double farthest(const TriangleMesh& mesh) {
    double most = 0.0;
    for (const Vec3& p : mesh.vertices)
        most = std::max(most, glm::length(p));
    return most;
}

/// What of a height above a facet is none, m: a chord may end so far behind the facet that it is on
/// (mesh_contact.md 7). 2e-11 of the half extent; at least a thousand roundings of a position, each
/// 8 units of double's last place: 1.2 nm at 660 m.
double tolerance_m(const TriangleMesh& mesh) {
    constexpr double kRoundings = 1000.0 * 8.0 * std::numeric_limits<double>::epsilon();
    double largest = 0.0; // coordinate
    for (const Vec3& p : mesh.vertices)
        largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return std::max(2e-11 * half_extent(mesh), kRoundings * largest);
}

/// Chords against triangles. A chord crosses one whose both ends are off its plane, on either side,
/// where it is within its edges. A proxy that comes onto a facet and leaves it has to leave on the
/// side that it came from; who has walked over an edge meanwhile is not judged here.
class Crossing final : public Invariant {
public:
    explicit Crossing(const HardSurface& hard)
        : surface_(*hard.surface), index_(hard.index),
          facets_(facets_of(surface_.mesh.scene->mesh())) {
        const TriangleMesh& mesh = surface_.mesh.scene->mesh();
        off_m_ = 1e-8 * half_extent(mesh) + tolerance_m(mesh); // the first: a hundredth of a skin
    }
    const char* name() const override { return "crossing"; }

    std::optional<std::string> check(const SeenFrame& seen) override {
        const RigidPose& pose = seen.poses[index_];
        const bool same_pose =
            pose.position == pose_.position && pose.orientation == pose_.orientation;
        pose_ = pose;
        if (seen.begins_trial || !same_pose) on_.clear();
        for (std::size_t i = 1; i < seen.path.size(); ++i)
            if (auto wrong = chord(in_body(pose, seen.path[i - 1]), in_body(pose, seen.path[i])))
                return wrong;
        return std::nullopt;
    }

private:
    std::optional<std::string> chord(const Vec3& from, const Vec3& to) {
        ++checks_;
        const Vec3 low = glm::min(from, to) - off_m_, high = glm::max(from, to) + off_m_;
        std::map<std::size_t, int> on; // facets that the chord ends on, and the side it came from
        for (std::size_t i = 0; i < facets_.size(); ++i) {
            const Facet& facet = facets_[i];
            if (facet.low.x > high.x || facet.high.x < low.x || facet.low.y > high.y ||
                facet.high.y < low.y || facet.low.z > high.z || facet.high.z < low.z)
                continue;
            const double a = facet.height(from), b = facet.height(to);
            const bool from_on = std::abs(a) <= off_m_, to_on = std::abs(b) <= off_m_;
            const int side = b > 0.0 ? 1 : -1;
            if (!from_on && !to_on && (a > 0.0) != (b > 0.0)) {
                const Vec3 at = from + (a / (a - b)) * (to - from);
                if (facet.margin(at) > margin_m()) return words("a chord crosses", i);
            }
            const auto was = on_.find(i);
            const int label =
                was == on_.end() || facet.margin(from) <= margin_m() ? 0 : was->second;
            if (to_on && facet.margin(to) > margin_m()) on[i] = from_on ? label : a > 0.0 ? 1 : -1;
            if (from_on && !to_on && label != 0 && label != side)
                return words("the proxy leaves on the other side", i);
        }
        forget_sharp_edges(on);
        on_ = std::move(on);
        return std::nullopt;
    }
    /// On two facets that show each other their backs, as near to their edge as a hair, the proxy
    /// may be on either: who came from beyond the edge was in front of both.
    void forget_sharp_edges(std::map<std::size_t, int>& on) const {
        for (auto& [i, label] : on)
            for (auto& [j, other] : on)
                if (glm::dot(facets_[i].normal, facets_[j].normal) < 0.0) label = other = 0;
    }
    double margin_m() const { return 10.0 * off_m_; }
    std::string words(const char* what, std::size_t facet) const {
        return fmt::format("{} facet {} of {}", what, facet, surface_.name);
    }

    const SceneSurface& surface_;
    std::size_t index_;
    std::vector<Facet> facets_;
    double off_m_ = 0.0;
    RigidPose pose_;
    std::map<std::size_t, int> on_; // 0: not known
};

/// Whether each edge is gone along as often one way as the other.
bool is_closed(const TriangleMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    return std::all_of(edges.begin(), edges.end(),
                       [](const auto& edge) { return edge.second == 0; });
}

/// A closed mesh winds round the proxy as often as at the trial's beginning, whatever way it took.
/// Looked at where it is off the mesh; and where this mesh alone holds it on one facet, a hair off
/// towards where the spring says that it is.
class Side final : public Invariant {
public:
    Side(const HardSurface& hard, bool pure)
        : surface_(*hard.surface), index_(hard.index), on_surface_(hard.place),
          mesh_(surface_.mesh.scene->mesh()), pure_(pure),
          hair_m_(2e-7 * half_extent(mesh_) + 2.0 * tolerance_m(mesh_)) {}
    const char* name() const override { return "side"; }

    std::optional<std::string> check(const SeenFrame& seen) override {
        constexpr int kEvery = 8; // frames: it looks at all triangles
        if (seen.begins_trial) winds_.reset();
        if (seen.begins_trial || seen.frame % kEvery == 0) {
            const auto on_surface = on_surface_.of(seen.report);
            if (!on_surface) return std::nullopt;
            const Vec3 proxy = in_body(seen.poses[index_], *on_surface);
            const Vec3 probe = in_body(seen.poses[index_], seen.state.position);
            const auto place = off_the_mesh(proxy, probe, seen.report);
            if (!place) return std::nullopt;
            const double winds = test::winding_number(mesh_, *place);
            if (!winds_) {
                winds_ = winds;
                return std::nullopt;
            }
            ++checks_;
            if (std::abs(winds - *winds_) > 0.5)
                return fmt::format("{} wound {:.3f} times round the proxy, and now {:.3f}",
                                   surface_.name, *winds_, winds);
        }
        return std::nullopt;
    }

private:
    std::optional<Vec3> off_the_mesh(const Vec3& proxy, const Vec3& probe,
                                     const FrameReport& report) const {
        int near = 0;
        for (const auto& t : mesh_.triangles) {
            const Vec3 q = closest_point_on_triangle(proxy, mesh_.vertices[t[0]],
                                                     mesh_.vertices[t[1]], mesh_.vertices[t[2]]);
            near += glm::length(q - proxy) < 10.0 * hair_m_ ? 1 : 0;
        }
        if (near == 0) return proxy;
        const Vec3 back = proxy - probe;
        const bool ended = (report.flags & (kEvaluationCap | kStalled | kProbeNotFinite)) == 0;
        if (!pure_ || near > 1 || !ended || glm::length(back) < 10.0 * hair_m_) return std::nullopt;
        return proxy + hair_m_ * glm::normalize(back);
    }

    const SceneSurface& surface_;
    std::size_t index_;
    PlaceOn on_surface_;
    const TriangleMesh& mesh_;
    bool pure_;
    double hair_m_;
    std::optional<double> winds_;
};

// Of half a ball's extent: facets are within 1 % of the level, and a chord that is not certified
// may end behind it.
constexpr double kDirectReach = 0.05;

/// Who has been in front of a closed mesh, farther away than a reach, is never so far behind it:
/// the mesh never winds once more round the proxy. Who begins behind may come out. Looked at as
/// Side does. The reach is the leash where the mesh guards a level (contact.md 4): where voxels
/// have holes nothing holds who begins behind. Of contact `direct` it is a share of the body's
/// size. It has no certificate (contact.md 3.4); but where it is alone, it follows a ball's level
/// once it has met a facet, or passed it.
class NeverBehind final : public Invariant {
public:
    NeverBehind(const char* name, const HardSurface& hard, double reach_m)
        : name_(name), surface_(*hard.surface), index_(hard.index), on_surface_(hard.place),
          mesh_(surface_.mesh.scene->mesh()), field_(surface_.baked.field->make_sampler()),
          free_(LevelScale::of(*surface_.baked.field, surface_.level).free),
          reach_m_(reach_m + 2.0 * tolerance_m(mesh_)) {}
    const char* name() const override { return name_; }

    std::optional<std::string> check(const SeenFrame& seen) override {
        constexpr int kEvery = 8; // frames: it looks at all triangles
        if (seen.begins_trial) winds_.reset();
        const auto on_surface = on_surface_.of(seen.report);
        if (seen.frame % kEvery != 0 || !on_surface) return std::nullopt;
        const Vec3 proxy = in_body(seen.poses[index_], *on_surface);
        if (!is_off(proxy)) return std::nullopt;
        const double winds = test::winding_number(mesh_, proxy);
        if (!winds_) {
            if (field_->value(proxy) - surface_.level.level < -2.0 * free_) winds_ = winds;
            return std::nullopt;
        }
        ++checks_;
        if (winds < *winds_ + 0.5) {
            winds_ = std::min(winds, *winds_);
            return std::nullopt;
        }
        return fmt::format("the mesh of {} wound {:.3f} times round the proxy, and now, farther "
                           "away than {} m, {:.3f}",
                           surface_.name, *winds_, reach_m_, winds);
    }

private:
    bool is_off(const Vec3& proxy) const {
        return std::all_of(mesh_.triangles.begin(), mesh_.triangles.end(), [&](const auto& t) {
            const Vec3 q = closest_point_on_triangle(proxy, mesh_.vertices[t[0]],
                                                     mesh_.vertices[t[1]], mesh_.vertices[t[2]]);
            return glm::length(q - proxy) > reach_m_;
        });
    }

    const char* name_;
    const SceneSurface& surface_;
    std::size_t index_;
    PlaceOn on_surface_;
    const TriangleMesh& mesh_;
    std::shared_ptr<FieldSampler> field_;
    double free_;
    double reach_m_;
    std::optional<double> winds_;
};

/// A frame never takes the proxy farther from the probe, where one hard mesh is all that is felt
/// (mesh_contact.md 1): the spring's energy does not rise.
class Nearer final : public Invariant {
public:
    explicit Nearer(const HardSurface& hard) {
        const TriangleMesh& mesh = hard.surface->mesh.scene->mesh();
        rounding_m_ = 1e-10 * half_extent(mesh) + 1e-14 * farthest(mesh);
    }
    const char* name() const override { return "energy"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        if (seen.begins_trial || (seen.report.flags & kProbeNotFinite) || seen.path.empty())
            return std::nullopt;
        ++checks_;
        const double rise_m = glm::length(place_on_surface(seen.report) - seen.state.position) -
                              glm::length(seen.path.front() - seen.state.position);
        if (rise_m <= rounding_m_ + 1e-15 * glm::length(seen.state.position)) return std::nullopt;
        return fmt::format("the frame took the proxy {} m farther from the probe", rise_m);
    }

private:
    double rounding_m_ = 0.0;
};

} // namespace

void add_mesh_invariants(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to) {
    const bool pure = is_pure(watched);
    for (const HardSurface& hard : hard_surfaces(watched)) {
        const SceneSurface& surface = *hard.surface;
        const bool closed = surface.mesh.scene && is_closed(surface.mesh.scene->mesh());
        if (surface.contact == ContactKind::guarded && closed)
            to.push_back(std::make_unique<NeverBehind>("leash", hard, surface.leash_m));
        if (surface.contact == ContactKind::direct && closed &&
            watched.scene.surfaces().size() == 1)
            to.push_back(std::make_unique<NeverBehind>(
                "direct", hard, kDirectReach * half_extent(surface.mesh.scene->mesh())));
        if (!surface.is_felt_by_mesh()) continue;
        to.push_back(std::make_unique<Crossing>(hard));
        if (is_closed(hard.surface->mesh.scene->mesh()))
            to.push_back(std::make_unique<Side>(hard, pure));
        if (pure) to.push_back(std::make_unique<Nearer>(hard));
    }
}

} // namespace palpate::stability
