// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/surface_scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <embree3/rtcore.h>

namespace palpate {
namespace {

// Vertex, origin and arithmetic each round once: three half ulps and room (mesh_contact.md 5 measures 8 nm for an ulp of 4).
constexpr double kErrorUlps = 4.0;

bool in_range(const Vec3& p) noexcept {
    return is_finite(p) && std::abs(p.x) <= SurfaceScene::kQueryRange &&
           std::abs(p.y) <= SurfaceScene::kQueryRange && std::abs(p.z) <= SurfaceScene::kQueryRange;
}

/// The distance from 1 to the next float, at the size of `value`.
double float_ulp(double value) noexcept {
    const float size = static_cast<float>(value);
    return std::nextafter(size, std::numeric_limits<float>::infinity()) - size;
}

}  // namespace

struct SurfaceScene::Embree {
    std::shared_ptr<const TriangleMesh> mesh;
    Vec3 origin{0.0};                      // of Embree's float32, scene frame
    double error_m = 0.0;
    std::vector<std::uint32_t> triangles;  // Embree's primitive -> the mesh's triangle; degenerate ones are left out
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;

    ~Embree() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }

    const Vec3& corner(std::uint32_t triangle, int k) const noexcept {
        return mesh->vertices[mesh->triangles[triangle][static_cast<std::size_t>(k)]];
    }
    SurfaceHit hit_at(const Vec3& position, std::uint32_t triangle, const Vec3& from) const noexcept {
        return {position, triangle_normal(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)),
                glm::length(position - from), triangle};
    }
};

namespace {

void check_mesh(const TriangleMesh& mesh) {
    for (const Vec3& vertex : mesh.vertices)
        if (!in_range(vertex))
            throw std::invalid_argument("surface: a vertex is not finite or beyond 1e6 m; repair the mesh or its unit");
    for (const auto& triangle : mesh.triangles)
        for (std::uint32_t index : triangle)
            if (index >= mesh.vertices.size())
                throw std::invalid_argument("surface: a triangle names a vertex that does not exist");
}

/// What a closest-point search carries through Embree: float32 prunes, the distance is computed in double.
struct ClosestSearch {
    const TriangleMesh* mesh;
    const std::vector<std::uint32_t>* triangles;
    Vec3 point;
    double distance_squared;
    double slack;  // m: how much float32 may err, so that nothing is pruned that double would find
    Vec3 closest{0.0};
    std::uint32_t triangle = 0;
    bool found = false;
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<ClosestSearch*>(arguments->userPtr);
    const std::uint32_t triangle = (*search.triangles)[arguments->primID];
    const auto& corners = search.mesh->triangles[triangle];
    const Vec3 closest = closest_point_on_triangle(search.point, search.mesh->vertices[corners[0]],
                                                   search.mesh->vertices[corners[1]],
                                                   search.mesh->vertices[corners[2]]);
    const double distance_squared = squared_length(closest - search.point);
    const bool nearer = distance_squared < search.distance_squared;
    const bool tied = distance_squared == search.distance_squared && (!search.found || triangle < search.triangle);
    if (!nearer && !tied) return false;
    search.closest = closest;
    search.triangle = triangle;
    search.distance_squared = distance_squared;
    search.found = true;
    const float radius = std::nextafter(static_cast<float>(std::sqrt(distance_squared) + search.slack),
                                        std::numeric_limits<float>::infinity());
    if (radius >= arguments->query->radius) return false;
    arguments->query->radius = radius;
    return true;
}

}  // namespace

SurfaceScene::SurfaceScene(std::shared_ptr<const TriangleMesh> mesh) : embree_(std::make_unique<Embree>()) {
    check_mesh(*mesh);
    Embree& e = *embree_;
    e.mesh = std::move(mesh);
    Box bounds;
    for (const Vec3& vertex : e.mesh->vertices) bounds.add(vertex);
    for (std::uint32_t i = 0; i < e.mesh->triangles.size(); ++i)
        if (!is_degenerate(e.corner(i, 0), e.corner(i, 1), e.corner(i, 2))) e.triangles.push_back(i);
    if (e.triangles.empty()) throw std::invalid_argument("surface: the mesh has no triangle with an area");
    e.origin = bounds.center();
    const Vec3 half = 0.5 * bounds.extent();
    e.error_m = kErrorUlps * float_ulp(std::max({half.x, half.y, half.z}));

    e.device = rtcNewDevice("threads=1,set_affinity=0");
    if (!e.device) throw std::runtime_error("surface: Embree cannot start on this processor");
    e.scene = rtcNewScene(e.device);
    rtcSetSceneFlags(e.scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(e.scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry geometry = rtcNewGeometry(e.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), e.mesh->vertices.size()));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), e.triangles.size()));
    if (vertices && indices) {
        for (const Vec3& vertex : e.mesh->vertices)
            for (int axis = 0; axis < 3; ++axis) *vertices++ = static_cast<float>(vertex[axis] - e.origin[axis]);
        for (std::uint32_t triangle : e.triangles)
            for (std::uint32_t index : e.mesh->triangles[triangle]) *indices++ = index;
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(e.scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    rtcCommitScene(e.scene);
    if (const RTCError error = rtcGetDeviceError(e.device); error != RTC_ERROR_NONE)
        throw std::runtime_error("surface: Embree could not build the scene (error " +
                                 std::to_string(static_cast<int>(error)) + "); is there enough memory?");
}

SurfaceScene::~SurfaceScene() = default;

const TriangleMesh& SurfaceScene::mesh() const noexcept { return *embree_->mesh; }

double SurfaceScene::query_error_m() const noexcept { return embree_->error_m; }

std::optional<SurfaceHit> SurfaceScene::first_hit(const Vec3& from, const Vec3& to) const noexcept {
    const Embree& e = *embree_;
    if (!in_range(from) || !in_range(to)) return std::nullopt;
    const Vec3 chord = to - from;
    const double length = glm::length(chord);
    const Vec3 direction = chord / length;
    // A segment without a float32 length has no direction that Embree could follow.
    if (!(length > 0.0) || !is_finite(direction)) return std::nullopt;

    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(from.x - e.origin.x);
    ray.ray.org_y = static_cast<float>(from.y - e.origin.y);
    ray.ray.org_z = static_cast<float>(from.z - e.origin.z);
    ray.ray.dir_x = static_cast<float>(direction.x);
    ray.ray.dir_y = static_cast<float>(direction.y);
    ray.ray.dir_z = static_cast<float>(direction.z);
    ray.ray.tnear = 0.0f;
    ray.ray.tfar = static_cast<float>(length + e.error_m);
    ray.ray.mask = 0xffffffffu;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(e.scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

    // The same intersection again in double. Within the triangle's plane a ray has no one point: Embree's then.
    const std::uint32_t triangle = e.triangles[ray.hit.primID];
    const Vec3& a = e.corner(triangle, 0);
    const Vec3& b = e.corner(triangle, 1);
    const Vec3& c = e.corner(triangle, 2);
    const Vec3 normal = triangle_normal(a, b, c);
    const double towards = glm::dot(normal, direction);
    double t = ray.ray.tfar;
    if (towards != 0.0) {
        const double exact = glm::dot(normal, a - from) / towards;
        if (std::isfinite(exact)) t = exact;
    }
    const Vec3 position = closest_point_on_triangle(from + std::clamp(t, 0.0, length) * direction, a, b, c);
    if (glm::dot(position - from, direction) > length + e.error_m) return std::nullopt;
    SurfaceHit hit = e.hit_at(position, triangle, from);
    hit.distance_m = std::min(hit.distance_m, length);
    return hit;
}

std::optional<SurfaceHit> SurfaceScene::closest_point(const Vec3& point, double radius_m) const noexcept {
    const Embree& e = *embree_;
    if (!in_range(point) || !(radius_m > 0.0) || !(radius_m <= kQueryRange)) return std::nullopt;
    const Vec3 local = point - e.origin;
    // Float32 of a distant query point errs by its own size, not by the mesh's.
    const double size = std::max({std::abs(local.x), std::abs(local.y), std::abs(local.z), radius_m});
    const double slack = e.error_m + kErrorUlps * float_ulp(size);
    ClosestSearch search{e.mesh.get(), &e.triangles, point, radius_m * radius_m, slack};

    RTCPointQuery query{};
    query.x = static_cast<float>(local.x);
    query.y = static_cast<float>(local.y);
    query.z = static_cast<float>(local.z);
    query.radius = static_cast<float>(radius_m + slack);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(e.scene, &query, &context, visit, &search);
    if (!search.found) return std::nullopt;
    return e.hit_at(search.closest, search.triangle, point);
}

}  // namespace palpate
